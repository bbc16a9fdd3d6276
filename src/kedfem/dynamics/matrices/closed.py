"""Solutions for the linkage with closed joints, by the common system of the interface unknowns of all links."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, cast

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.joints.constraint_matrices import ConstraintMatrices
from kedfem.dynamics.matrices.profile import Profile, profile_of
from kedfem.dynamics.matrices.substructure import Substructure
from kedfem.dynamics.system.arrays import Bodies, Constraints, ends_of, flat, groups, reach
from kedfem.dynamics.system.state import Trial
from kedfem.errors import SolveError

Loads = Sequence[Float[np.ndarray, "T n_ d_"]]


@dataclass(frozen=True, slots=True)
class Closed:
    """A linkage with its joints closed where its links have some orientations at T times, for any loads.

    bodies, of : links and constraint equations as steps take them, what is at rest of them
    R : (T, links, 3, 3), link to world
    C, compliance : (T, n) gradients of constraints and springs, (r,) 1/κ
    """

    parts: Sequence[Substructure]
    bodies: Bodies
    of: Constraints
    R: Float[np.ndarray, "T l 3 3"]
    C: Float[np.ndarray, "T n"]
    compliance: Float[np.ndarray, " r"]

    def forces(self, loads: Loads) -> list[Float[np.ndarray, "T _"]]:
        """[λ; μ] on all links at their ports and anchors, link frames, from loads there.

        Raises
        ------
        SolveError
            If something is free to move.
        """
        from kedfem.dynamics.matrices.closed_kernel import closed_over
        from kedfem.dynamics.system.reference import RecordAddress

        v = np.concatenate([x.reshape(len(x), -1) @ part.Y for x, part in zip(loads, self.parts, strict=True)], axis=1)
        out, records = np.empty_like(v), [RecordAddress(x) for x in (self.bodies, self.of, _room(self.bodies, self.of))]
        closed_over(*records, self.R, self.C, self.compliance, v, out)
        if not np.isfinite(out).all():
            raise SolveError("joints: the joints' common system must be definite, got one that lets links move freely")
        return np.split(out, self.bodies.port_at[1:-1], axis=1)

    def deflections(self, loads: Loads) -> Loads:
        """g of all links; all times go together."""
        every = zip(self.parts, loads, self.forces(loads), strict=True)
        return [
            (part.solve_many(x.reshape(len(x), -1).T) + part.Y @ force.T).T.reshape(x.shape) for part, x, force in every
        ]


def closed(parts: Sequence[Substructure], R: Sequence[Float[np.ndarray, "T _ _"]], rows: ConstraintMatrices) -> Closed:
    """A linkage with its joints closed: A g = r + Wᵀ λ, R W g = B z, and joint forces in balance, Σ Bᵀ R λ = 0.

    The mechanism of [KED, eq. (19)]: joints make shared points move together.

    Parameters
    ----------
    R : per link, link to world
    rows : constraint equations, springs of bushings among them, on z; then Σ Bᵀ R λ is what these exert
    """
    joints = [part.attachment for part in parts]
    coupled = [rows.columns[first:last] for first, last in pairwise(rows.row_at)]
    made = profile_of([joint.columns for joint in joints], coupled, rows.unknowns)
    order = [first + np.argsort(made.number[c]) for first, c in zip(rows.row_at[:-1], coupled, strict=True)]
    of = _with(
        Constraints,
        linear=np.ones(len(coupled), bool),
        place=made.constraint,
        column_at=rows.row_at,
        columns=flat(made.columns, int),
    )
    frames = np.zeros((len(R[0]), len(parts), 3, 3))
    for k, each in enumerate(R):
        frames[:, k, : each.shape[1], : each.shape[2]] = each
    C = np.ascontiguousarray(rows.entries[:, flat(order, int)])
    return Closed(parts, _bodies(parts, made), of, frames, C, 1 / rows.stiffness)


def _bodies(parts: Sequence[Substructure], made: Profile) -> Bodies:
    """Data of links for the interface, in which each anchor is a separate point."""
    joints, sizes = [part.attachment for part in parts], [len(part.S) for part in parts]
    B, component, port = [], [], []
    for joint, q in zip(joints, sizes, strict=True):
        free = q - len(joint.keep)
        B.append(np.pad(joint.B, ((0, free), (0, 0))))
        component.append(np.pad(joint.keep % joint.components, (0, free)))
        port.append(np.append(joint.keep // joint.components, len(joint.weights) + np.arange(free)))
    return cast("Bodies", _with(
        Bodies, motion=np.arange(len(parts)), port_at=ends_of(sizes), component=flat(component, int), group=groups(port),
        S_at=ends_of([part.S.size for part in parts]), S=flat([part.S for part in parts]),
        B_at=ends_of([each.size for each in B]), B=flat(B), column_at=ends_of([len(joint.columns) for joint in joints]),
        columns=flat([made.number[joint.columns] for joint in joints], int), reach=reach(B, port), place=made.unknown,
        first=made.first, row_at=made.at, multiplier=made.multiplier,
    ))  # fmt: skip


def _room(bodies: Bodies, of: Constraints) -> Trial:
    """Arrays that the compiled loop works in."""
    k, r = len(bodies.place), len(of.place)
    q, B, size = (int(x[-1]) for x in (bodies.port_at, bodies.B_at, bodies.row_at))
    sizes = {"reaction": q, "w": q, "force": q, "RB": B, "SRB": B, "H": size, "K": size, "inverse": k + r, "x": k + r,
             "C": len(of.columns), "target": r, "compliance": r, "beside": r, "m": r, "right": k, "dz": k,
             "known": int(np.diff(bodies.column_at).max(initial=0))}  # fmt: skip
    room = {name: np.zeros(n) for name, n in sizes.items()}
    return cast("Trial", _with(Trial, Rp=np.zeros((len(bodies.motion), 3, 3)), **room))


def _with(record: Any, **fields: Any) -> Any:
    """A record with nothing else in it."""
    return record(**(dict.fromkeys(record._fields) | fields))
