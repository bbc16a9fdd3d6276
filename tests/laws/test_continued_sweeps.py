"""Sweeps whose points follow one another: the two branches of a spring that stiffens with its travel (Duffing).

    x'' + 2 ζ ω x' + ω² x + α x³ = f cos Ω t,   x ≈ a cos(Ω t − ψ):
    ((ω² − Ω² + ¾ α a²)² + (2 ζ ω Ω)²) a² = f²

has three amplitudes over a range of Ω, of which the middle one is unstable: a sweep upwards keeps to the large one, one
downwards to the small one. Harmonic balance with one harmonic is right to some per cent there.
"""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.errors import SceneError
from kedfem.sweep import BaseScene, SweepOptions, SweepResult, axes_of, sweep
from tests.laws.test_varying_springs import MASS, OMEGA, hill
from tests.rooms.test_sweep import Inline

ZETA, SIZE = 0.05, 0.01
CUBIC = OMEGA**2 / (1.5 * SIZE**2)  # α: half of ω² where ¾ α a² acts at a = SIZE
FORCE = 2 * ZETA * OMEGA * 1.2 * OMEGA * SIZE  # f, by mass


def duffing() -> dict[str, Any]:
    raw = hill("Mathieu", "x", ZETA)
    del raw["springs"]["k"]["stiffness_factor"]
    x = np.linspace(-2 * SIZE, 2 * SIZE, 161)
    cubic = {"over": "travel", "at": x.tolist(), "value": (-MASS * CUBIC * x**3).tolist()}
    phi = np.linspace(0, 2 * np.pi, 361)
    wave = {"over": "angle", "at": phi.tolist(), "value": np.cos(phi).tolist(), "period": "360 deg"}
    return {
        **raw,
        "motors": {"c": {"joint": "S", "force": cubic}},
        "loads": {
            "f": {"kind": "force", "link": "block", "at": [0.3, 0, 0], "vector": [MASS * FORCE, 0, 0], "factor": wave}
        },
        "analysis": {"kind": "steady", "steps_per_revolution": 120, "rho_inf": 0.95},
        "output": {
            "plots": False, "picture": False, "animation": False,
            "probes": {"x": {"link": "block", "at": [0.3, 0, 0], "quantity": "displacement"}},
        },
    }  # fmt: skip


def amplitudes(speed: float) -> np.ndarray:
    """All that harmonic balance has, rising."""
    s, c = OMEGA**2 - speed**2, 2 * ZETA * OMEGA * speed
    k = 0.75 * CUBIC
    roots = np.roots([k**2, 2 * k * s, s**2 + c**2, -(FORCE**2)])
    return np.sqrt(np.sort(roots[np.abs(roots.imag) < 1e-9 * np.abs(roots).max()].real))


def along(folder: Path, values: str, follow: bool) -> SweepResult:
    raw = duffing()
    axes = axes_of([f"drive.speed={values}"], raw)
    return sweep(
        BaseScene(raw, folder, "d"), axes, SweepOptions(quick=True, follow=follow), folder / "out", executor=Inline()
    )


def size(done: SweepResult, k: int) -> float:
    most, least = done.rows[k].extremes["probes/x/displacement/x"][1][:2]
    return 0.5 * (most - least)


@pytest.mark.long
def test_both_directions_keep_to_their_branch(tmp_path: Path) -> None:
    up, down = (along(tmp_path / name, values, True) for name, values in (("up", "40:46:4"), ("down", "50:48:3")))
    assert_allclose(size(up, 0), amplitudes(40.0), rtol=0.02)
    small, _, large = amplitudes(48.0)
    assert_allclose(size(down, 2), small, rtol=0.03)
    further = along(tmp_path / "up", "40:48:5", True)  # goes on from the last state that was kept
    assert further.before == 4
    assert_allclose(size(further, 4), large, rtol=0.03)
    assert large > 3 * small


def test_following_asks_for_steady_motions_without_edges(tmp_path: Path) -> None:
    raw = duffing()
    axes = axes_of(["drive.speed=36:38:2"], raw)
    with pytest.raises(SceneError, match="--follow: must be without --edges"):
        sweep(BaseScene(raw, tmp_path, "d"), axes, SweepOptions(quick=True, follow=True, edges=0.01), tmp_path / "a")
    raw = {**raw, "analysis": {"revolutions": 2, "steps_per_revolution": 60}}
    with pytest.raises(SceneError, match=r"--follow: .* got kind = 'transient'"):
        sweep(BaseScene(raw, tmp_path, "d"), axes, SweepOptions(quick=True, follow=True), tmp_path / "b")
