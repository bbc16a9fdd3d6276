"""`kedfem sweep`."""

from pathlib import Path
from typing import Annotated

import typer

from kedfem.cli.options import INTERRUPTED, Quick, ScenePath, Within
from kedfem.cli.screen import err, out, progress, show


def sweep(
    scene: ScenePath,
    over: Annotated[
        list[str],
        typer.Option(
            metavar="KEY=VALUES", help="A key or parameter, and a,b,c or from:to:count; several: a grid."
        ),
    ],
    samples: Annotated[
        int | None, typer.Option(help="Points of a Latin hypercube instead of a grid; each KEY=from:to.")
    ] = None,
    last: Annotated[
        float, typer.Option(metavar="REVOLUTIONS", help="Whose extremes count, the last ones.")
    ] = 1.0,
    workers: Annotated[int | None, typer.Option(help="Processes; as many as there are cores.")] = None,
    cluster: Annotated[
        str | None,
        typer.Option(
            metavar="ADDRESS", help="A Dask scheduler whose workers run the points, as tcp://host:8786."
        ),
    ] = None,
    quick: Quick = False,
    keep: Annotated[bool, typer.Option("--keep", help="Leave a folder of results for each point.")] = False,
    edges: Annotated[
        float | None,
        typer.Option(
            metavar="WIDTH",
            help="Find edges of unstable bands along the first key to this relative width, as 0.001.",
        ),
    ] = None,
    follow: Annotated[
        bool,
        typer.Option(
            "--follow",
            help="Look for each steady motion where that of the point before was found, in the order of the first key.",
        ),
    ] = False,
    folder: Annotated[
        Path | None, typer.Option(help="Where all goes; default: SCENE-sweep beside the scene.")
    ] = None,
    within: Within = False,
) -> None:
    """Run a scene at many values of its keys: peak stresses, joint forces, torque over them. Started again it goes on."""
    from kedfem.errors import SceneError
    from kedfem.scene import read_keys
    from kedfem.sweep import Asked, Base, axes_of, sweep_folder
    from kedfem.sweep import sweep as swept_by
    from kedfem.sweep.cluster import cluster as on_cluster
    from kedfem.tables import sweep_tables

    raw, _ = read_keys(scene, within=within)
    base = Base(raw, scene.parent, scene.stem)
    axes, asked = axes_of(over, raw, samples), Asked(last, workers, quick, keep, edges, follow)
    if follow and samples is not None:
        raise SceneError("--follow: must be without --samples, whose points have no order along a key")
    if cluster is not None and workers is not None:
        raise SceneError(
            "--workers: cannot be combined with --cluster, whose workers are as many as there are"
        )
    try:
        executor = None if cluster is None else on_cluster(cluster, base.folder)
        with progress() as watch:
            done = swept_by(base, axes, asked, folder, watch, executor)
    except KeyboardInterrupt:
        message = (
            f"finished points are in {folder or sweep_folder(base)}; the same command goes on with the others"
        )
        err.print(f"interrupted; {message}", style="yellow", markup=False, soft_wrap=True)
        raise typer.Exit(INTERRUPTED) from None
    show(*sweep_tables(done))
    for name in ("sweep.h5", "sweep.csv", "edges.csv", "sweep.png"):
        if (done.folder / name).exists():
            out.print(f"{done.folder / name}", markup=False, soft_wrap=True)
