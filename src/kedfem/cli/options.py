"""What the commands share: exit statuses, arguments and options."""

from pathlib import Path
from typing import Annotated

import typer

USER_ERROR, DEFECT, DOUBTFUL, INTERRUPTED = 2, 3, 4, 130

ScenePath = Annotated[Path, typer.Argument(metavar="SCENE", help="The scene file (TOML).")]
Quick = Annotated[
    bool,
    typer.Option("--quick", help="Plain defaults for what the scene leaves open."),
]
Within = Annotated[
    bool,
    typer.Option("--within", help="Refuse a scene that names files or folders outside its own folder."),
]
