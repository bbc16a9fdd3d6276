"""Loads and laws of random mechanisms: forces, springs, motors, limits, bodies, bushings."""

from typing import Any

import numpy as np

from tests.random_drawing import Drawing

Raw = dict[str, Any]


def factor(d: Drawing) -> Raw:
    return {"over": "time", "at": [0.0, 0.1], "value": [1.0, float(d.random.uniform(0.2, 3))]}


def loads(d: Drawing) -> Raw:
    """Forces and torques that keep their direction or turn, some over time."""
    out: Raw = {}
    for k in range(int(d.random.integers(1, 3))):
        name = d.one(list(d.links))
        frame = d.one(("world", "link"))
        more = {"factor": factor(d)} if d.chance(0.3) else {}
        out[f"f{k}"] = {"kind": "force", "link": name, "at": d.one(d.places[name]).tolist(), "frame": frame,
                        "vector": (20 * d.vector()).tolist(), **more}  # fmt: skip
    beams = [name for name, kind in d.kinds.items() if kind == "beam"]
    if beams and d.chance(0.3):
        name = d.one(beams)
        out["t"] = {"kind": "torque", "link": name, "at": d.one(d.places[name]).tolist(), "vector": d.vector().tolist(),
                    "frame": d.one(("world", "link"))}  # fmt: skip
    return out


def between(d: Drawing) -> list[Raw] | None:
    one, other = d.one(list(d.links)), d.one(list(d.places))
    a, b = d.one(d.places[one]), d.one(d.places[other])
    if other == "ground":
        b = d.away(a)
    if one == other or np.linalg.norm(a - b) < 0.03:
        return None
    return [{"link": one, "at": a.tolist()}, {"link": other, "at": b.tolist()}]


def springs(d: Drawing, moved: set[str]) -> Raw:
    """Between points, about hinges, along slides."""
    out: Raw = {}
    law = {"stiffness": 300.0, "damping": 3.0, "preload": float(5 * d.random.normal())}
    if d.chance(0.3):
        law["stiffness_factor"] = factor(d)
    ends = between(d)
    if ends and d.chance(0.5):
        out["between"] = {"kind": "spring", "between": ends, **law}
    for name, made in d.joints.items():
        if name in moved or not d.chance(0.25):
            continue
        if made["kind"] in {"revolute", "cylindrical", "screw"}:
            out[f"about{name}"] = {"kind": "torsion", "joint": name, "stiffness": 3.0, "damping": 0.05, "preload": 0.3}
        if made["kind"] in {"prismatic", "cylindrical"} and ("ground" in made["links"] or d.frames != "rigid-body"):
            out[f"along{name}"] = {"kind": "spring", "joint": name, **law}
    return out


def motors(d: Drawing, moved: set[str]) -> Raw:
    out: Raw = {}
    for name, made in d.joints.items():
        if name in moved or not d.chance(0.2):
            continue
        turning = made["kind"] in {"revolute", "screw"} or (made["kind"] == "cylindrical" and d.chance(0.5))
        sliding = made["kind"] in {"prismatic", "cylindrical"}
        if sliding and "ground" not in made["links"] and d.frames == "rigid-body":
            sliding = False
        over = d.one(("time", "speed"))
        # a torque that rises with speed by so much would have several solutions within a step
        value = [-4.0, 6.0] if over == "time" else [6.0, -4.0]
        table = {"over": over, "at": [-1.0, 1.0], "value": value}
        if turning or sliding:
            out[f"m{name}"] = {"joint": name, "torque" if turning else "force": table}
    return out


def limits(d: Drawing, moved: set[str]) -> Raw:
    """Stops that are soon met."""
    out: Raw = {}
    for name, made in d.joints.items():
        if name in moved or not d.chance(0.15):
            continue
        if made["kind"] in {"revolute", "cylindrical", "screw"}:
            out[f"l{name}"] = {"kind": "angle", "joint": name, "lower": -0.005, "upper": 0.01, "stiffness": 40.0}
        elif made["kind"] == "prismatic" and ("ground" in made["links"] or d.frames != "rigid-body"):
            out[f"l{name}"] = {"kind": "travel", "joint": name, "lower": -0.0005, "upper": 0.001, "stiffness": 2e3}
    return out


def bodies(d: Drawing) -> Raw:
    name = d.one(list(d.links))
    return {"w": {"kind": "point_mass", "link": name, "at": d.one(d.places[name]).tolist(), "mass": 0.3}}


def bushings(d: Drawing) -> None:
    """Some joints give, the same in all directions."""
    for made in d.joints.values():
        if made["kind"] in {"weld", "slot"} or not d.chance(0.15) or d.plane:
            continue
        turns = made["kind"] != "spherical" and d.chance(0.5)
        made["bushing"] = {"stiffness": 1e6} | ({"rotational_stiffness": 2e3} if turns else {})
