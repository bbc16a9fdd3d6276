"""Fixed scenes of the benchmarks: four-bars of bars and of plates with bores, lengths of the source's example."""

from typing import Any

from kedfem.scene import Scene, scene_from

LENGTHS = {"crank": ("A", "B"), "coupler": ("B", "C"), "rocker": ("C", "D")}


def bar_four_bar(
    elements: tuple[int, int, int], solver: str = "condensed", steps_per_turn: int = 720, turns: float = 1.0
) -> Scene:
    """[KED]'s four-bar (Nath and Ghosh 1980) with bars of 27-node hexahedra, 600 rpm.

    Parameters
    ----------
    elements : of each bar: along, across, through the thickness
    """
    bar = {"kind": "bar", "width": 0.0254, "thickness": 0.0254}
    raw = four_bar_of(bar, {"element": "hex27", "mesh": {"elements": list(elements)}})
    raw["analysis"] = {"turns": turns, "steps_per_turn": steps_per_turn, "solver": solver}
    return scene_from(raw)


def plate_four_bar(fidelity: str, across: int, thickness: float, steps_per_turn: int = 360) -> Scene:
    """The same with bores in eyes of 45 mm, quasi-static at 150 rpm; stress at the rocker, displacement of the coupler.

    Parameters
    ----------
    fidelity : solid (one layer of hexahedra) or plane, on the same quadrilaterals
    across : elements across the waist
    """
    plate = {
        "kind": "plate_link",
        "width": 0.0254,
        "thickness": thickness,
        "eye_diameter": 0.045,
        "bore_diameter": 0.02,
    }
    element = {"solid": "hex27", "plane": "quad9"}[fidelity]
    raw = four_bar_of(plate, {"fidelity": fidelity, "element": element, "mesh": {"elements_across": across}})
    raw["drive"]["motion"]["speed"] = "150 rpm"
    raw["damping"] = {"ratio": 0.02, "frequencies": [20, 200]}
    raw["analysis"] = {"turns": 1, "steps_per_turn": steps_per_turn, "initial": "quasi-static"}
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
        name: {"material": "alloy", "shape": {**shape, "between": list(ends)}, **link}
        for name, ends in LENGTHS.items()
    }
    joined = {
        "A": ("ground", "crank"),
        "B": ("crank", "coupler"),
        "C": ("coupler", "rocker"),
        "D": ("rocker", "ground"),
    }
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
