"""Bennett's linkage, over-constrained in space; run with `python examples/bennett/run.py`."""

from pathlib import Path

import numpy as np

from kedfem.analysis import analyse
from kedfem.kinematics import kinematics
from kedfem.motion.linkage import linkage
from kedfem.scene import read_scene

K = np.sin(np.radians(60)) / np.sin(np.radians(30))  # sin((β + α)/2) / sin((β − α)/2), α 30°, β 90°


def main() -> None:
    scene = read_scene(Path(__file__).with_name("scene.toml"))
    print(f"joints with more equations than they need: {', '.join(linkage(scene).redundant)}")

    # G. T. Bennett, A new mechanism, Engineering 76 (1903): tan(theta1/2) tan(theta2/2) = K all the way round
    rigid = kinematics(scene).results
    first = np.pi / 2 + rigid.channels["joints/A/angle"][1][:, 0]
    # of joint B the angle is that of its first link, the crank, against the coupler
    second = np.radians(120) - rigid.channels["joints/B/angle"][1][:, 0]
    gap = np.abs(np.sin(first / 2) * np.sin(second / 2) - K * np.cos(first / 2) * np.cos(second / 2)).max()
    print(f"Bennett's relation between two joint angles: off by {gap:.1e} at most")
    assert gap < 1e-9

    # how the joints share the load, which rigid links leave open, elastic ones decide; the drive's torque is not open
    run = analyse(scene)
    channels = {name: values for name, (_, values) in run.results.channels.items()}
    torque, rigid_torque = (channels[f"drive/{name}"][:, 0] for name in ("torque", "rigid_torque"))
    last = run.results.angle >= run.results.angle[-1] - 2 * np.pi
    rms = np.sqrt(np.mean((torque - rigid_torque)[last] ** 2) / np.mean(rigid_torque[last] ** 2))
    print(f"drive torque {np.abs(torque).max():.2f} N m, rms {100 * rms:.2f} % from that of rigid links")
    assert rms < 0.15  # the coupler rings, at 68 Hz
    known = {name for name in "ABCD" if f"joints/{name}/rigid_force" in channels}
    print(
        f"forces that rigid links determine: at joints {', '.join(sorted(known)) or 'none'}; elastic ones: at A, B, C, D"
    )
    assert all(f"joints/{name}/force" in channels for name in "ABCD")
    assert run.balance is not None
    assert run.balance.energy < 1e-3


if __name__ == "__main__":
    main()
