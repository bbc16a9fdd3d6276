"""What the commands share: exit statuses, arguments and options."""

from pathlib import Path
from typing import Annotated, Any

import typer

USER_ERROR, DEFECT, DOUBTFUL, INTERRUPTED = 2, 3, 4, 130


def goes_to(default: str, what: str = "all goes") -> Any:
    """The option that says where a command writes."""
    return typer.Option(help=f"Where {what}; default: {default}.")


def given(**keys: Any) -> dict[str, Any]:
    """Keys of a scene, of options that are given."""
    return {key: value for key, value in keys.items() if value is not None}


ScenePath = Annotated[Path, typer.Argument(metavar="SCENE", help="The scene file (TOML).")]
Quick = Annotated[bool, typer.Option("--quick", help="Plain defaults for what the scene leaves open.")]
Within = Annotated[
    bool, typer.Option("--within", help="Refuse a scene that names files or folders outside its own folder.")
]
Solid = Annotated[str | None, typer.Option(metavar="NAME", help="Which solid of an assembly.")]
Size = Annotated[
    str | None, typer.Option(metavar="LENGTH", help="Edge length of a part's elements, e.g. '3 mm'.")
]
Across = Annotated[
    int | None, typer.Option(help="Elements across a part's smallest width; 2 if nothing else is given.")
]
Unknowns = Annotated[int | None, typer.Option(help="About so many unknowns of a part.")]
ElementKind = Annotated[str, typer.Option(metavar="KIND", help="Of a part: hex27, hex20, hex8 or tet10.")]
Scale = Annotated[float | None, typer.Option(help="Metres per unit of a part's file, if not its own unit.")]
