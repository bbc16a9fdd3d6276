"""Runs of scenes in memory, for tests: all time points of all segments, positions, energies, momenta."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.dynamics.history import Block
from kedfem.dynamics.joints.places import on_part
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.links.point_rows import point_rows
from kedfem.links.record import in_space, mass_times
from kedfem.results.recording import recording
from kedfem.scene import scene_from


@dataclass(frozen=True, slots=True)
class Ran:
    """A scene that was run: what was prepared, its solver, all blocks."""

    ready: Prepared
    solver: Any
    blocks: list[Block]

    @property
    def t(self) -> np.ndarray:
        return np.concatenate([block.motion.t for block in self.blocks])

    @property
    def iterations(self) -> float:
        """Mean number of iterations a step."""
        return float(self.solver.iterations) / (len(self.t) - 1)

    def state(self, k: int, name: str) -> np.ndarray:
        """u, v, a, g, strain, port_forces … of a segment over time."""
        return np.concatenate([getattr(block.links[k], name) for block in self.blocks])

    def position(self, link: str, at: Any, name: str = "u") -> np.ndarray:
        """Where a point of a link is, (T, 3); or its elastic displacement, with `displaced`."""
        return self.rigid_motion(link, at) + self.displaced(link, at, name)

    def displaced(self, link: str, at: Any, name: str = "u") -> np.ndarray:
        """Displacement from the rigid-body motion (T, 3), or its rates."""
        links = dict(enumerate(self.ready.model.links))
        k, weights = on_part(links, link, point(at), lambda part: point_rows(part, link, point(at)).value)
        part = links[k]
        return in_space(part, np.einsum("n,tnd->td", weights, self.state(k, name)))

    def rigid_motion(self, link: str, at: Any) -> np.ndarray:
        body = self.ready.linkage.bodies.index(link)
        return np.concatenate([b.motion.p[:, body] + b.motion.R[:, body] @ point(at) for b in self.blocks])

    def channel(self, name: str) -> np.ndarray:
        rows = {each.channel.name: each.rows for each in recording(self.ready.scene, self.ready.model)}[name]
        return np.concatenate([rows(block) for block in self.blocks])

    @property
    def strain_energy(self) -> np.ndarray:
        return np.sum([self.state(k, "strain") for k in range(len(self.ready.model.links))], axis=0)

    @property
    def kinetic_energy(self) -> np.ndarray:
        """Of scenes without a drive, whose rigid-body motion rests."""
        out = np.zeros(len(self.t))
        for k, link in enumerate(self.ready.model.links):
            out += [0.5 * float(np.vdot(v, mass_times(link.mass, v))) for v in self.state(k, "v")]
        return out

    @property
    def momentum(self) -> np.ndarray:
        """Linear (T, 3) and angular about the origin (T, 3), of scenes without a drive."""
        out = np.zeros((len(self.t), 6))
        for k, link in enumerate(self.ready.model.links):
            X = link.X[:, : min(link.d, 3)]
            X = X * [1, 1, 0] if link.kind == "beam" else X
            for row, u, v in zip(out, self.state(k, "u"), self.state(k, "v"), strict=True):
                p = mass_times(link.mass, v)
                flat = in_space(link, p)
                row[:3] += link.one @ flat
                row[3:] += np.cross(in_space(link, X + u), flat).sum(axis=0)
                if link.kind == "beam":
                    row[5] += link.one @ p[:, 2]
        return out


def point(at: Any) -> np.ndarray:
    return np.concatenate([np.asarray(at, float), np.zeros(3 - len(at))])


def ran(raw: dict[str, Any]) -> Ran:
    """All time points of a scene."""
    scene = scene_from(raw)
    ready = meshed(scene)
    model = ready.model
    solver: Any = steps_of(scene, model)
    return Ran(ready, solver, list(transient(scene, ready.linkage, ready.path, model, solver)))


def quick(raw: dict[str, Any]) -> dict[str, Any]:
    """A raw scene that leaves nothing to be chosen: plain defaults, for tests of something else than accuracy."""
    return {**raw, "analysis": {**raw.get("analysis", {}), "accuracy": "quick"}}
