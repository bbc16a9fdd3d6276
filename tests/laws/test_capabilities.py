"""Cells of the table of capabilities, executed: three steps as by the oracle, or refused by the table."""

from itertools import product
from typing import Any

import pytest
from reference.capabilities import CELLS

from tests.cells import FACTORS, QUICK, Cell, all_cells, as_a_run, executed, pairs
from tests.moving import beam_in_space
from tests.systems import against_oracle, begun, marched

Raw = dict[str, Any]
EVERY = all_cells()
#: every third of the cheap ones, and each kind of joint among them
DEFAULT = [x for x in EVERY if x.links in QUICK and (x.plane or x.frames != "co-rotational")][::3]
#: dear ones, of which `python -m tests.cells` sees to all
MESHED = ("solids", "reduced", "solid on the ground", "solid and beam", "rigid")
LONG = [x for x in EVERY if x not in DEFAULT and (x.frames != "co-rotational" or x.links not in MESHED)]


def assert_as_the_table_says(cell: Cell) -> None:
    """Refused in the words of the table, else as by the oracle."""
    assert executed(cell)[1] < cell.within


def test_each_pair_of_levels_is_in_a_cell() -> None:
    every = (cell for levels in product(*FACTORS.values()) if (cell := Cell(*levels)).drawn)
    assert set().union(*map(pairs, every)) == set().union(*map(pairs, EVERY))
    assert len(EVERY) == sum(CELLS)


@pytest.mark.parametrize("cell", DEFAULT, ids=str)
def test_a_cell_moves_as_by_the_oracle_or_is_refused(cell: Cell) -> None:
    assert_as_the_table_says(cell)


@pytest.mark.long
@pytest.mark.parametrize("cell", LONG, ids=str)
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
    assert against_oracle(of) < 1e-7
