"""Loops that a scene has for itself do what the loop for all scenes does, and hold no more than the scene has."""

import os
import subprocess
import sys
from collections.abc import Callable, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("numba")

from kedfem import compiled
from kedfem.dynamics.system import reference
from kedfem.dynamics.system.arrays import Bodies, Ends
from kedfem.dynamics.system.ready import ready
from tests.laws.test_follower_loads import arm, moving
from tests.moving import inverted, turning
from tests.systems import Begun, begun, marched, stiffened

ROOT = Path(__file__).parents[2]
TIGHT = 1e-12  # change of a pass: what rounding decides is whether one more is taken, and what that one changes
SPARSE = {"mass", "arrays"}
EVERY = {"beams", "K", "elements", "turning", "stresses", "knots"} | SPARSE


def turned_arm(kind: str, frames: str, loads: bool = False, elements: int = 2, **analysis: Any) -> Begun:
    """Turned fast, so that what bends in three steps is far above the rounding of where the arm is."""
    raw = moving(kind, np.eye(3), driven=True)
    raw["drive"]["motion"]["speed"] = 300.0
    if not loads:
        del raw["loads"]
    raw["links"]["arm"] = arm(kind, np.eye(3), elements)
    raw["links"]["arm"].pop("segments", None)
    return begun(raw | {"analysis": raw["analysis"] | {"frames": frames, **analysis}})


def slotted() -> Begun:
    """Fast, with long steps: at 120 rpm short ones bend it by 1e-7 m, and rounding of positions is 1e-9 of that."""
    raw = inverted(kind="slot", frames="co-rotational", steps_per_revolution=36)
    return begun(raw | {"drive": turning("1200 rpm")})


SCENES: dict[str, tuple[Callable[[], Begun], set[str]]] = {
    "rigid-body frames": (lambda: turned_arm("beam", "rigid-body"), EVERY),
    "a large link": (lambda: turned_arm("solid", "rigid-body", elements=30), EVERY - SPARSE),
    "stiffening": (lambda: stiffened(turned_arm("beam", "rigid-body", stiffening=True)), EVERY - {"stresses"}),
    "planar beams": (lambda: turned_arm("beam", "co-rotational"), EVERY - {"beams"}),
    "beams in space": (lambda: turned_arm("spatial beam", "co-rotational"), EVERY - {"K", "elements"}),
    "solids": (lambda: turned_arm("solid", "co-rotational"), EVERY - {"K"}),
    "loads that turn": (lambda: turned_arm("beam", "co-rotational", loads=True), EVERY - {"beams", "turning"}),
    "a slot": (slotted, EVERY - {"beams", "knots"}),
}  # fmt: skip


def handed_of(of: Begun) -> set[str]:
    """Names of what compiled loops are not given of bodies and ends."""
    records: list[Any] = [reference.by_address(each).record for each in (of.ready.bodies, of.ready.ends)]
    return {name for record in records for name in record._fields if getattr(record, name) is None}


@pytest.mark.parametrize("kind", SCENES)
def test_a_loop_has_only_what_its_scene_has(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    make, none = SCENES[kind]
    monkeypatch.setattr(reference, "compiles_for_all", lambda: False)
    of = make()
    assert handed_of(of) == none
    monkeypatch.setattr(reference, "compiles_for_all", lambda: True)
    assert handed_of(of) == set()


def test_all_that_may_be_missing_is_a_record_of_bodies_or_ends() -> None:
    assert {*Bodies._fields, *Ends._fields} >= EVERY


def found(kinds: Iterable[str]) -> np.ndarray:
    """What three steps of scenes end with, each divided by its largest."""
    out = []
    for kind in kinds:
        of = SCENES[kind][0]()
        tight = replace(of, ready=ready(of.ready.system, of.ready.scheme, TIGHT))
        _, history = marched(tight, 3)
        for x in (history.u, history.port_force, history.energy):
            out.append(x.ravel() / np.abs(x).max())
    return np.concatenate(out)


ALONE = """
import sys
import numpy as np
from kedfem.compiled import compiles_for_all
from tests.rooms.test_loops_of_scenes import found
assert not compiles_for_all()
np.save(sys.argv[1], found(sys.argv[2:]))
"""


FEWER = ("stiffening", "beams in space", "loads that turn", "a slot")  # each kind compiles its own loops


@pytest.mark.long
@pytest.mark.parametrize("kinds", [FEWER, tuple(x for x in SCENES if x not in FEWER)], ids=["fewer", "the others"])
def test_a_loop_of_one_scene_does_what_the_loop_for_all_does(kinds: tuple[str, ...], tmp_path: Path) -> None:
    """Else numbers would depend on whether `kedfem compile` was called."""
    environment = {k: x for k, x in os.environ.items() if k != "NUMBA_CACHE_DIR"}
    environment["KEDFEM_CACHE"] = str(tmp_path / "cache")
    command = [sys.executable, "-c", ALONE, str(tmp_path / "found.npy"), *kinds]
    subprocess.run(command, check=True, cwd=ROOT, env=environment, timeout=900)
    with compiled.for_all_scenes():
        for_all = found(kinds)
    assert np.abs(np.load(tmp_path / "found.npy") - for_all).max() < 1e-9
