"""Balances of large bodies are found in their static modes: they are those of the same bodies with dense matrices."""

from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.dynamics.system.ready import displacements
from kedfem.dynamics.system.starts.deflected import plucked, quasi_static, quasi_static_position, static
from tests.systems import Begun, begun

Raw = dict[str, Any]
UP = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0), "oblique": (0.48, 0.6, 0.64)}
LENGTH = 0.4


def hanging(up: str, segments: int, driven: bool) -> Raw:
    """A soft solid arm in a bushing on the ground, held up by a spring, under gravity and a force that turns with it;
    driven: the spring stands on a slide that a drive moves, and has a damper."""
    n = np.array(UP[up])
    along = np.cross(n, np.roll(n, 1) + np.array([0.1, 0.0, 0.2]))
    along /= np.linalg.norm(along)
    across, tip, foot = np.cross(n, along), LENGTH * along, LENGTH * along + 0.3 * n
    shape = {"kind": "bar", "between": [[0, 0, 0], tip.tolist()], "width": 0.04, "thickness": 0.03, "up": n.tolist()}
    ends = [{"link": "foot" if driven else "ground", "at": foot.tolist()}, {"link": "arm", "at": tip.tolist()}]
    spring = {"kind": "spring", "between": ends, "stiffness": 300.0, "preload": 3.0, "damping": 5.0 * driven}
    push = {"kind": "force", "link": "arm", "at": tip.tolist(), "vector": (across - n).tolist(), "frame": "link"}
    bushing = {"stiffness": 2e4, "rotational_stiffness": 30.0}
    raw: Raw = {
        "gravity": (-9.81 * n).tolist(),
        "materials": {"soft": {"youngs_modulus": 2e8, "density": 2000, "poisson_ratio": 0.3}},
        "links": {"arm": {"material": "soft", "segments": segments, "mesh": {"elements": [4, 1, 1]}, "shape": shape}},
        "joints": {"O": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0, 0], "axis": across.tolist(),
                         "bushing": bushing}},
        "springs": {"up": spring}, "loads": {"push": push},
        "analysis": {"end_time": 0.02, "step": 1e-3, "rho_inf": 0.8, "frames": "co-rotational"},
    }  # fmt: skip
    if driven:  # in steps of 1 ms rounding leaves 1e-6 of rates open, and by chance the search does not see it
        raw["analysis"] |= {"end_time": 0.032, "step": 0.016}
        raw["links"]["foot"] = {"model": "rigid"}
        raw["joints"]["S"] = {"kind": "prismatic", "links": ["foot", "ground"], "at": foot.tolist(), "axis": n.tolist()}
        raw["drive"] = {"joint": "S", "motion": {"kind": "constant_speed", "speed": 0.5}}
    return raw


def nodal(of: Begun, x: np.ndarray) -> np.ndarray:
    """Rows of all segments, one below the other."""
    return np.concatenate([displacements(of.ready, k, x[None])[0] for k in range(len(of.ready.parts))])


def both(raw: Raw, monkeypatch: pytest.MonkeyPatch) -> tuple[Begun, Begun]:
    """A system with dense bodies, and with sparse ones."""
    dense = begun(raw)
    monkeypatch.setattr("kedfem.dynamics.system.layout.SMALL", 0)
    return dense, begun(raw)


def pull(of: Begun) -> list[np.ndarray]:
    """Forces on all nodes, no two alike."""
    return [np.sin(np.arange(link.n * 3.0)).reshape(-1, 3) for link in of.ready.system.model.links]


STARTS = {
    "static": lambda of: static(of.ready, of.motion),
    "plucked": lambda of: plucked(of.ready, of.motion, pull(of)),
    "quasi-static": lambda of: quasi_static(of.ready, of.motion),
    "next": lambda of: static(of.ready, of.motion, 5e-3, near=static(of.ready, of.motion)),
    "position": lambda of: quasi_static_position(of.ready, of.motion, 5e-3, near=quasi_static(of.ready, of.motion)),
}


LONG = pytest.mark.long
CASES = [("static", False), ("plucked", False), ("quasi-static", False), ("next", True)]
CASES += [pytest.param(kind, True, marks=LONG) for kind in ("quasi-static", "plucked", "position")]


@pytest.mark.parametrize(("kind", "driven"), CASES)
@pytest.mark.parametrize("segments", [1, 2])
@pytest.mark.parametrize("up", [*(pytest.param(up, marks=LONG) for up in "xyz"), "oblique"])
def test_a_large_body_is_deflected_as_a_small_one(
    up: str, segments: int, kind: str, driven: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """To rounding; with dampers to what rates may leave open, 1e-7 of them; without a drive to what the search of a free
    body's balance leaves open."""
    dense, sparse = both(hanging(up, segments, driven), monkeypatch)
    one, other = STARTS[kind](dense), STARTS[kind](sparse)
    assert sparse.ready.condensed or kind == "plucked"
    free = kind == "quasi-static" and not driven
    for name, digits in (("u", 1e-5 if free else 1e-6 if driven else 1e-7), ("v", 1e-6), ("a", 1e-3 if free else 1e-5)):
        wanted, found = (nodal(of, getattr(x, name)) for of, x in ((dense, one), (sparse, other)))
        size = max(np.abs(wanted).max(), 9.81 if name == "a" else 0.0)
        assert_allclose(found, wanted, rtol=0, atol=digits * size)
