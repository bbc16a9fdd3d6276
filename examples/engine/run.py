"""The engine with a split big end; run with `python examples/engine/run.py`."""

from math import pi
from pathlib import Path

import numpy as np

from kedfem.analysis import analyse
from kedfem.mesh.session import gmsh_model
from kedfem.scene import read_scene

HERE = Path(__file__).parent
STEP = HERE.parents[1] / "geometry" / "crank_train.step"
RADIUS, ROD, SPEED = 0.04, 0.14, 100 * pi
DENSITY = {"piston": 2700, "pin": 7850, "ring_1": 7200, "ring_2": 7200, "ring_3": 7200}


def main() -> None:
    run = analyse(read_scene(HERE / "scene.toml"))
    channels = run.results.channels
    # where gases are exchanged no pressure is on: the rod's pin carries the inertia of what slides, m r ω² (1 + λ)
    volumes = volumes_in_mm3()
    mass = sum(density * volumes[part] * 1e-9 for part, density in DENSITY.items())
    inertia = mass * RADIUS * SPEED**2 * (1 + RADIUS / ROD)
    first, last = (abs(channels["joints/C/force"][1][row, 0]) for row in (0, -1))
    print(
        f"pin at the top dead centre: {first:.0f} N, and {last:.0f} N after two revolutions; "
        f"m r ω² (1 + λ) is {inertia:.0f} N"
    )
    assert max(abs(first / inertia - 1), abs(last / inertia - 1)) < 0.02
    # the guide pushes across its direction only; stiff links: the torque is that of rigid ones
    guide = channels["joints/guide/force"][1]
    assert np.abs(guide[:, 0]).max() < 1e-6 * np.abs(guide[:, 1]).max()
    torque, rigid = (channels[name][1][:, 0] for name in ("drive/torque", "drive/rigid_torque"))
    difference = float(np.sqrt(np.mean((torque - rigid) ** 2) / np.mean(rigid**2)))
    print(f"drive torque: {100 * difference:.1f} % from that of the rigid linkage")
    assert difference < 0.1  # it rings after each firing
    assert run.peak is not None
    print(f"highest von Mises stress {run.peak.stress / 1e6:.0f} MPa in the {run.peak.link}; see {run.folder}")


def volumes_in_mm3() -> dict[str, float]:
    """The volume of every solid of the assembly, by its name."""
    with gmsh_model() as gmsh:
        gmsh.model.occ.importShapes(str(STEP))
        gmsh.model.occ.synchronize()
        solids = [tag for _, tag in gmsh.model.getEntities(3)]
        return {gmsh.model.getEntityName(3, tag).split("/")[-1]: gmsh.model.occ.getMass(3, tag) for tag in solids}


if __name__ == "__main__":
    main()
