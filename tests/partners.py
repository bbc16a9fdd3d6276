"""Closed chains in space and in the plane with any kind of joint between any two kinds of partners, or on the ground."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from tests.moving import bar, beam_in_space
from tests.spatial_joints import HERE, P, Q, Raw, ball, cross, hinge

PLACES = (HERE, P, Q, (0.33, 0.12, -0.04), (0.42, -0.05, 0.06))
Z, GENERIC = np.array([0.0, 0.0, 1.0]), np.array([0.4, 1.0, 0.3])
#: chains of joints from the crank to the ground whose freedoms are six, so that the drive moves all: J between links,
#: on the ground, and to a link that slides on the ground
IN_SPACE: dict[str, tuple[str, str, str]] = {
    "revolute": ("spherical J universal", "spherical universal J", "universal universal J prismatic"),
    "prismatic": ("spherical J universal", "universal spherical J", "spherical revolute J prismatic"),
    "screw": ("spherical J universal", "spherical universal J", "universal universal J prismatic"),
    "cylindrical": ("universal J universal", "universal universal J", "spherical J prismatic"),
    "universal": ("spherical J revolute", "spherical revolute J", "spherical J prismatic"),
    "spherical": ("revolute J universal", "revolute universal J", "universal J prismatic"),
    "planar": ("J universal prismatic", "prismatic universal J", "universal J prismatic"),
    "slot": ("J universal", "universal J", "revolute J prismatic"),
    "weld": ("J spherical universal revolute", "spherical universal revolute J", "spherical universal J prismatic"),
}
#: freedoms in the plane: three
IN_PLANE: dict[str, tuple[str, str, str]] = {
    "revolute": ("revolute J revolute", "revolute revolute J", "revolute J prismatic"),
    "prismatic": ("revolute J revolute", "revolute revolute J", "revolute J prismatic"),
    "slot": ("J revolute", "revolute J", "J prismatic"),
    "weld": ("J revolute revolute revolute", "revolute revolute revolute J", "revolute revolute J prismatic"),
}
#: numbers of the random directions, by kind and form, with which a chain in space is far from locking
SEEDS: dict[tuple[str, int], int] = {
    ("revolute", 0): 6, ("revolute", 1): 13, ("revolute", 2): 1, ("prismatic", 0): 10, ("prismatic", 1): 12,
    ("screw", 0): 10, ("screw", 1): 7, ("screw", 2): 1, ("cylindrical", 0): 3, ("cylindrical", 1): 2,
    ("universal", 0): 13,
    ("universal", 1): 10, ("spherical", 0): 2, ("spherical", 1): 1, ("spherical", 2): 10, ("planar", 0): 10,
    ("planar", 1): 3, ("slot", 0): 10, ("slot", 1): 10, ("weld", 0): 5, ("weld", 1): 12, ("weld", 2): 8,
}  # fmt: skip
#: the same with a drive on J, of an angle
DRIVEN_SEEDS: dict[tuple[str, int], int] = {("planar", 1): 0}
SPATIAL = ("beam", "solid", "reduced", "rigid", "bare")
PLANAR = ("planar beam", "plane", "solid", "rigid", "bare")


def partner(kind: str, a: Any, b: Any, up: Any) -> Raw:
    """A link of a kind from one place to another."""
    match kind:
        case "beam":
            return beam_in_space(a, b, 2, up)
        case "bare":
            return {"model": "rigid", "mass": 0.5}
        case "planar beam":
            return bar("beam", a[:2], b[:2], 2)
        case "plane":
            return bar("plane", a[:2], b[:2], 2)
        case _:
            shape = {"kind": "bar", "between": [list(a), list(b)], "width": 0.02, "thickness": 0.02, "up": list(up)}
            more = {"reduction": 12} if kind == "reduced" else {}
            model = "rigid" if kind == "rigid" else "solid"
            return {"model": model, "material": "steel", "shape": shape, "mesh": {"elements": [2, 1, 1]}, **more}


def joint(kind: str, links: Sequence[str], at: Any, axis: Any) -> Raw:
    match kind:
        case "universal":
            return cross(*links, at, axis)
        case "spherical":
            return ball(*links, at)
        case "weld":
            return {"kind": "weld", "links": list(links), "at": list(at)}
        case "screw":
            return {"kind": "screw", "links": list(links), "at": list(at), "axis": list(axis), "lead": 0.5}
        case _:
            return {"kind": kind, "links": list(links), "at": list(at), "axis": list(axis)}


def direction(kind: str, at: int, places: Sequence[np.ndarray], plane: bool, random: np.random.Generator) -> np.ndarray:
    """An axis that suits solids too: of a hinge in the faces at the ends of both links, in the plane z."""
    any_, last = random.normal(size=3), len(places) - 1
    one = places[at] - places[at - 1]
    two = places[at + 1] - places[at] if at < last else any_
    if kind == "slot":
        return two if at < last else one + 0.2 * any_ * [1, 1, 0 if plane else 1]
    if plane:
        return np.cross(Z, one) if kind == "prismatic" else Z
    return np.cross(one, two) if kind == "revolute" else any_


def prescribed(of: Raw, travel: bool) -> Raw:
    """Keys of a drive on a joint that say which of its coordinates it prescribes."""
    if of["kind"] == "universal":
        return {"about": of["links"][0]}
    if travel and of["kind"] == "planar":
        return {"along": [float(x) for x in np.cross(of["axis"], GENERIC)]}
    return {"coordinate": "travel"} if travel and of["kind"] in {"cylindrical", "screw"} else {}


def axis_of(kind: str, partners: tuple[str, str], driven: bool | str = False, plane: bool = False) -> np.ndarray:
    """The axis of a chain's joint J as it is without a rotation."""
    axes: list[np.ndarray] = []
    chain(kind, partners, driven, plane, lambda axis: axes.append(axis) or np.eye(3))  # type: ignore[func-returns-value]
    return axes[0]


