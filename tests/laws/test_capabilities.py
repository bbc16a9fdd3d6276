"""Cells of the table of capabilities, executed: three steps as by the oracle, or refused by the table."""

from dataclasses import replace
from itertools import product
from typing import Any

import pytest

from kedfem.dynamics.start import initial_rates
from kedfem.dynamics.system.accelerations import accelerated_in_a_step
from kedfem.dynamics.system.start import rest
from kedfem.errors import SceneError
from kedfem.scene import scene_from
from kedfem.scene.capabilities import KINDS, refusals
from kedfem.scene.capability_page import COLUMNS, JOINTS
from tests.moving import beam_in_space
from tests.partners import chain
from tests.systems import Begun, against_oracle, begun, marched

Raw = dict[str, Any]
Cell = tuple[str, str, str]
FRAMES = ("nominal, driven", "following, driven", "following, no drive")
WITHIN = {"nominal": 1e-8, "following": 1e-7}
CELLS = list(product(KINDS, FRAMES, ("force",)))
#: cells whose steps rounding limits: beside stiff rigid parts at a hinge of beams in space with nominal frames, a
#: diameter changed by 1e-14 of itself changes what the fast step finds by 8.5e-8 of the peak, the oracle by 4e-11
ROUNDED = {("revolute", "nominal, driven", "force"): 5e-7}
SHORT = [("spherical", "nominal, driven", "force"), ("slot", "following, no drive", "force")]
LONG = [
    *(cell for cell in CELLS if cell not in SHORT),
    ("screw", "following, driven", "motor"),
    ("revolute", "following, no drive", "motor"),
]


def scene_of(cell: Cell) -> Raw:
    """A closed chain of beams in space that moves from the first step on under gravity, a force element on its crank."""
    kind, column, element = cell
    facts, raw = COLUMNS[column], chain(kind, ("beam", "beam"))
    end = list(raw["joints"].values())[1]["at"]
    raw["analysis"] |= {"initial": "rest", "frames": facts["frames"], "end_time": 0.005}
    raw["drive"] = {"joint": "A", "motion": {"kind": "constant_speed", "speed": 3.0}}
    if facts["drive"] == "none":
        del raw["drive"]
        raw["analysis"]["initial_speeds"] = {"A": 3.0}
    if element == "motor":
        raw["motors"] = {"m": {"joint": "A", "torque": {"over": "speed", "at": [-10, 10], "value": [5, -5]}}}
    else:
        raw["loads"] = {"f": {"kind": "force", "link": "crank", "at": end, "vector": [10.0, 20.0, 5.0]}}
    return raw


def as_a_run(of: Begun) -> Begun:
    """The same, begun as runs with co-rotational frames begin."""
    rates = initial_rates(of.prepared.scene, of.prepared.linkage, of.ready.system.model)
    return replace(of, state=rest(of.ready, of.motion, rates, accelerated=accelerated_in_a_step))


def assert_as_the_table_says(cell: Cell) -> None:
    """Refused in the words of the table; else within the bound of its frames."""
    raw, facts = scene_of(cell), {**JOINTS[cell[0]], **COLUMNS[cell[1]]}
    if refused := list(refusals("joints", facts)):
        with pytest.raises(SceneError) as caught:
            scene_from(raw)
        assert [each for each in refused if each.why in str(caught.value)] == refused
    else:
        of = as_a_run(begun(raw)) if facts["frames"] == "following" else begun(raw)
        assert against_oracle(of) < ROUNDED.get(cell, WITHIN[facts["frames"]])


@pytest.mark.parametrize("cell", SHORT, ids=", ".join)
def test_a_cell_moves_as_by_the_oracle_or_is_refused(cell: Cell) -> None:
    assert_as_the_table_says(cell)


@pytest.mark.long
@pytest.mark.parametrize("cell", LONG, ids=", ".join)
def test_every_joint_in_all_frames_moves_as_by_the_oracle_or_is_refused(cell: Cell) -> None:
    assert_as_the_table_says(cell)


def test_a_sudden_torque_at_the_hinge_of_a_short_beam_in_space_moves_it() -> None:
    """127 mm long, 20 mm thick, no drive, begun as runs begin: from a plain `rest` iterations do not converge."""
    hinge = {"kind": "revolute", "links": ["ground", "crank"], "at": [0, 0, 0], "axis": [0, 0, 1]}
    raw: Raw = {
        "links": {"crank": beam_in_space((0, 0, 0), (0.12, 0.02, 0.03), 2)}, "joints": {"A": hinge},
        "springs": {"s": {"kind": "torsion", "joint": "A", "stiffness": 20.0, "preload": 2.0}},
        "analysis": {"end_time": 0.005, "step": 5e-4, "rho_inf": 0.8},
    }  # fmt: skip
    of = as_a_run(begun(raw))
    assert marched(of, 3)[0].passes[2] < 20
    assert against_oracle(of) < WITHIN["following"]
