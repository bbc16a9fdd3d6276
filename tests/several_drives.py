"""An arm on the ground by one joint whose coordinates are all driven, and the same by two or three joints in a row."""

from typing import Any

import numpy as np

from tests.moving import beam_in_space
from tests.spatial_joints import rigid_in_space

Raw = dict[str, Any]
FOOT, HERE, OUT = (-0.2, 0.1, 0.0), (0.02, -0.01, 0.03), (0.32, 0.12, 0.2)
AXES = {"x": (1.0, 0.0, 0.0), "y": (0.0, 1.0, 0.0), "z": (0.0, 0.0, 1.0), "oblique": (2 / 7, 3 / 7, 6 / 7)}
#: kinds with several coordinates, and the names of the drives of each
SEVERAL = {"cylindrical": ("turn", "push"), "universal": ("first", "second"), "planar": ("turn", "one", "two")}
ANGLE = {"kind": "harmonic", "angle": 0.5, "frequency": 7.0, "phase": "-90 deg"}
LAWS = {
    "turn": {"kind": "cycloidal", "angle": 0.9, "rise": 0.1}, "first": {"kind": "cycloidal", "angle": 0.7, "rise": 0.1},
    "second": ANGLE, "push": {"kind": "harmonic", "travel": 0.05, "frequency": 9.0, "phase": "-90 deg"},
    "one": {"kind": "harmonic", "travel": 0.05, "frequency": 9.0, "phase": "-90 deg"},
    "two": {"kind": "cycloidal", "travel": 0.08, "rise": 0.12},
    "swing": {"kind": "cycloidal", "angle": -0.6, "rise": 0.1},
}  # fmt: skip


def arm(kind: str) -> Raw:
    """A link from the joint out, of a kind."""
    if kind == "beam":
        return beam_in_space(HERE, OUT, 2)
    if kind == "rigid":
        return rigid_in_space(HERE, OUT)
    shape = {"kind": "bar", "between": [list(HERE), list(OUT)], "width": 0.03, "thickness": 0.03, "up": "y"}
    return {"model": "solid", "material": "steel", "shape": shape, "mesh": {"elements": [3, 1, 1]}}


def across(axis: Any) -> tuple[list[float], list[float]]:
    """Two directions across an axis, at right angles."""
    a = np.cross(axis, (0.3, -0.7, 0.5))
    a /= np.linalg.norm(a)
    return a.tolist(), np.cross(axis, a).tolist()


def analysed(links: Raw, joints: Raw, drives: Raw, **analysis: Any) -> Raw:
    """From rest under gravity."""
    steps = {"end_time": 0.03, "step": 5e-4, "rho_inf": 0.8, "initial": "quasi-static", "accuracy": "quick", **analysis}
    given = {name: {**drive, "motion": LAWS[name]} for name, drive in drives.items()}
    return {"links": links, "joints": joints, "drives": given, "gravity": [2.0, -9.0, 3.0], "analysis": steps}


def at_once(kind: str, link: str, to: str, on: str = "ground", **analysis: Any) -> Raw:
    """All drives on one joint J of an arm, on the ground or on a link that a further drive turns."""
    axis, (a, b) = list(AXES[to]), across(AXES[to])
    joint = {"kind": kind, "links": [on, "arm"] if kind == "universal" else ["arm", on], "at": list(HERE)}
    joint |= {"axes": [axis, a]} if kind == "universal" else {"axis": axis}
    keys = {
        "cylindrical": ({"coordinate": "angle"}, {"coordinate": "travel"}),
        "universal": ({"about": on}, {"about": "arm"}),
        "planar": ({}, {"along": a}, {"along": b}),
    }[kind]
    links, joints = {"arm": arm(link)}, {"J": joint}
    drives = {name: {"joint": "J", **key} for name, key in zip(SEVERAL[kind], keys, strict=True)}
    if on != "ground":
        links[on] = {"model": "rigid", "mass": 0.0} if on == "base" else beam_in_space(FOOT, HERE, 2)
        joints["foot"] = {"kind": "revolute", "links": [on, "ground"], "at": list(FOOT), "axis": [0.6, 0.0, 0.8]}
        drives["swing"] = {"joint": "foot"}
    return analysed(links, joints, drives, **analysis)


def in_a_row(kind: str, link: str, to: str, **analysis: Any) -> Raw:
    """A joint for each drive, named as it, and links without mass between them."""
    axis, (a, b) = list(AXES[to]), across(AXES[to])
    hinge, slide = {"kind": "revolute", "at": list(HERE)}, {"kind": "prismatic", "at": list(HERE)}
    joints = {
        "cylindrical": {"push": slide | {"axis": axis}, "turn": hinge | {"axis": axis}},
        "universal": {"first": hinge | {"axis": axis}, "second": hinge | {"axis": a}},
        "planar": {"one": slide | {"axis": a}, "two": slide | {"axis": b}, "turn": hinge | {"axis": axis}},
    }[kind]
    names = ["ground", *(f"between {k}" for k in range(1, len(joints))), "arm"]
    for joint, outer, inner in zip(joints.values(), names[1:], names, strict=False):
        joint["links"] = [outer, inner]
    if kind == "universal":  # the ground's arm of the cross against the arm's: the other way round
        joints["second"]["links"].reverse()
    links = {"arm": arm(link)} | {name: {"model": "rigid", "mass": 0.0} for name in names[1:-1]}
    return analysed(links, joints, {name: {"joint": name} for name in SEVERAL[kind]}, **analysis)