def chain(
    kind: str,
    partners: tuple[str, str],
    driven: bool | str = False,
    plane: bool = False,
    turned: Callable[[np.ndarray], np.ndarray] = lambda axis: np.eye(3),
) -> Raw:
    """A crank on the ground, links, and the ground again; joint J is the one in question.

    Parameters
    ----------
    partners : of J; the second may be "ground"
    driven : J has the drive instead of the crank's hinge; if not of its angle, or of a slide's travel, which: "travel"
    turned : rotation of all of it, from the axis of J as it is drawn without one
    """
    on_ground, sliding = partners[1] == "ground", "bare" in partners
    form = 1 if on_ground else 2 if sliding else 0
    kinds = (IN_PLANE if plane else IN_SPACE)[kind][form].split()
    flat = np.array([1.0, 1.0, 0.0]) if plane else np.ones(3)
    places = [flat * x for x in PLACES[: len(kinds) + 1]]
    here, last = kinds.index("J") + 1, len(kinds)
    solids = {"solid", "reduced", "rigid"}.issuperset(partners)
    if kind == "weld" and here < last and (plane or solids):
        places[here + 1] = 2 * places[here] - places[here - 1]  # two of a width are welded along one face or edge
    seeds = SEEDS | DRIVEN_SEEDS if driven and driven != "travel" else SEEDS
    random = np.random.default_rng(seeds.get((kind, form), 0))
    axes = [direction(kind if k == here else each, k, places, plane, random) for k, each in enumerate(kinds, start=1)]
    swapped = partners[0] == "bare" and not on_ground  # what slides on the ground comes second
    if kind == "slot" and swapped:  # the line is on the link before
        axes[here - 1] = places[here] - places[here - 1]
    R = turned(axes[here - 1])

    def vector(x: Any) -> list[float]:
        out = R @ np.asarray(x, float)
        out[np.abs(out) < 1e-12 * np.linalg.norm(out)] = 0.0  # along x exactly
        return [float(c) for c in out]

    names = ["ground", "crank", *(f"link {k}" for k in range(1, last)), "ground"]
    of = dict.fromkeys(names[1:-1], "planar beam" if plane else "beam")
    of[names[here]] = partners[1] if swapped else partners[0]
    if not on_ground:
        of[names[here + 1]] = partners[0] if swapped else partners[1]
    links = {}
    for k, name in enumerate(names[1:-1]):
        a, b = places[k], places[k + 1]
        if kind == "slot" and k == here - swapped:  # the pin in the middle
            a, b = (a, a + 1.8 * (b - a)) if swapped else (b, b + 1.8 * (a - b))
        links[name] = partner(of[name], vector(a), vector(b), vector(Z))
    first = flat * np.cross(places[1], GENERIC) if not plane else Z
    joints = {"A": hinge("ground", "crank", vector(places[0]), vector(first))}
    for k, each in enumerate(kinds, start=1):
        pair = names[k : k + 2]
        made = joint(kind if each == "J" else each, pair, places[k], axes[k - 1])
        if each == "J" and swapped:
            made["links"] = pair[::-1]
        made["at"] = vector(made["at"])
        if "axis" in made:
            made["axis"] = vector(made["axis"])
        if "axes" in made:
            made["axes"] = [vector(x) for x in made["axes"]]
        joints[each if each == "J" else f"K{k}"] = made
    slides = driven == "travel" or (bool(driven) and kind in ("prismatic", "slot"))
    motion = {"kind": "cycloidal", "travel" if slides else "angle": 0.02 if driven else 0.3, "rise": 0.03}
    analysis = {"end_time": 0.002, "step": 5e-4, "rho_inf": 0.8, "initial": "quasi-static", "accuracy": "quick"}
    on = "J" if driven else "A"
    drive = {**prescribed(joints[on], slides), "joint": on, "motion": motion}
    return {
        "links": links, "joints": joints, "drive": drive,
        "gravity": vector(flat * [2.0, -9.0, 3.0]), "analysis": analysis,
    }  # fmt: skip
