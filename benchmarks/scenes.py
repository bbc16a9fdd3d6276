"""Fixed scenes of the benchmarks: four-bars, lengths of the source's example; a slider-crank, an RSSR, a bell crank."""

from typing import Any

import numpy as np

from kedfem.scene import Scene, scene_from

LENGTHS = {"crank": ("A", "B"), "coupler": ("B", "C"), "rocker": ("C", "D")}


def bar_four_bar(
    elements: tuple[int, int, int], solver: str = "condensed", steps_per_revolution: int = 720, revolutions: float = 1.0
) -> Scene:
    """[KED]'s four-bar (Nath and Ghosh 1980) with bars of 27-node hexahedra, 600 rpm.

    Parameters
    ----------
    elements : of each bar: along, across, through the thickness
    """
    bar = {"kind": "bar", "width": 0.0254, "thickness": 0.0254}
    raw = four_bar_of(bar, {"element": "hex27", "mesh": {"elements": list(elements)}})
    raw["analysis"] = {"revolutions": revolutions, "steps_per_revolution": steps_per_revolution, "solver": solver}
    return scene_from(raw)


def ten_turns(folder: str) -> Scene:
    """The plates of `plate_four_bar`, 25.4 mm thick, reduced to 1 %: ten revolutions of 1,000 steps, time series only."""
    raw = plate_four_bar("solid", 2, 0.0254).model_dump(mode="json", exclude_unset=True)
    for link in raw["links"].values():
        link |= {"reduction": "modal", "element": "hex20"}
    raw["analysis"] |= {"revolutions": 10, "steps_per_revolution": 1000, "reduction_tolerance": 0.01}
    raw["output"] |= {"folder": folder, "animation": False, "plots": False, "picture": False}
    return scene_from(raw)


def plate_four_bar(model: str, across: int, thickness: float, steps_per_revolution: int = 360) -> Scene:
    """The same with bores in eyes of 45 mm, quasi-static at 150 rpm; stress at the rocker, displacement of the coupler.

    Parameters
    ----------
    model : solid (one layer of hexahedra) or plane, on the same quadrilaterals
    across : elements across the waist
    """
    plate = {"kind": "plate_link", "width": 0.0254, "thickness": thickness, "eye_diameter": 0.045, "bore_diameter": 0.02}
    element = {"solid": "hex27", "plane": "quad9"}[model]
    raw = four_bar_of(plate, {"model": model, "element": element, "mesh": {"elements_across": across}})
    raw["drive"]["motion"]["speed"] = "150 rpm"
    raw["damping"] = {"ratio": 0.02, "frequencies": [20, 200]}
    raw["analysis"] = {"revolutions": 1, "steps_per_revolution": steps_per_revolution, "initial": "quasi-static"}
    raw["output"] = {
        "probes": {
            "stress": {"link": "rocker", "at": "M", "quantity": "stress"},
            "displacement": {"link": "coupler", "at": "N", "quantity": "displacement"},
        }
    }
    return scene_from(raw)


def four_bar_of(shape: dict[str, Any], link: dict[str, Any]) -> dict[str, Any]:
    """The tables of a four-bar whose links have one shape."""
    links = {
        name: {"material": "alloy", "shape": {**shape, "between": list(ends)}, **link} for name, ends in LENGTHS.items()
    }
    joined = {"A": ("ground", "crank"), "B": ("crank", "coupler"), "C": ("coupler", "rocker"), "D": ("rocker", "ground")}
    return {
        "title": "Four-bar",
        "points": {
            "A": [0, 0],
            "D": [0.9144, 0],
            "B": {"from": "A", "distance": 0.3048, "angle": "60 deg"},
            "C": {"from": ["B", "D"], "distances": [0.9144, 0.762], "side": "left"},
            "M": {"between": ["C", "D"], "fraction": 0.5, "offset": 0.0127},
            "N": {"between": ["B", "C"], "fraction": 0.5},
        },
        "materials": {"alloy": {"density": 2796, "youngs_modulus": 7.031e10, "shear_modulus": 2.712e10}},
        "links": links,
        "joints": {key: {"kind": "revolute", "links": list(pair), "at": key} for key, pair in joined.items()},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": "600 rpm"}},
        "bodies": {"flywheel": {"kind": "flywheel", "link": "rocker", "at": "D", "inertia": 8.065e-2}},
    }


EYE = {"eye_diameter": 0.045, "bore_diameter": 0.02, "width": 0.0254, "thickness": 0.0254}
TURN = {"revolutions": 1, "steps_per_revolution": 720, "initial": "quasi-static"}
DAMPED = {"ratio": 0.02, "frequencies": [20, 200]}


def mechanisms() -> dict[str, dict[str, Any]]:
    """Scenes of one turn in 720 steps, as the keys of a file: planar and spatial, beams, bars, plates, an extrusion."""
    beam = four_bar_of({"kind": "bar", "width": 0.0254, "thickness": 0.0254}, {"model": "beam"})
    plate = four_bar_of({"kind": "plate_link", **EYE}, {})
    plate["drive"]["motion"]["speed"] = "150 rpm"
    for four_bar in (beam, plate):
        four_bar["output"] = _probe("rocker", "M", "stress")
    found = {"beam four-bar": beam, "solid four-bar": plate, "slider-crank": _slider_crank(), "RSSR": _rssr(),
             "bell crank": _bell_crank()}  # fmt: skip
    return {name: {**raw, "damping": DAMPED, "analysis": TURN} for name, raw in found.items()}


