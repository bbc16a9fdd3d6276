"""The stock of small scenes: a bar on a hinge of the ground, four-bars; dictionaries that tests read and change.

For linkages of which the rigid motion alone counts see `linkages`, for joints in space `spatial_joints`.
"""

import tomllib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

EXAMPLES = Path(__file__).parents[1] / "examples"
Raw = dict[str, Any]


def material(density: float, youngs_modulus: float, poisson_ratio: float = 0.3) -> Raw:
    return {"density": density, "youngs_modulus": youngs_modulus, "poisson_ratio": poisson_ratio}


def bar(length: float = 0.5, width: float = 0.02, thickness: float = 0.02, **link: Any) -> Raw:
    """A link of steel along x from the origin, with further keys of the link."""
    shape = {"kind": "bar", "between": [[0, 0], [length, 0]], "width": width, "thickness": thickness}
    return {"material": "steel", "shape": shape, **link}


def constant_speed(speed: Any) -> Raw:
    return {"kind": "constant_speed", "speed": speed}


def cycloidal(angle: float, rise: float) -> Raw:
    """From rest by an angle to rest, within `rise` seconds."""
    return {"kind": "cycloidal", "angle": angle, "rise": rise}


def arm(link: Mapping[str, Any], motion: Mapping[str, Any] | None, **sections: Any) -> Raw:
    """One link, "arm", hinged to the ground at the origin, driven there unless the motion is None."""
    drive = {} if motion is None else {"drive": {"joint": "A", "motion": dict(motion)}}
    hinge = {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]}
    return {"links": {"arm": dict(link)}, "joints": {"A": hinge}, **drive, **sections}


def four_bar(
    lengths: tuple[float, float, float, float], link: Mapping[str, Any], motion: Mapping[str, Any], **sections: Any
) -> Raw:
    """Crank, coupler, rocker and frame [m] from A to D, the crank drawn at 60°; `link` with a shape less its ends."""
    crank, coupler, rocker, frame = lengths
    ends = {"crank": ["A", "B"], "coupler": ["B", "C"], "rocker": ["C", "D"]}
    pairs = {"A": ["ground", "crank"], "B": ["crank", "coupler"], "C": ["coupler", "rocker"], "D": ["rocker", "ground"]}
    return {
        "points": {
            "A": [0, 0], "D": [frame, 0],
            "B": {"from": "A", "distance": crank, "angle": "60 deg"},
            "C": {"from": ["B", "D"], "distances": [coupler, rocker], "side": "left"},
        },
        "links": {name: {**link, "shape": {**link["shape"], "between": ab}} for name, ab in ends.items()},
        "joints": {name: {"kind": "revolute", "links": pair, "at": name} for name, pair in pairs.items()},
        "drive": {"joint": "A", "motion": dict(motion)},
        **sections,
    }  # fmt: skip


def example(name: str) -> Raw:
    """The scene of an example."""
    return tomllib.loads((EXAMPLES / name / "scene.toml").read_text(encoding="utf-8"))
