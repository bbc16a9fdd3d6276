"""Random driven mechanisms: arms, welds, loops, wheels and racks of all kinds of joints and links, with all laws."""

import copy
from typing import Any

import numpy as np

from kedfem.scene.records.drives import prescribes_travel
from tests.random_drawing import FREEDOMS, FREEDOMS_IN_PLANE, Drawing
from tests.random_laws import bodies, bushings, limits, loads, motors, springs

Raw = dict[str, Any]


def driven_arm(d: Drawing) -> None:
    """A link that a drive turns or pushes."""
    body, a = d.parent() if d.links else ("ground", np.zeros(3))
    b = d.away(a)
    kind = "prismatic" if d.chance(0.25) else "revolute"
    name = d.link(a, b)
    pair = (name, body) if d.chance(0.5) else (body, name)
    at = d.join(kind, pair, a, d.axis(kind, d.along(body), b - a))
    speed = float(d.random.uniform(1, 4) * d.one((1, -1)) * (0.1 if kind == "prismatic" else 1))
    d.drives[f"d{len(d.drives)}"] = {"joint": at, "motion": {"kind": "constant_speed", "speed": speed}}


def welded_arm(d: Drawing) -> None:
    """A link welded to another, in line with it."""
    body = d.one(list(d.links))
    a = d.places[body][1]
    b = a + (a - d.places[body][0]) * d.random.uniform(0.6, 1.2)
    plane = {"plane"} & {d.kinds[body]}
    name = d.link(a, b, "plane" if plane else "planar beam" if d.plane else d.kinds[body] if d.chance(0.5) else "beam")
    d.join("weld", (body, name), a, d.vector())


def hops(d: Drawing) -> list[str]:
    """Kinds of joints whose freedoms are those of space, or of the plane."""
    freedoms = FREEDOMS_IN_PLANE if d.plane else FREEDOMS
    left, out = 3 if d.plane else 6, []
    while left:
        fit = [kind for kind, n in freedoms.items() if 0 < n <= left]
        out.append(str(d.one(fit)))
        left -= freedoms[out[-1]]
    d.random.shuffle(out)
    return out


def loop(d: Drawing) -> None:
    """Links that close a loop from a moving link to the ground or another one."""
    kinds = hops(d)
    start = d.one(list(d.links))
    end = "ground" if d.chance(0.6) else d.one([x for x in d.places if x != start])
    places = [d.one(d.places[start])]
    for _ in kinds[1:]:
        places.append(d.away(places[-1]))
    if end != "ground":
        places[-1] = d.one(d.places[end])
        if len(places) == 1:
            return
    before = start
    for k, kind in enumerate(kinds):
        last = k + 1 == len(kinds)
        if last:
            after = end
        else:
            a, b = places[k], places[k + 1]
            a, b = (b, b + 1.8 * (a - b)) if kind == "slot" else (a, b)
            after = d.link(a, b, along=3 if kind == "slot" else 1)
        one, two = d.along(before), d.along(after)
        axis = (two if after != "ground" else one + 0.2 * d.vector()) if kind == "slot" else d.axis(kind, one, two)
        pair = (before, after) if kind == "slot" or d.chance(0.5) else (after, before)
        d.join(kind, pair, places[k], axis)
        before = after


def wheel(d: Drawing) -> None:
    """A link on a hinge that is geared to another hinge, or on a slide that this moves as a rack."""
    hinges = [name for name, x in d.joints.items() if x["kind"] == "revolute"]
    if not hinges or d.plane:
        return
    slides = d.chance(0.4)
    body, a = d.parent()
    b = d.away(a)
    name = d.link(a, b)
    kind = "prismatic" if slides else "revolute"
    new = d.join(kind, (name, body) if d.chance(0.5) else (body, name), a, d.axis(kind, d.along(body), b - a))
    ratio = float(d.random.uniform(0.5, 2) * d.one((1, -1)))
    d.gears[f"g{len(d.gears)}"] = {
        "joints": [d.one(hinges), new],
        **({"radius": 0.1 * ratio} if slides else {"ratio": ratio}),
    }


