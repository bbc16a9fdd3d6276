"""Cells of the table of capabilities as scenes: a joint with frames, a drive or none, two kinds of links, and a law.

All of them are executed by ``python -m tests.cells``.
"""

import argparse
import re
import sys
import time
from dataclasses import dataclass, replace
from itertools import combinations, product
from typing import Any

import numpy as np

from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.start import initial_rates
from kedfem.dynamics.stepping.transient import transient
from kedfem.dynamics.system.starts.accelerations import accelerated_in_a_step
from kedfem.dynamics.system.starts.initial_states import rest
from kedfem.errors import KedfemError
from kedfem.scene.checks.capabilities import DRIVEN, GEARED, KINDS, RACKED, REFUSALS, SLID, TURNED, Refusal
from tests.moving import beam_in_space
from tests.partners import IN_PLANE, chain
from tests.systems import Begun, begun, by_oracle, marched, rows

Raw = dict[str, Any]
FRAMES = ("rigid-body", "stiffening", "co-rotational")
#: kinds of links that a joint joins
LINKS: dict[str, tuple[str, str]] = {
    "beams in space": ("beam", "beam"), "solids": ("solid", "solid"), "reduced": ("reduced", "beam"),
    "rigid": ("rigid", "beam"), "slider": ("bare", "beam"), "planar beams": ("planar beam", "planar beam"),
    "plane links": ("plane", "plane"), "plane and beam": ("plane", "planar beam"),
    "planar rigid": ("rigid", "planar beam"), "on the ground": ("beam", "ground"),
    "plane on the ground": ("plane", "ground"), "solid on the ground": ("solid", "ground"),
    "solid and beam": ("solid", "beam"),
}  # fmt: skip
IN_A_PLANE = ("planar beams", "plane links", "plane and beam", "planar rigid", "plane on the ground")
LAWS = (
    "loads", "loads that turn", "spring between points", "spring on the joint", "motor on the joint",
    "motor at the crank", "bushing", "damped bushing", "bushing against rotations", "shaft", "drive on the joint",
    "drive of the travel", "gear", "rack", "gear on the joint", "rack on the joint", "point mass", "damping",
    "damping of mass", "no numerical damping",
)  # fmt: skip
LIMIT = "limit of the joint"
LINE = "load along a line"
ON_JOINT = {"drive on the joint": DRIVEN, "drive of the travel": ("cylindrical", "screw", "planar")}
WITHIN = {"rigid-body": 1e-8, "stiffening": 1e-8, "co-rotational": 1e-7}
#: rigid-body, with beams in space: rounding beside the stiff rigid parts at their ends limits the fast step; a diameter
#: changed by 1e-14 of itself changes what it finds by 8.5e-8 of the peak, and what the oracle finds by 4e-11
ROUNDED = 5e-7
GEARS_ON = {"gear on the joint": GEARED, "rack on the joint": RACKED}
GEARS = ("gear", "rack", *GEARS_ON)
STEPS = 3
FAST = {("weld", "solids")}  # chains some of whose links are a hundred times faster than the crank's end


@dataclass(frozen=True)
class Cell:
    """One combination."""

    joint: str
    frames: str
    driven: bool
    links: str
    law: str = "loads"

    def __str__(self) -> str:
        drive = "driven" if self.driven else "no drive"
        return f"{self.joint}, {self.frames}, {drive}, {self.links}, {self.law}"

    @property
    def plane(self) -> bool:
        return self.links in IN_A_PLANE

    @property
    def within(self) -> float:
        """What its displacements may differ by from the oracle's, of their peak."""
        rounded = not self.plane if self.frames == "rigid-body" else self.stiff_beside
        return ROUNDED if rounded else WITHIN[self.frames]

    @property
    def stiff_beside(self) -> bool:
        """Whether a run with stiffening has a link a thousand times as stiff as others, which costs it digits."""
        return self.frames == "stiffening" and "rigid" in self.links

    @property
    def drawn(self) -> bool:
        """Whether there is such a mechanism: planar links have planar joints, what has no drive no law of one."""
        if self.plane and self.joint not in IN_PLANE:
            return False
        if self.law == LIMIT and not (self.joint in (*TURNED, *SLID) and (self.driven or self.frames == "co-rotational")):
            return False  # refused whatever its law, or as a spring on the joint is
        if self.law == "shaft" and not self.driven:
            return False
        if self.law in ON_JOINT and (self.joint not in ON_JOINT[self.law] or not self.driven):
            return False
        if self.joint not in GEARS_ON.get(self.law, KINDS):
            return False
        return not (self.law in GEARS and self.plane)


