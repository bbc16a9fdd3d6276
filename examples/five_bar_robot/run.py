"""A planar robot with two drives, its swing after the stop; run with `python examples/five_bar_robot/run.py`."""

from pathlib import Path

import numpy as np

from kedfem.analysis import analyse
from kedfem.scene import rayleigh, read_scene

STOP = 0.12  # s


def main() -> None:
    scene = read_scene(Path(__file__).with_name("scene.toml"))
    run = analyse(scene)
    channels = {name: values for name, (_, values) in run.results.channels.items()}
    time = run.results.time
    after = time > STOP + 0.005

    # rigid links need no torque once they stand still; elastic ones swing on about their place
    for drive in ("A", "E"):
        rigid, torque = channels[f"drive/{drive}/rigid_torque"][:, 0], channels[f"drive/{drive}/torque"][:, 0]
        print(
            f"drive {drive}: up to {np.abs(torque).max():.2f} N m; after the stop {np.abs(torque[after]).max():.3f} N m"
        )
        assert np.abs(rigid[after]).max() < 1e-6 * np.abs(rigid).max()

    # the tip's swing decays as damping says: zeta = alpha / 2 omega + beta omega / 2
    swing = channels["probes/tip/displacement"]
    print(
        f"tip: lags by up to {1e6 * np.abs(swing).max():.0f} um, swings by {1e6 * np.abs(swing[after]).max():.1f} um after the stop"
    )
    way = int(np.abs(swing[after]).max(axis=0).argmax())
    omega, zeta = ringing(time[after], swing[after, way])
    alpha, beta = rayleigh(scene.damping)
    wanted = alpha / (2 * omega) + beta * omega / 2
    print(
        f"it swings at {omega / (2 * np.pi):.1f} Hz, damped by {100 * zeta:.2f} %, by the scene's alpha and beta {100 * wanted:.2f} %"
    )
    assert abs(zeta / wanted - 1) < 0.1
    assert run.balance is not None
    assert run.balance.energy < 1e-3


def ringing(t: np.ndarray, x: np.ndarray) -> tuple[float, float]:
    """Circular frequency and damping ratio of a decaying swing, from its maxima."""
    peaks = np.flatnonzero((x[1:-1] > x[:-2]) & (x[1:-1] >= x[2:])) + 1
    peaks = peaks[x[peaks] > 0.2 * x[peaks].max()]
    omega = 2 * np.pi * (len(peaks) - 1) / (t[peaks[-1]] - t[peaks[0]])
    decay = -np.polyfit(t[peaks], np.log(x[peaks]), 1)[0]
    return float(omega), float(decay / omega)


if __name__ == "__main__":
    main()
