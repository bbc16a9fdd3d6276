"""`kedfem export`."""

from pathlib import Path
from typing import Annotated

from kedfem.cli.options import ScenePath, Within, flag, given, option
from kedfem.cli.screen import say, show, stages


def export(
    scene: ScenePath,
    link: Annotated[str | None, option("The elastic link whose matrices.", "NAME")] = None,
    file: Annotated[
        Path | None, option("NAME.npz or NAME.mat for the matrices; default: LINK.npz beside the scene.", "FILE")
    ] = None,
    motion: Annotated[Path | None, option("NAME.csv for the rigid motion of all links.", "FILE")] = None,
    state_space: Annotated[
        Path | None, option("NAME.npz or NAME.mat for the mechanism as a linear system at a position.", "FILE")
    ] = None,
    gltf: Annotated[
        Path | None, option("NAME.glb for the links of the scene's run in motion, for 3-D viewers.", "FILE")
    ] = None,
    modes: Annotated[int, option("Of the linear system: vibrations that are kept.", "N")] = 12,
    at: Annotated[float, option("Of the linear system: when the drive is at the position.", "SECONDS")] = 0.0,
    free: Annotated[
        bool, flag("--free", "For the linear system: the drive releases its joint, and its torque is an input.")
    ] = False,
    within: Within = False,
) -> None:
    """For other programs: matrices of a link, the mechanism as a linear system, motion of all, moving shapes."""
    from kedfem.errors import SceneError

    named = given(link=link, file=file, motion=motion, state_space=state_space, gltf=gltf)
    match [f"--{key.replace('_', '-')}" for key in named]:
        case ["--motion"] if motion:
            say(*_motion(scene, motion, within))
        case ["--state-space"] if state_space:
            say(*_state_space(scene, state_space, (modes, at, free), within))
        case ["--gltf"] if gltf:
            say(*_gltf(scene, gltf, within))
        case ["--link"] | ["--link", "--file"] if link:
            say(*_link(scene, link, file or scene.with_name(f"{link}.npz"), within))
        case got:
            raise SceneError(
                "export: must have --link NAME (with --file FILE, if wanted), --state-space FILE, --motion FILE "
                f"or --gltf FILE, got {', '.join(got) or 'none of them'}: export one after the other"
            )


def _link(scene: Path, link: str, path: Path, within: bool) -> tuple[Path, str]:
    from kedfem.export import exported_link, require_ending, write_link
    from kedfem.scene import read_scene

    require_ending(path)
    loaded = read_scene(scene, within=within)
    with stages() as stage:
        found = exported_link(loaded, link, stage)
    write_link(found, path)
    return path, f"{found.model}: {len(found.mass)} unknowns, ports {', '.join(found.ports) or 'none'}"


def _motion(scene: Path, path: Path, within: bool) -> tuple[Path, str]:
    from kedfem.export import export_motion
    from kedfem.scene import read_scene

    loaded = read_scene(scene, sketch=True, within=within)
    count, warnings = export_motion(loaded, path)
    show([], warnings)
    return path, f"rigid motion of {', '.join(loaded.links)}: {count} time points"


def _state_space(scene: Path, path: Path, how: tuple[int, float, bool], within: bool) -> tuple[Path, str]:
    from kedfem.export import require_ending, state_space, write_state_space
    from kedfem.scene import read_scene

    require_ending(path)
    loaded = read_scene(scene, within=within)
    with stages() as stage:
        found, warnings = state_space(loaded, *how, stage=stage)
    write_state_space(found, path)
    show([], warnings)
    sizes = f"{len(found.A)} states, inputs {', '.join(found.inputs)}, {len(found.outputs)} outputs"
    return path, f"linear system: {sizes}"


def _gltf(scene: Path, path: Path, within: bool) -> tuple[Path, str]:
    from kedfem.errors import OutputError
    from kedfem.report import write_gltf
    from kedfem.scene import read_scene

    folder = read_scene(scene, within=within).results_folder
    if not (folder / "results.h5").exists():
        raise OutputError(f"--gltf: must have the results of a run, got none in {folder}: kedfem run {scene}")
    found = write_gltf(folder, path)
    show([], found.warnings)
    return path, f"{', '.join(found.links)} over {found.frames} frames"
