"""`kedfem export`."""

from pathlib import Path
from typing import Annotated

import typer

from kedfem.cli.options import ScenePath, Within
from kedfem.cli.screen import out, progress


def export(
    scene: ScenePath,
    link: Annotated[str, typer.Option(metavar="NAME", help="The elastic link.")],
    file: Annotated[
        Path | None,
        typer.Option(metavar="FILE", help="NAME.npz or NAME.mat; default: LINK.npz beside the scene."),
    ] = None,
    within: Within = False,
) -> None:
    """Matrices of one elastic link for other programs: mass, stiffness, modes, its joints' ports."""
    from kedfem.export import exported_link, require_ending, write_link
    from kedfem.scene import read_scene

    path = file or scene.with_name(f"{link}.npz")
    require_ending(path)
    loaded = read_scene(scene, within=within)
    with progress() as watch:

        def stage(name: str) -> None:
            watch(name, 0, 0)

        found = exported_link(loaded, link, stage)
    write_link(found, path)
    size, ports = len(found.mass), ", ".join(found.ports) or "none"
    out.print(f"{path}  {found.model}: {size} unknowns, ports {ports}", markup=False, soft_wrap=True)
