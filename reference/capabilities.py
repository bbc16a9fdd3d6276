"""docs/capabilities.md, from the table of capabilities.

Regenerate it with ``python -m reference.capabilities > docs/capabilities.md``.
"""

from __future__ import annotations

import sys

from kedfem.scene.checks.capabilities import CONSTRAINED, KINDS, REFUSALS, SHARED, Facts, Refusal, refusals
from kedfem.scene.questions.modelling import SHARED as SHARED_KINDS

INTRODUCTION = """\
# Capabilities

Which combinations of joints, frames, drives, links and force elements a scene may have. What no line of the table at the
end meets is not refused for its combination; numbers in the matrices are lines of it. Scenes are checked by the same
table, and messages are its words; words in capitals are those of a scene. `enforced` is how a joint is: by points that
its links share, or by constraint equations, as joints are between links that slide or rotate on each other,
driven ones, gears and bushings, and in space hinges and welds of links with unlike frames. What a single part needs (a
key of a kind of link, a surface at a joint, points of planar links in one plane) is in [scene.md](scene.md) and
[meshing.md](meshing.md).

It is executed (`python -m tests.cells`). Of {all} cells, each kind of joint with all frames, with and without a drive, on
13 pairs of kinds of links, drives of all coordinates of joints, and each pair of these with one of 22 loads and laws,
{ran} ran three steps from a loaded, moving start: as by the monolithic solver, which assembles all tangents anew, to 1e-8
of the peak, 1e-7 with co-rotational frames, 5e-7 with rigid-body ones and beams in space, where rounding beside the stiff
rigid parts at their ends is 2e-7. {refused} were refused by lines of the table.

The page is made by `python -m reference.capabilities > docs/capabilities.md`.
"""
CELLS = (593, 265)
"""Of `tests.cells`: those that ran, and those that were refused."""
COLUMNS: dict[str, Facts] = {
    "rigid-body, driven": {"frames": "rigid-body", "drive": "given", "stiffening": "off"},
    "rigid-body with stiffening, driven": {"frames": "rigid-body", "drive": "given", "stiffening": "on"},
    "co-rotational, driven": {"frames": "co-rotational", "drive": "given", "stiffening": "off"},
    "co-rotational, no drive": {"frames": "co-rotational", "drive": "none", "stiffening": "off"},
}
"""Frames of a scene, with a drive and without one."""
JOINTS: dict[str, Facts] = {
    **{kind: {"joint": kind, "enforced": SHARED if kind in SHARED_KINDS else CONSTRAINED} for kind in KINDS},
    "prismatic on the ground": {"joint": "prismatic", "enforced": SHARED},
    "revolute, driven on the ground": {"joint": "revolute", "enforced": SHARED},
    "revolute, driven between links": {"joint": "revolute", "enforced": CONSTRAINED},
    "prismatic, driven": {"joint": "prismatic", "enforced": CONSTRAINED},
    "any, with a bushing": {"enforced": CONSTRAINED, "bushing": "given"},
    "slot in space, with a bushing unlike across": {
        "joint": "slot",
        "enforced": CONSTRAINED,
        "bushing": "unlike across the line",
    },
}
"""Joints, between links that move and not driven if nothing else is said."""
ON_JOINTS: dict[str, tuple[str, str]] = {
    "drive": ("drives", ""), "gear": ("gears", "gear"), "rack, on its second joint": ("gears", "rack"),
    "motor's torque": ("motors", "torque"), "motor's force": ("motors", "force"),
    "torsion spring": ("springs", "torsion"), "spring along": ("springs", "along"),
    "limit of the angle": ("limits", "angle limit"), "limit of the travel": ("limits", "travel limit"),
}  # fmt: skip
LOADS = ("force", "torque", "body", "line", "surface", "pressure")
LINKS = ("solid", "plane", "beam", "rigid", "slider")


def cell(of: str, facts: Facts) -> str:
    """Yes, or the numbers of the lines that refuse."""
    met = [REFUSALS.index(each) + 1 for each in refusals(of, facts)]
    return ", ".join(map(str, met)) or "yes"


def table(head: list[str], rows: list[list[str]]) -> str:
    """A table of the page."""
    every = [head, ["---"] * len(head), *rows]
    return "\n".join(f"| {' | '.join(row)} |" for row in every) + "\n"


def capabilities_page() -> str:
    """The text of docs/capabilities.md."""
    joints = [[name, *(cell("joints", {**facts, **more}) for more in COLUMNS.values())] for name, facts in JOINTS.items()]
    elements = [
        [name, *(cell(of, {"element": element, "joint": kind}) for kind in KINDS)]
        for name, (of, element) in ON_JOINTS.items()
    ]
    loads = [[kind, *(cell("loads", {"element": kind, "link": link}) for link in LINKS)] for kind in LOADS]
    lines = [
        [str(k), f"`{each.of}`: {combination(each)}", f"must {worded(each.must)}", each.why, worded(each.take)]
        for k, each in enumerate(REFUSALS, start=1)
    ]
    return "\n".join((
        INTRODUCTION.format(all=sum(CELLS), ran=CELLS[0], refused=CELLS[1]),
        "## Joints with frames and drives\n", table(["joint", *COLUMNS], joints),
        "## Drives, gears, motors, springs and limits on joints\n", table(["on", *KINDS], elements),
        "## Loads on kinds of links\n", table(["load", *LINKS], loads),
        "## What is refused, and what to take instead\n",
        table(["", "combination", "what is required", "because", "instead"], lines),
    ))  # fmt: skip


class Capitals(dict[str, str]):
    """Words of a scene that is not there."""

    def __missing__(self, key: str) -> str:
        return key.upper()


def worded(text: str) -> str:
    """A text of the table without a scene."""
    return text.format_map(Capitals())


def combination(refusal: Refusal) -> str:
    """Its factors in words."""
    return "; ".join(f"{factor} = {' / '.join(levels)}" for factor, levels in refusal.when.items())


if __name__ == "__main__":
    sys.stdout.write(capabilities_page())
