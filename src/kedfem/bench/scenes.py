"""Fixed scenes of the benchmarks: a four-bar of three bars, 25.4 mm square, lengths of the source's example."""

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
    links: dict[str, Any] = {
        name: {
            "material": "alloy",
            "shape": {"kind": "bar", "between": list(ends), "width": 0.0254, "thickness": 0.0254},
            "mesh": {"elements": list(elements)},
        }
        for name, ends in LENGTHS.items()
    }
    joined = {
        "A": ("ground", "crank"),
        "B": ("crank", "coupler"),
        "C": ("coupler", "rocker"),
        "D": ("rocker", "ground"),
    }
    return scene_from(
        {
            "title": "Four-bar of bars",
            "points": {
                "A": [0, 0],
                "D": [0.9144, 0],
                "B": {"from": "A", "distance": 0.3048, "angle": "60 deg"},
                "C": {"from": ["B", "D"], "distances": [0.9144, 0.762], "side": "left"},
            },
            "materials": {"alloy": {"density": 2796, "youngs_modulus": 7.031e10, "shear_modulus": 2.712e10}},
            "links": links,
            "joints": {
                key: {"kind": "revolute", "links": list(pair), "at": key} for key, pair in joined.items()
            },
            "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": "600 rpm"}},
            "bodies": {"flywheel": {"kind": "flywheel", "link": "rocker", "at": "D", "inertia": 8.065e-2}},
            "analysis": {"turns": turns, "steps_per_turn": steps_per_turn, "solver": solver},
        }
    )