def driven(seed: int, most: int = 8, frames: str = "rigid-body") -> Raw:
    """A mechanism whose drives determine its motion, under gravity and loads, with laws of all kinds."""
    random = np.random.default_rng(seed)
    d = Drawing(random, plane=bool(random.random() < 0.3), frames=frames)
    driven_arm(d)
    for _ in range(int(random.integers(1, 4))):
        part = d.random.choice([loop, loop, welded_arm, driven_arm, wheel])
        if len(d.links) < most:
            part(d)
    moved = {drive["joint"] for drive in d.drives.values()}
    moved |= {name for gear in d.gears.values() for name in gear["joints"]}
    bushings(d)
    raw: Raw = {
        "links": d.links, "joints": d.joints, "drives": d.drives, "gears": d.gears, "loads": loads(d),
        "springs": springs(d, set()), "motors": motors(d, {x["joint"] for x in d.drives.values()}),
        "limits": limits(d, {x["joint"] for x in d.drives.values()}),
        "gravity": (d.flat * 8 * d.random.normal(size=3)).tolist(), "bodies": bodies(d) if d.chance(0.4) else {},
    }  # fmt: skip
    probes = {name: {"link": name, "at": x[1].tolist(), "quantity": "displacement", "frame": "world"}
              for name, x in d.places.items() if d.kinds.get(name, "rigid") != "rigid"}  # fmt: skip
    raw["output"] = {"probes": probes}
    raw["analysis"] = {"kind": "quasi-static", "end_time": 0.03, "step": 0.015, "accuracy": "quick", "frames": frames}
    return {key: x for key, x in raw.items() if x or key == "links"}


def by_other_coordinates(raw: Raw, seed: int) -> Raw:
    """A mechanism that is driven where its loops have joints, at any of their coordinates; gears and laws there too."""
    random, raw = np.random.default_rng(seed + 2_000_000), copy.deepcopy(raw)
    spared = {x["joint"] for key in ("springs", "motors", "limits") for x in raw.get(key, {}).values() if "joint" in x}
    spared |= {name for gear in raw.get("gears", {}).values() for name in gear["joints"]}
    spared |= {name for name, x in raw["joints"].items() if "bushing" in x}
    spared |= {x["joint"] for x in raw["drives"].values()}
    left = {name: x for name, x in raw["joints"].items() if name not in spared}

    def taken(*kinds: str) -> str | None:
        fit = [name for name, x in left.items() if x["kind"] in kinds]
        if not fit:
            return None
        name = str(random.choice(fit))
        del left[name]
        return name

    for drive in raw["drives"].values():
        at = taken("cylindrical", "screw", "universal", "planar", "slot", "prismatic", "revolute")
        if at is not None:
            drive.clear()
            drive |= {"joint": at, **coordinate(raw["joints"][at], random)}
            slides = prescribes_travel(raw["joints"][at]["kind"], drive.get("coordinate"), drive.get("along"))
            speed = float(random.uniform(1, 4) * random.choice((1, -1)) * (0.1 if slides else 1))
            drive["motion"] = {"kind": "constant_speed", "speed": speed}
    for gear in raw.get("gears", {}).values():
        at = taken("cylindrical", "screw", "planar")
        if at is not None:
            gear["joints"][0] = at
    law = {"stiffness": 30.0, "damping": 0.3, "preload": 0.3}
    for key in ("springs", "motors"):
        at = taken("universal", "planar", "slot")
        if at is not None:
            on = coordinate(raw["joints"][at], random)
            slides = prescribes_travel(raw["joints"][at]["kind"], None, on.get("along"))
            table = {"over": "speed", "at": [-1.0, 1.0], "value": [6.0, -4.0]}
            made = {"force" if slides else "torque": table} if key == "motors" else law
            kind = {} if key == "motors" else {"kind": "spring" if slides else "torsion"}
            raw.setdefault(key, {})["of"] = {"joint": at, **kind, **made, **on}
    return raw


def coordinate(joint: Raw, random: np.random.Generator) -> Raw:
    """The keys that choose one of a joint's coordinates."""
    kind = joint["kind"]
    if kind in {"cylindrical", "screw"}:
        return {"coordinate": str(random.choice(["angle", "travel"]))}
    if kind == "universal":
        return {"about": str(random.choice(joint["links"]))}
    if kind == "planar" and random.random() < 0.5:
        across = np.cross(joint["axis"], random.normal(size=3))
        return {"along": (across / np.linalg.norm(across)).tolist()}
    return {}
