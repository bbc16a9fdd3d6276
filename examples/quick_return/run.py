"""A quick-return with a flexible arm; run with `python examples/quick_return/run.py`."""

from pathlib import Path

import numpy as np

from kedfem.analysis import analyse
from kedfem.scene import read_scene

CRANK, FRAME, PIN, STRESS = (
    0.1,
    0.3,
    1.0,
    0.6,
)  # m; the stress is read at 0.6 of the way from the pivot to the drawn pin
WIDTH, THICKNESS = 0.02, 0.01


def main() -> None:
    run = analyse(read_scene(Path(__file__).with_name("scene.toml")))
    channels = {name: values for name, (_, values) in run.results.channels.items()}
    angle = run.results.angle
    pin = np.stack([CRANK * np.cos(angle), FRAME + CRANK * np.sin(angle)], axis=1)
    along = pin / np.linalg.norm(pin, axis=1)[:, None]
    across = np.stack([-along[:, 1], along[:, 0]], axis=1)
    alpha = np.arcsin(CRANK / FRAME)
    print(f"cutting stroke to return: {(np.pi + 2 * alpha) / (np.pi - 2 * alpha):.3f} in time")

    # no friction: the pin presses across the arm as it is bent, which slopes against the straight one
    slot = channels["joints/slot/force"][:, :2]
    leak = np.abs((slot * along).sum(axis=1)).max() / np.abs(slot).max()
    print(f"force of the slot {np.abs(slot).max():.1f} N, along the straight arm {leak:.1e} of that")
    assert 1e-4 < leak < 1e-2

    # below the pin the pivot's force bends the arm: M = F_perpendicular s, less the inertia of the piece between
    s = STRESS * np.hypot(CRANK, FRAME)
    bending = (channels["joints/pivot/force"][:, :2] * across).sum(axis=1) * s / (THICKNESS * WIDTH**2 / 6)
    stress = channels["probes/bending/stress"][:, 0]
    beside = np.abs(np.abs(stress).max() / np.abs(bending).max() - 1)
    print(
        f"stress there {np.abs(stress).max() / 1e6:.2f} MPa, from the pivot's force {np.abs(bending).max() / 1e6:.2f} MPa"
    )
    assert beside < 0.05

    torque, rigid = (channels[f"drive/{name}"][:, 0] for name in ("torque", "rigid_torque"))
    print(f"drive: {np.abs(torque).max():.2f} N m, with all links rigid {np.abs(rigid).max():.2f} N m")
    assert run.balance is not None
    assert run.balance.energy < 1e-3
    assert 1.0 < np.abs(torque).max() / np.abs(rigid).max() < 1.2  # the arm's vibration comes on top


if __name__ == "__main__":
    main()