FACTORS: dict[str, tuple[Any, ...]] = {
    "joint": KINDS, "frames": FRAMES, "driven": (True, False), "links": tuple(LINKS), "law": (*LAWS, LIMIT, LINE),
}  # fmt: skip


#: cheap ones, of all kinds of joints and nearly all laws
QUICK = ("planar beams", "plane on the ground", "on the ground")


def pairs(cell: Cell) -> set[tuple[tuple[str, Any], ...]]:
    """All pairs of its levels."""
    return set(combinations(((factor, getattr(cell, factor)) for factor in FACTORS), 2))


def all_cells() -> list[Cell]:
    """All joint × frames × driven or not × links under loads, all drives, and so many more that each pair is in one."""
    first = [Cell(*x) for x in product(KINDS, FRAMES, (True, False), LINKS)]
    first += [Cell(*x) for x in product(DRIVEN, FRAMES, (True,), ("beams in space", "on the ground"), ON_JOINT)]
    found = [cell for cell in first if cell.drawn]
    for laws in (LAWS, (LIMIT,), (LINE,)):
        every = [cell for x in product(*{**FACTORS, "law": laws}.values()) if (cell := Cell(*x)).drawn]
        np.random.default_rng(12).shuffle(every)  # type: ignore[arg-type]
        left = set().union(*map(pairs, every)) - set().union(*map(pairs, found))
        while left:
            best = max(every[:2000], key=lambda cell: len(pairs(cell) & left))
            if not pairs(best) & left:
                best = next(cell for cell in every if pairs(cell) & left)
            found.append(best)
            left -= pairs(best)
            every.remove(best)
    return found


def scene_of(cell: Cell) -> Raw:
    """A closed chain that moves from the first step on under gravity and a force, of as few elements as can be."""
    travel = cell.law == "drive of the travel"
    on_joint = cell.law in ON_JOINT
    raw = chain(cell.joint, LINKS[cell.links], driven="travel" if travel else on_joint, plane=cell.plane)
    for link in raw["links"].values():
        if "mesh" in link:
            counts = link["mesh"]["elements"]
            along = 1 if cell.joint != "slot" else 3 if cell.frames == "co-rotational" else 2
            link["mesh"] = {"elements": along if isinstance(counts, int) else [along] + [1] * (len(counts) - 1)}
        if link.get("reduction", "none") != "none":
            link["reduction"] = 6
    raw["analysis"] |= {"initial": "rest", "end_time": STEPS * 5e-4}
    raw["analysis"] |= {"frames": "co-rotational" if cell.frames == "co-rotational" else "rigid-body"}
    if cell.frames == "stiffening":
        raw["analysis"]["stiffening"] = True
    slow = travel or (on_joint and cell.joint in {"prismatic", "slot"}) or (cell.joint, cell.links) in FAST
    speed = 0.3 if slow else 3.0
    raw["drive"]["motion"] = {"kind": "constant_speed", "speed": speed}
    if not cell.driven:
        del raw["drive"]
        raw["analysis"]["initial_speeds"] = {"A": speed}
    crank = raw["joints"][next(name for name in raw["joints"] if name != "A")]["at"]
    frame = "link" if cell.law == "loads that turn" else "world"
    vector = [10.0, 20.0, 0.0 if cell.plane else 5.0]
    raw["loads"] = {"f": {"kind": "force", "link": "crank", "at": crank, "vector": vector, "frame": frame}}
    if cell.law == LINE:
        raw["loads"]["q"] = along_a_line(raw["links"], cell.plane)
    more: Raw = {**raw, **sections(cell, crank, raw["joints"]["J"])}
    J, laws = raw["joints"]["J"], BUSHINGS.get(cell.law)
    if laws is not None:
        J["bushing"] = dict(laws)
    if cell.law == "shaft":
        raw["drive"] |= {"shaft_stiffness": 500.0, "shaft_damping": 0.1}
    if cell.law == "no numerical damping":
        raw["analysis"]["rho_inf"] = 1.0
    if cell.law in GEARS:
        geared(more, cell)
    return more


