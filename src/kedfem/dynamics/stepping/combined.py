"""States of several extrapolation levels combined, at the times that all levels have."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.frames import mean_rotations, position
from kedfem.dynamics.history import Block, LinkHistory, multipliers_together
from kedfem.dynamics.joints.ports import rotated_vectors
from kedfem.dynamics.model import Model
from kedfem.motion.rigid import RigidMotion

SIXTH = 0.5  # least ρ∞ at which h⁴ is removed before h³ (docs/performance/levels.md)


def level_weights(levels: int, rho_inf: float) -> Float[np.ndarray, " l"]:
    """Factors of the levels' states in the combined one, coarsest first; their sum is 1."""
    if levels == 1:
        return np.ones(1)
    two = np.array([-1.0, 4.0]) / 3
    if levels == 2:
        return two
    r = 16.0 if rho_inf >= SIXTH else 8.0
    return np.asarray((r * np.append(0.0, two) - np.append(two, 0.0)) / (r - 1))


LINEAR = ("u", "v", "a", "g", "F", "port_forces", "strain")
Fields = dict[str, Any]


@dataclass
class Combination:
    """States of all levels, at the same times, as one; and the finest level's, corrected."""

    model: Model
    weights: Float[np.ndarray, " l"]
    corrections: list[Fields] = field(default_factory=list)

    def blocks(self, first: int, taken: Sequence[Block], strides: Sequence[int], fine: bool) -> Iterator[Block]:
        """Of a span of time: all time points of the finest level, if these are wanted; then those of all levels."""
        levels = tuple(
            replace(block.chosen(slice(stride - 1, None, stride)), step=first)
            for block, stride in zip(taken, strides, strict=True)
        )
        motion, every = levels[0].motion, range(len(self.model.links))
        seen = [[_fields(self.model, k, block) for k in every] for block in levels]
        combined = [
            {name: sum(w * each[k][name] for w, each in zip(self.weights, seen, strict=True)) for name in LINEAR}
            for k in every
        ]
        if fine:
            now = [{n: x[n] - y[n] for n in LINEAR} for x, y in zip(combined, seen[-1], strict=True)]
            yield self._fine(taken[-1], strides[-1], now)
            self.corrections = [{name: x[-1:] for name, x in each.items()} for each in now]
        multipliers = multipliers_together([x.multipliers for x in levels], self._weighted)
        links = [self._history(k, x, motion) for k, x in enumerate(combined)]
        yield Block(first, motion, links, levels, multipliers=multipliers)

    def _weighted(self, parts: list[np.ndarray]) -> Float[np.ndarray, "..."]:
        """The levels' values as one."""
        return np.asarray(sum(w * x for w, x in zip(self.weights, parts, strict=True)))

    def _fine(self, finest: Block, stride: int, now: Sequence[Fields]) -> Block:
        """The finest level's time points; corrections are linear in time between common ones."""
        before = self.corrections or [{name: x[:1] for name, x in each.items()} for each in now]
        point, share = np.divmod(1 + np.arange(len(finest)), stride)
        after, links = np.minimum(point + 1, len(finest) // stride), []
        for k, (then, later) in enumerate(zip(before, now, strict=True)):
            own = _fields(self.model, k, finest)
            for name in LINEAR:
                x = np.concatenate([then[name], later[name]])
                s = (share / stride).reshape(-1, *[1] * (x.ndim - 1))
                own[name] = own[name] + (1 - s) * x[point] + s * x[after]
            links.append(self._history(k, own, finest.motion))
        return Block(finest.step, finest.motion, links, fine=True, multipliers=finest.multipliers)

    def _history(self, k: int, x: Fields, motion: RigidMotion) -> LinkHistory:
        """A link's combined state: its frame where its positions now are, energy of its deformation now."""
        link, joint = self.model.links[k], self.model.joints[k]
        R = motion.R[:, self.model.bodies[k], : link.d, : link.d]
        if link.fit is None:
            Kg = (link.K0 @ x["g"].reshape(len(R), -1).T).T
            strain = 0.5 * (x["g"].reshape(len(R), -1) * Kg).sum(axis=1)
            return LinkHistory(**{**x, "strain": strain}, R=R)
        R = R @ mean_rotations(link, link.fit, position(link, x["u"] @ R))
        forces = (x["port_forces"] @ R).reshape(len(R), -1)[:, joint.keep]
        return LinkHistory(**{**x, "port_forces": forces}, R=R)


def _fields(model: Model, k: int, block: Block) -> Fields:
    """The combined fields of a link's states; its port forces in world components with a co-rotational frame."""
    link, history = model.links[k], block.links[k]
    out = {name: getattr(history, name) for name in LINEAR}
    if link.fit is not None:
        out["port_forces"] = rotated_vectors(model.joints[k], history.R, history.port_forces)
    return out
