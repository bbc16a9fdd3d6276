"""A scene that grows by links and joints drawn at random, in the plane or in space."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tests.partners import joint, partner

Raw = dict[str, Any]
Vector = np.ndarray
FREEDOMS = {
    "weld": 0, "revolute": 1, "prismatic": 1, "screw": 1, "universal": 2, "cylindrical": 2, "spherical": 3, "planar": 3,
    "slot": 4,
}  # fmt: skip
FREEDOMS_IN_PLANE = {"weld": 0, "revolute": 1, "prismatic": 1, "slot": 2}
SPATIAL = {"beam": 0.6, "solid": 0.07, "reduced": 0.08, "rigid": 0.25}
PLANAR = {"planar beam": 0.6, "plane": 0.25, "rigid": 0.15}


@dataclass
class Drawing:
    """A scene that grows.

    places : of each body where further joints may sit
    """

    random: np.random.Generator
    plane: bool
    frames: str = "rigid-body"
    links: Raw = field(default_factory=dict)
    joints: Raw = field(default_factory=dict)
    drives: Raw = field(default_factory=dict)
    gears: Raw = field(default_factory=dict)
    places: dict[str, list[Vector]] = field(default_factory=lambda: {"ground": [np.zeros(3)]})
    kinds: dict[str, str] = field(default_factory=dict)

    def chance(self, p: float) -> bool:
        return bool(self.random.random() < p)

    def one(self, of: Any) -> Any:
        return of[int(self.random.integers(len(of)))]

    @property
    def flat(self) -> Vector:
        return np.array([1.0, 1.0, 0.0 if self.plane else 1.0])

    def vector(self) -> Vector:
        """A direction at random."""
        d = self.random.normal(size=3) * self.flat
        return np.asarray(d / np.linalg.norm(d))

    def away(self, a: Vector) -> Vector:
        """Another place at the distance of a link."""
        return np.asarray(a + self.vector() * self.random.uniform(0.09, 0.2))

    def link(self, a: Vector, b: Vector, kind: str | None = None, along: int = 1) -> str:
        """A link from one place to another."""
        name, choices = f"link{len(self.links)}", PLANAR if self.plane else SPATIAL
        kind = kind or str(self.random.choice(list(choices), p=list(choices.values())))
        up = [0.0, 0.0, 1.0] if self.plane else self.upright(b - a).tolist()
        made = partner(kind, a.tolist(), b.tolist(), up)
        if "mesh" in made:
            counts = made["mesh"]["elements"]
            made["mesh"] = {"elements": along if isinstance(counts, int) else [along] + [1] * (len(counts) - 1)}
        if made.get("reduction", "none") != "none":
            made["reduction"] = 6
        self.links[name], self.kinds[name] = made, kind
        self.places[name] = [a, b]
        return name

    def upright(self, d: Vector) -> Vector:
        """A direction across another."""
        n = np.cross(d, self.vector())
        return np.asarray(n / np.linalg.norm(n))

    def axis(self, kind: str, one: Vector, two: Vector) -> Vector:
        """Of a joint between links along two directions: in the faces of both."""
        if self.plane:
            return np.cross([0.0, 0.0, 1.0], one) if kind == "prismatic" else np.array([0.0, 0.0, 1.0])
        return np.cross(one, two) if kind == "revolute" else self.vector()

    def join(self, kind: str, pair: tuple[str, str], at: Vector, axis: Vector) -> str:
        name = f"J{len(self.joints)}"
        made = joint(kind, pair, at, axis)
        made = {key: np.asarray(x).tolist() if key in {"at", "axis", "axes"} else x for key, x in made.items()}
        if kind == "screw":
            made["lead"] = float(self.random.uniform(0.05, 0.5) * self.one((1, -1)))
        self.joints[name] = made
        return name

    def along(self, body: str) -> Vector:
        """The direction of a link; of the ground any."""
        if body == "ground":
            return self.vector()
        a, b = self.places[body][:2]
        return b - a

    def parent(self) -> tuple[str, Vector]:
        """A body with one of its ends."""
        body = self.one(list(self.places))
        return body, self.one(self.places[body])