def along_a_line(links: Raw, plane: bool) -> Raw:
    """A load that changes along a beam or a bar, and turns with it; where there is neither, one that is refused."""
    lines = [name for name, x in links.items() if x["model"] == "beam" or (x["model"] == "rigid" and "shape" in x)]
    vector, end = ([40.0, -80.0, 0.0 if plane else 30.0], [10.0, 90.0, 0.0 if plane else -20.0])
    return {"kind": "line", "link": (lines or ["crank"])[0], "frame": "link", "vector": vector, "end_vector": end}


BUSHINGS: dict[str, Raw] = {
    "bushing": {"stiffness": 1e6}, "damped bushing": {"stiffness": 1e6, "damping": 300.0},
    "bushing against rotations": {"stiffness": 1e6, "rotational_stiffness": 2e3, "rotational_damping": 0.3},
}  # fmt: skip


def sections(cell: Cell, crank: Any, J: Raw) -> Raw:
    """Sections that a law puts into a scene; `crank` is the place of its end, `J` the joint in question."""
    torque = {"over": "speed", "at": [-50, 50], "value": [5, -5]}
    away = [crank[0] + 0.05, crank[1] + 0.1, *crank[2:]]
    ends = [{"link": "crank", "at": crank}, {"link": "ground", "at": away}]
    along, slides = cell.joint in SLID, cell.joint in {"prismatic", "planar", "slot"}
    on = {"joint": "J"}
    if cell.joint == "universal":
        on["about"] = J["links"][0]
    elif cell.joint == "planar":
        on["along"] = [float(x) for x in np.cross(J["axis"], [0.3, -0.5, 0.7])]
    preloaded = {"stiffness": 200.0, "damping": 0.2, "preload": 3.0, **on}
    spring = {"kind": "spring", "between": ends, "stiffness": 2e4, "damping": 20.0, "preload": 30.0}
    stop = {"kind": "travel" if along else "angle", **on, "stiffness": 2e5 if along else 4e3, "damping": 3.0}
    by_law: dict[str, Raw] = {
        LIMIT: {"limits": {"s": {"lower": -1e-5, "upper": 1e-5, **stop}}},
        "spring between points": {"springs": {"s": spring}},
        "spring on the joint": {"springs": {"s": {"kind": "spring" if along else "torsion", **preloaded}}},
        "motor on the joint": {"motors": {"m": {"force" if slides else "torque": torque, **on}}},
        "motor at the crank": {"motors": {"m": {"joint": "A", "torque": torque}}},
        "point mass": {"bodies": {"w": {"kind": "point_mass", "link": "crank", "at": crank, "mass": 0.4}}},
        "damping": {"damping": {"beta": 1e-5}},
        "damping of mass": {"damping": {"alpha": 2.0, "beta": 1e-5}},
    }
    return by_law.get(cell.law, {})


def geared(raw: Raw, cell: Cell) -> None:
    """A wheel that the crank's hinge or joint J turns, a rack that the crank moves, or a wheel that moves J as a rack."""
    raw["links"]["wheel"] = beam_in_space((0.0, -0.3, 0.1), (0.1, -0.35, 0.1), 1)
    axis = {"at": [0.0, -0.3, 0.1], "axis": [0.2, 0.3, 1.0], "links": ["wheel", "ground"]}
    raw["joints"]["W"] = {"kind": "prismatic" if cell.law == "rack" else "revolute", **axis}
    joints = {"gear on the joint": ["J", "W"], "rack on the joint": ["W", "J"]}.get(cell.law, ["A", "W"])
    raw["gears"] = {"g": {"joints": joints, **({"radius": 0.08} if "rack" in cell.law else {"ratio": -1.5})}}


