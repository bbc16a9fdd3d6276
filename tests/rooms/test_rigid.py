"""Rigid links: stiff, or carried by the drive without any unknowns."""

from typing import Any

import numpy as np
import pytest
from benchmarks.scenes import mechanisms
from numpy.testing import assert_allclose

from kedfem.accuracy.histories import Histories, histories, relative_errors, worst
from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.reduction import reduced
from kedfem.scene import scene_from
from tests.runs import ran

from .test_dynamics import four_bar

COUNTED = ("joints/A/force", "joints/B/force", "joints/C/force", "joints/D/force", "drive/torque")


def scene(kind: str, rigid: tuple[str, ...] = (), stiff: tuple[str, ...] = ()) -> dict[str, Any]:
    """The four-bar with some links rigid, or of a material 1e5 times as stiff; slow, gravity, a load on the crank."""
    raw = four_bar(kind, steps_per_revolution=120, revolutions=0.5, initial="quasi-static", rho_inf=0.5)
    raw["drive"]["motion"]["speed"] = "60 rpm"
    raw["points"]["P"] = {"between": ["A", "B"], "fraction": 0.6}
    raw["gravity"] = [0, -9.81, 0]
    raw["materials"]["hard"] = {"density": 2796, "youngs_modulus": 7.031e15, "shear_modulus": 2.712e15}
    raw["loads"] = {"pull": {"kind": "force", "link": "crank", "at": "P", "vector": [3, 20, 0], "frame": "world"}}
    raw["bodies"] = {"wheel": {"kind": "flywheel", "link": "crank", "at": "A", "inertia": 0.01, "mass": 0.2}}
    for name in rigid:
        raw["links"][name]["model"] = "rigid"
        raw["links"][name].pop("mesh")
    for name in stiff:
        raw["links"][name]["material"] = "hard"
    return raw


def run(raw: dict[str, Any]) -> Histories:
    return histories(meshed(scene_from(raw)))


def assert_near(a: Histories, b: Histories, tolerance: float) -> None:
    for name in COUNTED:
        size = np.abs(b.channels[name][1]).max()
        assert_allclose(a.channels[name][1], b.channels[name][1], rtol=0, atol=tolerance * size, err_msg=name)


@pytest.mark.parametrize("kind", ["beam", "bar", "plate"])
@pytest.mark.parametrize("link", ["crank", "coupler", "rocker"])
def test_a_rigid_link_is_one_of_a_very_stiff_material(kind: str, link: str) -> None:
    # flexibilities are as 1 : 1e5; what stiff links vibrate with is of that order too
    assert_near(run(scene(kind, rigid=(link,))), run(scene(kind, stiff=(link,))), 1e-3)


@pytest.mark.parametrize("kind", ["beam", "bar"])
def test_a_linkage_of_rigid_links_needs_the_torque_of_virtual_work(kind: str) -> None:
    found = ran(scene(kind, rigid=("crank", "coupler", "rocker")))
    torque, rigid = (found.channel(f"drive/{name}")[10:] for name in ("torque", "rigid_torque"))
    assert_allclose(torque, rigid, rtol=0, atol=1e-5 * np.abs(rigid).max())  # once the start has died away


def test_a_rigid_crank_has_no_unknowns() -> None:
    ready = meshed(scene_from(scene("bar", rigid=("crank",))))
    assert [link.name for link in ready.model.links] == ["coupler", "rocker"]
    assert [x.link.name for x in ready.model.prescribed] == ["crank"]


def test_a_rigid_link_stays_rigid_beside_reduced_ones() -> None:
    raw = {
        **mechanisms()["RSSR"],
        "analysis": {"revolutions": 0.25, "steps_per_revolution": 200, "initial": "quasi-static"},
    }
    full = meshed(scene_from(raw))
    found = reduced(full, ["crank", "coupler", "rocker"], 1e-3)
    links = {link.name: link for link in found.ready.model.links}
    assert (links["cross"].rigid, links["cross"].unknowns) == (True, 12)  # {1, x, y, z} in three components
    errors = relative_errors(histories(found.ready), histories(full))
    assert worst(errors) < 2e-3  # twice what was asked for
    assert 0.3 * worst(errors) < worst(found.estimate) < 3 * worst(errors) + 1e-4
