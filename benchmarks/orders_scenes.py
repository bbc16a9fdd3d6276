"""Five scenes of two mechanisms at 600 rpm: the source's four-bar, and a crank whose rod slides in a tube that swings.

The rod slides along an elastic link that moves: with rigid-body frames a constraint whose direction varies.
"""

from collections.abc import Callable
from typing import Any

from benchmarks.orders_equation import TURN, TURNS
from benchmarks.scenes import DAMPED, EYE, four_bar_of

Raw = dict[str, Any]


def four_bar(damped: bool, start: str, plates: bool = False, **more: Any) -> Raw:
    """The source's four-bar."""
    raw = four_bar_of(*_links(plates))
    raw["points"]["B"]["angle"] = "60 deg" if plates else 0
    return _moving(raw, damped, start, more)


def slide(damped: bool, start: str, plates: bool = False, **more: Any) -> Raw:
    """The same crank; from its pin a rod slides in a tube that turns about the rocker's hinge."""
    raw = four_bar_of(*_links(plates))
    like = raw["links"]["rocker"]
    points = {k: raw["points"][k] for k in "ABD"}
    points |= {"B": [0.1524, 0.2639645], "E": {"between": ["B", "D"], "fraction": 0.5}}
    links = {
        name: {**like, "shape": {**like["shape"], "between": list(ends)}}
        for name, ends in {"crank": "AB", "rod": "BE", "tube": "ED"}.items()
    }
    hinged = {"A": ["ground", "crank"], "B": ["crank", "rod"], "D": ["tube", "ground"]}
    joints: dict[str, Raw] = {k: {"kind": "revolute", "links": x, "at": k} for k, x in hinged.items()}
    joints["E"] = {"kind": "prismatic", "links": ["rod", "tube"], "at": "E", "axis": [0.762, -0.2639645]}
    if "loads" in more:
        more["loads"] = {"p": {**more["loads"]["p"], "link": "tube", "at": {"between": ["E", "D"]}}}
    raw = {**{k: raw[k] for k in ("materials", "drive")}, "points": points, "links": links, "joints": joints}
    return _moving(raw, damped, start, more)


def _links(plates: bool) -> tuple[Raw, Raw]:
    if plates:
        return {"kind": "plate_link", **EYE}, {"reduction": 8}
    return {"kind": "bar", "width": 0.0254, "thickness": 0.0254}, {"model": "beam", "mesh": {"elements": 1}}


def _moving(raw: Raw, damped: bool, start: str, more: Raw) -> Raw:
    if damped:
        raw["damping"] = DAMPED
    raw["analysis"] = {
        "end_time": TURNS * TURN, "step": TURN / 1000, "accuracy": "quick", "initial": start, "frames": "rigid-body"
    }  # fmt: skip
    return {**raw, **more}


PUSH = {"kind": "force", "link": "rocker", "at": {"between": ["C", "D"]}, "vector": [200.0, 0]}
CORNERS = {"over": "angle", "at": [0.0, 0.7, 1.9, 2.3], "value": [0.0, 1.0, -1.0, 0.0], "period": "360 deg"}
SCENES: dict[str, Callable[[Callable[..., Raw]], Raw]] = {
    "damped": lambda of: of(True, "quasi-static"),
    "damped, from rest": lambda of: of(True, "rest"),
    "undamped, from rest": lambda of: of(False, "rest"),
    "reduced plates": lambda of: of(True, "quasi-static", plates=True),
    "load with corners": lambda of: of(True, "quasi-static", loads={"p": {**PUSH, "factor": CORNERS}}),
}
"""Of either mechanism."""