# -- what becomes of them -----------------------------------------------------------------------------------


class _Word(str):
    def __new__(cls) -> "_Word":
        return super().__new__(cls, "\0")

    def __repr__(self) -> str:
        return "\0"


def as_said(refusal: Refusal, fault: str) -> bool:
    """Whether a fault is in the words of a line of the table, whatever scene it is about."""
    texts = "".join((refusal.where, refusal.must, refusal.why, refusal.got, refusal.take))
    text = str(refusal.fault(("\0",), dict.fromkeys(re.findall(r"\{(\w+)", texts), _Word())))
    return re.fullmatch(".+".join(map(re.escape, text.split("\0"))), fault) is not None


def refused_by_the_table(error: KedfemError) -> bool:
    """Whether each fault is in the words of a line."""
    faults = [str(fault) for fault in getattr(error, "faults", [error])]
    return all(any(as_said(each, fault) for each in REFUSALS) for fault in faults)


def executed(cell: Cell) -> tuple[str, float]:
    """`ran` with the largest difference from the oracle's displacements, of their peak, or `refused`.

    Both of the system's march and of a run; not of one with rigid links, which are stiff ones there: that is of second
    order in the step.
    """
    divided = cell.law == LIMIT
    try:
        of = begun(scene_of(cell))
        run = run_of(of)
        if cell.frames == "stiffening":
            return "ran", apart(run, run_of(of, monolithic=True))
        of = as_a_run(of) if cell.frames == "co-rotational" else of
        wanted = by_oracle(of, STEPS, keeps=True, divided=divided)[0]
        found = [rows(of.ready, marched(of, STEPS, divided)[1].u)]
        if "rigid" not in cell.links:
            found.append(run)
        return "ran", max(apart(each, wanted) for each in found)
    except KedfemError as error:
        if refused_by_the_table(error):
            return "refused", 0.0
        raise


def apart(found: np.ndarray, wanted: np.ndarray) -> float:
    """Largest difference, of the peak."""
    return float(np.abs(found - wanted).max() / np.abs(wanted).max())


def as_a_run(of: Begun) -> Begun:
    """The same, begun as runs with co-rotational frames begin."""
    rates = initial_rates(of.prepared.scene, of.prepared.linkage, of.prepared.path, of.ready.system.model)
    return replace(of, state=rest(of.ready, of.motion, rates, accelerated=accelerated_in_a_step))


def run_of(of: Begun, monolithic: bool = False) -> np.ndarray:
    """Displacements (T, N) of all links by the solver that a run takes, or by the monolithic one."""
    made, model = of.prepared, of.prepared.model
    analysis = made.scene.analysis.model_copy(update={"solver": "monolithic"} if monolithic else {})
    solver = steps_of(made.scene.model_copy(update={"analysis": analysis}), model)
    blocks = list(transient(made.scene, made.linkage, made.path, model, solver))
    every = [np.concatenate([x.links[k].u for x in blocks])[1:] for k in range(len(model.links))]
    return np.concatenate([u.reshape(len(u), -1) for u in every], axis=1)


def main() -> None:
    """Executes all cells, or those whose names hold given words."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("words", nargs="*")
    words = parser.parse_args().words
    count: dict[str, int] = {}
    for cell in all_cells():
        if not all(word in str(cell) for word in words):
            continue
        start = time.process_time()
        try:
            what, differs = executed(cell)
        except Exception as error:  # noqa: BLE001  all of them are listed
            what, differs = f"failed: {error}", 0.0
        if what == "ran" and differs > cell.within:
            what = "differs"
        count[what.split(":")[0]] = count.get(what.split(":")[0], 0) + 1
        said = f"{time.process_time() - start:6.2f} s  {differs:8.1e}  {cell}: {what}"
        sys.stdout.write(said + "\n")
    sys.stdout.write(f"{count}\n")


if __name__ == "__main__":
    main()
