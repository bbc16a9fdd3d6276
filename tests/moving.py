"""Mechanisms with joints between links that both move, for tests: inverted slider-cranks, a shaft of universal joints."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.dynamics.history import Block, Snapshot
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.results.recording import recording
from kedfem.scene import scene_from


def bar(model: str, a: Sequence[float], b: Sequence[float], along: int = 8, **more: Any) -> dict[str, Any]:
    """A steel bar, 30 mm by 20 mm."""
    elements: Any = {"beam": along, "plane": [along, 2], "solid": [along, 2, 1], "rigid": [1, 1, 1]}[model]
    shape = {"kind": "bar", "between": [list(a), list(b)], "width": 0.03, "thickness": 0.02}
    return {"model": model, "material": "steel", "shape": shape, "mesh": {"elements": elements}, **more}


def turning(speed: str = "120 rpm") -> dict[str, Any]:
    return {"joint": "A", "motion": {"kind": "constant_speed", "speed": speed}}


def inverted(model: str = "beam", kind: str = "prismatic", **analysis: Any) -> dict[str, Any]:
    """A crank turns an arm about B: by a block that slides on the arm, or by its pin in a slot of the arm."""
    end = 0.15 if model == "beam" else 0.16
    links = {"crank": bar(model, (0, 0), (0.1, 0)), "arm": bar(model, (-0.3, 0), (0.5, 0), 16)}
    joints: dict[str, Any] = {
        "A": {"kind": "revolute", "links": ["ground", "crank"], "at": [0, 0]},
        "B": {"kind": "revolute", "links": ["ground", "arm"], "at": [-0.3, 0]},
    }
    if kind == "slot":
        joints["S"] = {"kind": "slot", "links": ["crank", "arm"], "at": [0.1, 0], "axis": "x"}
    else:
        links["block"] = bar(model, (0.1, 0), (end, 0), 2)
        joints["C"] = {"kind": "revolute", "links": ["crank", "block"], "at": [0.1, 0]}
        at = [0.15, 0] if model == "beam" else [0.13, 0.015]
        joints["S"] = {"kind": "prismatic", "links": ["block", "arm"], "at": at, "axis": "x"}
    steps = {"revolutions": 0.25, "steps_per_revolution": 720, "initial": "quasi-static", **analysis}
    given = {key: value for key, value in steps.items() if value is not None}
    return {"links": links, "joints": joints, "drive": turning(), "analysis": given}


def ran(raw: dict[str, Any]) -> tuple[Prepared, list[Block]]:
    """A scene with all its blocks."""
    scene = scene_from(raw)
    ready = meshed(scene)
    steps = steps_of(scene, ready.model)
    return ready, list(transient(scene, ready.linkage, ready.path, ready.model, steps))


def snapshots(*run: Any) -> Iterator[Snapshot]:
    """All time points of `transient`, one by one."""
    for block in transient(*run):
        yield from (block.at(k) for k in range(len(block)))


def state(blocks: list[Block], k: int, name: str) -> np.ndarray:
    """u, v, a, g, port_forces … of link k over time."""
    return np.concatenate([getattr(block.links[k], name) for block in blocks])


def channels(ready: Prepared, blocks: list[Block]) -> dict[str, np.ndarray]:
    """All channels over time."""
    every = recording(ready.scene, ready.model, along=ready.path)
    return {each.channel.name: np.concatenate([each.rows(block) for block in blocks]) for each in every}


def beam_in_space(a: Sequence[float], b: Sequence[float], along: int = 4, up: Any = (0, 0, 1)) -> dict[str, Any]:
    """A steel rod of round section."""
    section = {"kind": "round", "diameter": 0.02}
    shape = {"kind": "polyline", "points": [list(a), list(b)], "section": section, "up": list(up)}
    return {"model": "beam", "beam": "spatial", "material": "steel", "shape": shape, "mesh": {"elements": along}}


def cardan(kind: str = "cylindrical", bend: float = 0.4, **analysis: Any) -> dict[str, Any]:
    """Two shafts with a universal joint between them; the second, heavy on one side, turns in a bearing on the ground."""
    d = np.array([np.cos(bend), np.sin(bend), 0])
    n = np.array([-np.sin(bend), np.cos(bend), 0])
    end, off = 0.25 * d, 0.25 * d + 0.05 * n
    links = {"first": beam_in_space((-0.3, 0, 0), (0, 0, 0)), "second": beam_in_space((0, 0, 0), end)}
    links["arm"] = beam_in_space(end, off, 2)
    joints: dict[str, Any] = {
        "A": {"kind": "revolute", "links": ["ground", "first"], "at": [-0.3, 0, 0], "axis": [1, 0, 0]},
        "U": {"kind": "universal", "links": ["first", "second"], "at": [0, 0, 0], "axes": [[0, 0, 1], list(n)]},
        "B": {"kind": kind, "links": ["second", "ground"], "at": end.tolist(), "axis": d.tolist()},
        "W": {"kind": "weld", "links": ["second", "arm"], "at": end.tolist()},
    }
    steps = {"revolutions": 0.5, "steps_per_revolution": 360, "initial": "quasi-static", "rho_inf": 0.9, **analysis}
    return {"links": links, "joints": joints, "drive": turning("300 rpm"), "analysis": steps}


def rising(angle: float, key: str = "angle") -> dict[str, Any]:
    return {"kind": "cycloidal", key: angle, "rise": 0.1}


TENTH = {"end_time": 0.12, "step": 5e-4, "rho_inf": 0.8, "initial": "quasi-static"}


def two_drives() -> dict[str, Any]:
    """An arm of two links, both of whose joints are driven."""
    return {
        "links": {"one": bar("beam", (0, 0), (0.3, 0)), "two": bar("beam", (0.3, 0), (0.5, 0))},
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "one"], "at": [0, 0]},
            "B": {"kind": "revolute", "links": ["one", "two"], "at": [0.3, 0]},
        },
        "drives": {"a": {"joint": "A", "motion": rising(1.0)}, "b": {"joint": "B", "motion": rising(-1.5)}},
        "analysis": dict(TENTH),
    }


def driven_slide() -> dict[str, Any]:
    """A beam that is pushed across itself."""
    return {
        "links": {"one": bar("beam", (0, 0), (0.3, 0))},
        "joints": {"A": {"kind": "prismatic", "links": ["one", "ground"], "at": [0, 0], "axis": "y"}},
        "drive": {"joint": "A", "motion": rising(0.1, "travel")},
        "analysis": dict(TENTH),
    }


def geared() -> dict[str, Any]:
    """Two beams on the ground whose hubs mesh; the first is driven over a shaft that gives."""
    return {
        "links": {"one": bar("beam", (0, 0), (0.3, 0)), "two": bar("beam", (0.5, 0), (0.7, 0))},
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "one"], "at": [0, 0]},
            "B": {"kind": "revolute", "links": ["ground", "two"], "at": [0.5, 0]},
        },
        "gears": {"g": {"joints": ["A", "B"], "teeth": [20, 40]}},
        "drive": {"joint": "A", "shaft_stiffness": 500.0, "shaft_damping": 0.1, "motion": rising(1.0)},
        "analysis": dict(TENTH),
    }


DIRECTIONS = {"axis", "axes", "along", "up", "vector", "gravity", "angular_velocity"}


def turned(raw: dict[str, Any], R: np.ndarray, shift: Any = (0.0, 0.0, 0.0)) -> dict[str, Any]:
    """A scene that is turned and shifted as a whole, with all that names places and directions; one of links that are
    drawn in a plane stays in it."""

    def vector(x: Any) -> list[float]:
        return [float(c) for c in R @ np.asarray(x, float)]

    def point(x: Any) -> list[float]:
        return [float(c) for c in (R @ np.resize([*x, 0.0], 3) + shift)[: len(x)]]

    def moved(x: Any, key: str = "") -> Any:
        if isinstance(x, dict):
            return x if "over" in x else {name: moved(each, name) for name, each in x.items()}
        if not isinstance(x, list):
            return x
        if key in {"at", "centre"}:
            return point(x)
        if key == "inertia":
            xx, yy, zz, xy, yz, zx = x
            of = R @ np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]]) @ R.T
            return [float(of[k]) for k in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0))]
        if key in DIRECTIONS:
            return [vector(each) for each in x] if isinstance(x[0], list) else vector(x)
        return [point(e) if key in {"points", "between"} and isinstance(e, list) else moved(e) for e in x]

    made: dict[str, Any] = moved(raw)
    return made


def screwed() -> dict[str, Any]:
    """A spindle turns in the ground and drives a nut that a slide on the ground keeps from turning."""
    return {
        "links": {
            "spindle": beam_in_space((0, 0, 0), (0.4, 0, 0), 4),
            "nut": beam_in_space((0.2, 0, 0), (0.2, 0.1, 0), 2),
        },
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "spindle"], "at": [0, 0, 0], "axis": [1, 0, 0]},
            "S": {"kind": "screw", "links": ["nut", "spindle"], "at": [0.2, 0, 0], "axis": [1, 0, 0], "lead": 0.02},
            "G": {"kind": "prismatic", "links": ["nut", "ground"], "at": [0.2, 0.1, 0], "axis": [1, 0, 0]},
        },
        "drive": {"joint": "A", "motion": rising(3.0)},
        "analysis": dict(TENTH),
    }
