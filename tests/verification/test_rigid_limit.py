"""E → ∞: joint forces and the drive's torque tend to rigid inverse dynamics with 1/E, from both sides."""

from copy import deepcopy
from functools import cache
from typing import Any

import numpy as np
import pytest
from benchmarks.scenes import mechanisms

from kedfem.accuracy.prepared import meshed
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.results.recording import recording
from kedfem.scene import scene_from

from .mechanisms import four_bar

FACTORS = (1, 4, 16)
SLOW = {"joint": "A", "motion": {"kind": "constant_speed", "speed": "60 rpm"}}


def alloy(factor: float) -> dict[str, Any]:
    return {"alloy": {"density": 2796, "youngs_modulus": factor * 7.031e10, "shear_modulus": factor * 2.712e10}}


def spatial(factor: float) -> Any:
    """RSSR of beams, its cross rigid."""
    raw = deepcopy(mechanisms()["RSSR"])
    for name, link in raw["links"].items():
        link["material"] = "alloy"
        if name != "cross":
            link |= {"model": "beam", "mesh": {"elements": 2}}
    analysis = {"revolutions": 0.25, "steps_per_revolution": 720, "initial": "quasi-static"}
    return scene_from({**raw, "materials": alloy(factor), "drive": SLOW, "analysis": analysis, "damping": {}})


def planar(factor: float) -> Any:
    """The source's four-bar."""
    analysis = {"revolutions": 0.5, "steps_per_revolution": 720}
    return four_bar(analysis, {"mesh": {"elements": 4}}, materials=alloy(factor), drive=SLOW)


@cache
def errors(kind: str, factor: float) -> dict[str, float]:
    """rms difference of each elastic channel from its rigid counterpart, of the latter's rms."""
    ready = meshed({"planar": planar, "spatial": spatial}[kind](factor))
    recorded = recording(ready.scene, ready.model, None, ready.path)
    blocks = transient(ready.scene, ready.linkage, ready.path, ready.model, steps_of(ready.scene, ready.model))
    taken = [{each.channel.name: each.rows(block) for each in recorded} for block in blocks]
    columns = {each.channel.name: each.channel.columns for each in recorded}
    out = {}
    for name in columns:
        beside = name.replace("/rigid_", "/")
        if beside != name and beside in columns:
            rigid, elastic = (np.concatenate([x[key] for x in taken]) for key in (name, beside))
            same = elastic[:, [columns[beside].index(c) for c in columns[name]]]
            out[beside] = float(np.sqrt(np.mean((same - rigid) ** 2) / np.mean(rigid**2)))
    return out


@pytest.mark.parametrize(("kind", "count"), [("planar", 6), ("spatial", 10)])
def test_elastic_joint_forces_tend_to_rigid_ones_with_one_over_E(kind: str, count: int) -> None:
    every = [errors(kind, factor) for factor in FACTORS]
    assert len(every[0]) == count
    assert {"joints/B/force", "drive/torque"} <= every[0].keys()
    for name in every[0]:
        e = np.array([each[name] for each in every])
        slopes = -np.diff(np.log(e)) / np.log(4)
        assert ((slopes > 0.9) & (slopes < 1.2)).all(), (name, slopes)  # vibration adds its share
        assert e[-1] < 1e-3, name  # vibration and deflection at 60 rpm, E × 16
