"""Pins of slots on lines of bent and rotated links: their positions, and the forces of a unit multiplier there.

The formulas are those of `measures_kernel`, for many times at once.
"""

from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.system.ends import line_of
from kedfem.dynamics.system.record import ARC, CLOSE, FEET, TURNED, End, Term
from kedfem.links.stations import Stations
from kedfem.motion.rigid import RigidMotion

Vectors = Float[np.ndarray, "T 3"]


@dataclass(frozen=True, slots=True)
class OnLine:
    """A pin x on or beside its line, over time.

    s : (T,) its place [m]; c, tangent : (T, 3) of the line there
    force : (T, 3) on the pin, its negative on the line; slope : (T, 3) what the line's slopes bear [m]
    """

    s: Float[np.ndarray, " T"]
    c: Vectors
    tangent: Vectors
    force: Vectors
    slope: Vectors

    def at_stations(self, along: Stations) -> Float[np.ndarray, "T p 3"]:
        """Forces at the stations of the line."""
        N, N1 = along.at(self.s)[:, :, None], along.at(self.s, 1)[:, :, None]
        return np.asarray(N1 * self.slope[:, None] - N * self.force[:, None])


def on_line(term: Term, x: Vectors, end: End, motion: RigidMotion, z: Float[np.ndarray, "T k"]) -> OnLine:
    """What a unit multiplier of an OFFSET or an ARC does to a pin at x and the line of an end."""
    line, R = line_of(end), motion.R[:, end.body]
    X = stationed(end, R, motion.p[:, end.body], z)
    s = feet(line.stations, X, x)
    c, t, bend = (np.einsum("tp,tpm->tm", line.stations.at(s, k), X) for k in range(3))
    size, away, beside = _dot(t, t), x - c, R @ term.b
    if term.kind == ARC:
        steep = size - _dot(bend, away)
        return OnLine(s, c, t, t / steep, away / steep)
    h = R @ line.axis + t / np.sqrt(size)
    twice = _dot(h, h)
    share = np.where(twice > TURNED, 1 / np.maximum(twice, TURNED), 0.0)
    on_b, on_d = _dot(h, beside), _dot(h, away)
    g = (4 * on_b * on_d * share * h - 2 * (beside * on_d + away * on_b)) * share
    q = (g - _dot(g, t) / size * t) / np.sqrt(size)
    kappa = _dot(q, bend) / (size - _dot(bend, away))
    return OnLine(s, c, t, beside - 2 * on_b * share * h + kappa * t, q + kappa * away)


def stationed(
    end: End, R: Float[np.ndarray, "T 3 3"], p: Vectors, z: Float[np.ndarray, "T k"]
) -> Float[np.ndarray, "T p 3"]:
    """Where the stations of an end's line are, or their series in time.

    Parameters
    ----------
    R, p : of the line's body
    """
    X = p[:, None] + line_of(end).stations.points @ R.transpose(0, 2, 1)
    X[:, :, : end.onto.shape[1]] += np.einsum("pdc,tc->tpd", end.onto, z[:, end.columns])
    return np.asarray(X)


def feet(along: Stations, X: Float[np.ndarray, "T p 3"], x: Vectors) -> Float[np.ndarray, " T"]:
    """Places on lines through stations X at which points x stand square to them, from their nearest stations on [m]."""
    s = along.s[np.linalg.norm(X - x[:, None], axis=2).argmin(axis=1)]
    for _ in range(FEET):
        c, tangent, bend = (np.einsum("tp,tpm->tm", along.at(s, k), X) for k in range(3))
        size = _dot(tangent, tangent)[:, 0]
        steep = size - _dot(bend, x - c)[:, 0]
        change = _dot(tangent, x - c)[:, 0] / np.where(steep > 0, steep, size)
        s = s + change
        if (np.abs(change) <= CLOSE * np.ptp(along.s)).all():
            break
    return np.asarray(s)


def _dot(a: Vectors, b: Vectors) -> Float[np.ndarray, "T 1"]:
    return np.asarray((a * b).sum(axis=1)[:, None])
