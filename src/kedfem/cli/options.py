"""Exit statuses, arguments and options that several commands share."""

from pathlib import Path
from typing import Annotated, Any

import typer

USER_ERROR, DEFECT, UNRELIABLE, INTERRUPTED = 2, 3, 4, 130


def option(text: str, metavar: str | None = None, *names: str) -> Any:
    """An option with a value: what it is, and what its value is called."""
    return typer.Option(*names, metavar=metavar, help=text)


def flag(name: str, text: str) -> Any:
    """An option without a value."""
    return typer.Option(name, help=text)


def goes_to(default: str, what: str = "all goes") -> Any:
    """The option that says where a command writes."""
    return option(f"Where {what}; default: {default}.")


def given(**keys: Any) -> dict[str, Any]:
    """Keys of a scene, of options that are given."""
    return {key: value for key, value in keys.items() if value is not None}


ScenePath = Annotated[Path, typer.Argument(metavar="SCENE", help="The scene file (TOML).")]
Quick = Annotated[bool, flag("--quick", "Plain defaults for what the scene leaves open.")]
Within = Annotated[bool, flag("--within", "Refuse a scene that names files or folders outside its own folder.")]
Solid = Annotated[str | None, option("Which solid of an assembly.", "NAME")]
Size = Annotated[str | None, option("Edge length of a part's elements, e.g. '3 mm'.", "LENGTH")]
Across = Annotated[int | None, option("Elements across a part's smallest width; 2 if nothing else is given.")]
Unknowns = Annotated[int | None, option("About so many unknowns of a part.")]
ElementKind = Annotated[str, option("Of a part: hex27, hex20, hex8 or tet10.", "KIND")]
Scale = Annotated[float | None, option("Metres per unit of a part's file, if not its own unit.")]
