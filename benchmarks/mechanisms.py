"""Five mechanisms that leave models, meshes and step to `analysis.accuracy`: short analyses that run in seconds."""

from collections.abc import Callable
from typing import Any

from benchmarks.scenes import four_bar_of
from kedfem.scene import Scene, scene_from


def plates(accuracy: float) -> Scene:
    """The four-bar of examples/four_bar_solids, half a revolution at 150 rpm."""
    shape = {"kind": "plate_link", "width": 0.0254, "thickness": 0.0254, "eye_diameter": 0.045, "bore_diameter": 0.02}
    raw = four_bar_of(shape, {})
    raw["drive"]["motion"]["speed"] = "150 rpm"
    return _asking(raw, accuracy, {"revolutions": 0.5, "initial": "quasi-static"}, {"stress": "M", "middle": "N"})


def bars(accuracy: float) -> Scene:
    """The same of bars, from a quasi-static start at 300 rpm."""
    raw = four_bar_of({"kind": "bar", "width": 0.0254, "thickness": 0.0254}, {})
    raw["drive"]["motion"]["speed"] = "300 rpm"
    return _asking(raw, accuracy, {"revolutions": 0.5, "initial": "quasi-static"}, {"stress": "M", "middle": "N"})


def slider_crank(accuracy: float) -> Scene:
    """A crank of 80 mm, a rod of 300 mm and a piston of 2 kg that is pressed upon, 600 rpm."""
    bar = {"kind": "bar", "width": 0.02, "thickness": 0.02}
    links = {"crank": ("A", "B"), "rod": ("B", "C")}
    raw: dict[str, Any] = {
        "title": "Slider-crank of bars",
        "points": {
            "A": [0, 0], "B": [0, 0.08], "C": {"from": "B", "distance": 0.3, "along": ["A", [1, 0]]},
            "M": {"between": ["B", "C"], "fraction": 0.5, "offset": 0.01},
            "N": {"between": ["B", "C"], "fraction": 0.5},
        },
        "links": {
            **{name: {"material": "steel", "shape": {**bar, "between": list(ends)}} for name, ends in links.items()},
            "piston": {"model": "rigid", "mass": 2.0},
        },
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "crank"], "at": "A"},
            "B": {"kind": "revolute", "links": ["crank", "rod"], "at": "B"},
            "C": {"kind": "revolute", "links": ["rod", "piston"], "at": "C"},
            "guide": {"kind": "prismatic", "links": ["ground", "piston"], "at": "C", "axis": "x"},
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": "600 rpm"}},
        "damping": {"ratio": 0.02, "frequencies": [300, 2000]},
    }  # fmt: skip
    on = {"stress": ("rod", "M", "stress"), "middle": ("rod", "N", "displacement")}
    return _asking(raw, accuracy, {"revolutions": 0.5, "initial": "quasi-static"}, on)


def arm(accuracy: float) -> Scene:
    """An arm of 0.6 m with 0.5 kg at its tip, swung by 60° in 0.2 s, and what rings after it."""
    shape = {"kind": "bar", "between": ["A", "B"], "width": 0.02, "thickness": 0.03}
    raw: dict[str, Any] = {
        "title": "Swung arm",
        "points": {"A": [0, 0], "B": [0.6, 0], "M": [0.2, 0.01], "N": [0.5, 0]},
        "links": {"arm": {"material": "aluminium", "shape": shape}},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": "A"}},
        "drive": {"joint": "A", "motion": {"kind": "cycloidal", "angle": "60 deg", "rise": 0.2}},
        "bodies": {"tip": {"kind": "point_mass", "link": "arm", "at": "B", "mass": 0.5}},
        "damping": {"ratio": 0.02, "frequencies": [30, 300]},
    }
    on = {"stress": ("arm", "M", "stress"), "tip": ("arm", "N", "displacement")}
    return _asking(raw, accuracy, {"end_time": 0.3}, on)


def extrusion(accuracy: float) -> Scene:
    """An arm cut from plate, with a slot of three holes, swung by 60° in 0.15 s."""
    outline = [[-0.025, -0.025], [0.3, -0.015], [0.3, 0.015], [-0.025, 0.025]]
    holes = [{"at": [x, 0], "diameter": d} for x, d in ((0, 0.02), (0.1, 0.015), (0.28, 0.012))]
    raw: dict[str, Any] = {
        "title": "Arm cut from plate",
        "points": {"A": [0, 0], "B": [0.28, 0], "M": [0.06, 0.0218], "N": [0.2, 0]},
        "links": {"arm": {"material": "steel", "shape": {
            "kind": "extrusion", "outline": outline, "holes": holes, "thickness": 0.006}}},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": "A"}},
        "drive": {"joint": "A", "motion": {"kind": "cycloidal", "angle": "60 deg", "rise": 0.15}},
        "bodies": {"tip": {"kind": "point_mass", "link": "arm", "at": "B", "mass": 1.0}},
        "damping": {"ratio": 0.02, "frequencies": [50, 500]},
    }  # fmt: skip
    on = {"stress": ("arm", "M", "stress"), "tip": ("arm", "N", "displacement")}
    return _asking(raw, accuracy, {"end_time": 0.2}, on)


MECHANISMS: dict[str, Callable[[float], Scene]] = {
    "four-bar of plates": plates,
    "four-bar of bars": bars,
    "slider-crank": slider_crank,
    "swung arm": arm,
    "arm cut from plate": extrusion,
}


def _asking(raw: dict[str, Any], accuracy: float, analysis: dict[str, Any], on: dict[str, Any]) -> Scene:
    """The scene with an accuracy and its probes; those given by a point only are the four-bars'."""
    usual = {"stress": ("rocker", "M", "stress"), "middle": ("coupler", "N", "displacement")}
    probes = {name: usual[name] if isinstance(place, str) else place for name, place in on.items()}
    raw["output"] = {
        "probes": {name: {"link": link, "at": at, "quantity": quantity} for name, (link, at, quantity) in probes.items()}
    }
    raw["analysis"] = {**analysis, "accuracy": accuracy, "frames": "rigid-body"}  # as the reference has them
    raw.setdefault("damping", {"ratio": 0.02, "frequencies": [20, 200]})
    return scene_from(raw)
