"""`kedfem new`: a commented scene to start from."""

from pathlib import Path
from typing import Annotated

import typer

from kedfem.cli.options import option
from kedfem.cli.screen import progress, say
from kedfem.errors import OutputError, SceneError

KINDS = (
    "four-bar", "slider-crank", "cad-slider-crank", "single-arm", "press", "scissor-lift", "excavator", "wishbone",
    "stewart", "robot-arm", "valve-train", "panel",
)  # fmt: skip


def new(
    kind: Annotated[
        str | None, typer.Argument(metavar="KIND", help="One of: " + ", ".join(KINDS) + "; left out with --from.")
    ] = None,
    path: Annotated[Path | None, typer.Argument(metavar="FILE", help="Default: KIND.toml or ASSEMBLY.toml here.")] = None,
    assembly: Annotated[
        Path | None,
        option(
            "A CAD file (STEP, IGES or BREP): its solids become links, joints where they meet are proposed.",
            "ASSEMBLY",
            "--from",
        ),
    ] = None,
    scale: Annotated[float | None, option("Metres per unit of ASSEMBLY, if not its own unit.")] = None,
) -> None:
    """Write a commented scene to start from."""
    if assembly is not None:
        if path is not None or kind in KINDS:
            raise SceneError(f"KIND: must be left out with --from, got '{kind}'")
        _new_from(assembly, Path(kind or f"{assembly.stem}.toml"), scale)
        return
    from importlib.resources import files

    if kind not in KINDS or scale is not None:
        from kedfem.scene.records.wording import one_of

        if scale is not None:
            raise SceneError("--scale: must be combined with --from, got it alone")
        raise SceneError(f"KIND: {one_of(list(KINDS), kind)}")
    templates, target = files("kedfem") / "templates", path or Path(f"{kind}.toml")
    text = (templates / f"{kind.replace('-', '_')}.toml").read_text(encoding="utf-8")
    named = [each for each in templates.iterdir() if f'file = "{each.name}"' in text]
    for each in (target, *(target.parent / part.name for part in named)):
        if each.exists():
            raise _exists(each)
    for part in named:
        _write(target.parent / part.name, part.read_text(encoding="utf-8"))
        say(f"{target.parent / part.name} written")
    _write_new(target, text)


def _new_from(assembly: Path, target: Path, scale: float | None) -> None:
    from kedfem.tables.draft import draft_scene

    if target.exists():
        raise _exists(target)
    if not target.parent.is_dir():
        raise OutputError(f"{target}: must be in a folder that is there, got none at {target.parent}")
    with progress() as watch:
        watch("assembly", 0, 0)
        text = draft_scene(assembly, target.parent, scale)
    _write_new(target, text)


def _exists(target: Path) -> OutputError:
    return OutputError(f"{target}: must be a new file, got one that exists already")


def _write_new(target: Path, text: str) -> None:
    _write(target, text)
    say(f"{target} written; try: kedfem check {target}")


def _write(target: Path, text: str) -> None:
    try:
        with target.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise _exists(target) from None
    except OSError as error:
        raise OutputError(f"{target}: must be a file that can be written, got {error.strerror}") from None
