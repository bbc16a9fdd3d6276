"""`kedfem export`."""

from pathlib import Path
from typing import Annotated

import typer

from kedfem.cli.options import ScenePath, Within
from kedfem.cli.screen import out, progress, show


def export(
    scene: ScenePath,
    link: Annotated[str | None, typer.Option(metavar="NAME", help="The elastic link whose matrices.")] = None,
    file: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE", help="NAME.npz or NAME.mat for the matrices; default: LINK.npz beside the scene."
        ),
    ] = None,
    motion: Annotated[
        Path | None, typer.Option(metavar="FILE", help="NAME.csv for the rigid motion of all links.")
    ] = None,
    within: Within = False,
) -> None:
    """For other programs: matrices of a link, or motion of all."""
    from kedfem.errors import SceneError

    if motion is not None and link is None and file is None:
        _motion(scene, motion, within)
    elif link is not None and motion is None:
        _link(scene, link, file or scene.with_name(f"{link}.npz"), within)
    else:
        given = {"--link": link, "--file": file, "--motion": motion}
        got = ", ".join(key for key, value in given.items() if value is not None) or "neither"
        raise SceneError(
            f"export: must have --link NAME (with --file FILE, if wanted) or --motion FILE, got {got}: "
            "export matrices and motion one after the other"
        )


def _link(scene: Path, link: str, path: Path, within: bool) -> None:
    from kedfem.export import exported_link, require_ending, write_link
    from kedfem.scene import read_scene

    require_ending(path)
    loaded = read_scene(scene, within=within)
    with progress() as watch:

        def stage(name: str) -> None:
            watch(name, 0, 0)

        found = exported_link(loaded, link, stage)
    write_link(found, path)
    size, ports = len(found.mass), ", ".join(found.ports) or "none"
    out.print(f"{path}  {found.model}: {size} unknowns, ports {ports}", markup=False, soft_wrap=True)


def _motion(scene: Path, path: Path, within: bool) -> None:
    from kedfem.export import export_motion
    from kedfem.scene import read_scene

    loaded = read_scene(scene, sketch=True, within=within)
    count, warnings = export_motion(loaded, path)
    show([], warnings)
    out.print(
        f"{path}  rigid motion of {', '.join(loaded.links)}: {count} time points",
        markup=False,
        soft_wrap=True,
    )