def with_reduced_links(raw: dict[str, Any]) -> dict[str, Any]:
    """The same with all elastic links reduced."""
    links = {
        name: link if link.get("model") == "rigid" else {**link, "reduction": "modal"}
        for name, link in raw["links"].items()
    }
    return {**raw, "links": links}


def _probe(link: str, at: str, quantity: str) -> dict[str, Any]:
    return {"probes": {"probe": {"link": link, "at": at, "quantity": quantity}}}


def _turning(kind: str, links: tuple[str, str], at: str, axis: Any = "z") -> dict[str, Any]:
    return {"kind": kind, "links": list(links), "at": at, **({} if kind == "spherical" else {"axis": axis})}


def _slider_crank() -> dict[str, Any]:
    """Crank and rod of plates, a rigid piston of 0.4 kg."""
    rod = {"kind": "plate_link", **EYE, "thickness": 0.018}
    return {
        "points": {
            "A": [0, 0],
            "B": {"from": "A", "distance": 0.08, "angle": "90 deg"},
            "C": {"from": "B", "distance": 0.24, "along": ["A", [1, 0]]},
            "N": {"between": ["B", "C"], "fraction": 0.5},
        },
        "links": {
            "crank": {"material": "steel", "shape": {**rod, "between": ["A", "B"]}},
            "rod": {"material": "steel", "shape": {**rod, "between": ["B", "C"]}},
            "piston": {"model": "rigid", "mass": 0.4},
        },
        "joints": {
            "A": _turning("revolute", ("ground", "crank"), "A"),
            "B": _turning("revolute", ("crank", "rod"), "B"),
            "C": _turning("revolute", ("rod", "piston"), "C"),
            "guide": _turning("prismatic", ("ground", "piston"), "C", "x"),
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": "1200 rpm"}},
        "output": _probe("rod", "N", "displacement"),
    }


def _rssr() -> dict[str, Any]:
    """Bars in space: hinge, ball, universal joint (a rigid cross), hinge."""
    P, D, psi = np.array([0.1, 0.0, 0.0]), np.array([0.3, -0.1, 0.25]), 1.2
    Q = D + 0.25 * np.array([0.0, np.cos(psi), np.sin(psi)])
    along = (Q - P) / np.linalg.norm(Q - P)
    across = np.cross(along, D - Q)
    places = {"A": np.zeros(3), "B": P, "C": Q, "D": D, "X": Q + 0.02 * along, "N": (P + Q) / 2}
    ends = {"crank": "AB", "coupler": "BC", "rocker": "CD", "cross": "CX"}
    bar = {"kind": "bar", "width": 0.012, "thickness": 0.012}
    links: dict[str, Any] = {
        name: {"material": "steel", "shape": {**bar, "between": list(pair)}} for name, pair in ends.items()
    }
    links["cross"]["model"] = "rigid"
    return {
        "points": {name: place.tolist() for name, place in places.items()},
        "links": links,
        "joints": {
            "A": _turning("revolute", ("ground", "crank"), "A"),
            "B": _turning("spherical", ("crank", "coupler"), "B"),
            "C1": _turning("revolute", ("coupler", "cross"), "C", np.cross(across, along).tolist()),
            "C2": _turning("revolute", ("cross", "rocker"), "C", across.tolist()),
            "D": _turning("revolute", ("rocker", "ground"), "D", "x"),
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": "120 rpm"}},
        "output": _probe("coupler", "N", "displacement"),
    }


def _bell_crank() -> dict[str, Any]:
    """A crank that rocks an extruded bell crank by a rod."""
    rod = {"kind": "plate_link", "width": 0.02, "thickness": 0.012, "eye_diameter": 0.03, "bore_diameter": 0.012}
    bell = {
        "kind": "extrusion",
        "thickness": 0.012,
        "outline": [
            [0.275, 0.005], {"via": [0.3, -0.025], "to": [0.325, 0.005]}, [0.48, -0.015],
            {"via": [0.495, 0], "to": [0.48, 0.015]}, [0.335, 0.035], [0.315, 0.15],
            {"via": [0.3, 0.165], "to": [0.285, 0.15]},
        ],
        "holes": [{"at": at, "diameter": 0.012} for at in ([0.3, 0], [0.48, 0], [0.3, 0.15])],
    }  # fmt: skip
    return {
        "points": {
            "A": [0, 0.12],
            "B": {"from": "A", "distance": 0.03, "angle": "90 deg"},
            "C": [0.3, 0.15],
            "D": [0.3, 0],
            "E": [0.48, 0],
            "F": [0.4, 0],
        },
        "links": {
            "crank": {
                "material": "steel",
                "shape": {**rod, "width": 0.016, "eye_diameter": 0.026, "between": ["A", "B"]},
            },
            "rod": {"material": "steel", "shape": {**rod, "between": ["B", "C"]}},
            "bell": {"material": "aluminium", "shape": bell},
        },
        "joints": {
            "A": _turning("revolute", ("ground", "crank"), "A"),
            "B": _turning("revolute", ("crank", "rod"), "B"),
            "C": _turning("revolute", ("rod", "bell"), "C"),
            "D": _turning("revolute", ("bell", "ground"), "D"),
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": "600 rpm"}},
        "bodies": {"load": {"kind": "point_mass", "link": "bell", "at": "E", "mass": 0.3}},
        "output": _probe("bell", "F", "displacement"),
    }
