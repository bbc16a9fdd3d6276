"""Steps of small segments whose frames follow them: dense constant matrices and one compiled loop."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int
from scipy.sparse.csgraph import reverse_cuthill_mckee

from kedfem.dynamics.acting import acting_on, over_block
from kedfem.dynamics.action import Action
from kedfem.dynamics.coupling import Attachment
from kedfem.dynamics.dense import component_first, coordinates, dense_part, rows_of, work_on, work_over_time
from kedfem.dynamics.held import closed, closure
from kedfem.dynamics.history import Forcing, LinkHistory
from kedfem.dynamics.metric import element_tables, room_for
from kedfem.dynamics.mixing import DEPTH
from kedfem.dynamics.ports import port_vectors
from kedfem.dynamics.scheme import Scheme
from kedfem.dynamics.segment import CONVERGED, NotConverged, first_state, rounding, too_far
from kedfem.dynamics.state import LinkState, Rayleigh
from kedfem.dynamics.substructure import effective_coefficients
from kedfem.links.record import BeamPoint, Link
from kedfem.motion.rigid import RigidMotion

KINDS = {"solid": 0, "spatial_beam": 0, "plane": 1, "beam": 2}
State = tuple[np.ndarray, ...]


class FollowingDense:
    """`FollowingSteps` of small segments; everything constant is made here, once."""

    def __init__(
        self, links: Sequence[Link], joints: Sequence[Attachment], scheme: Scheme, damping: Rayleigh,
        actions: Sequence[Action] = (), tolerance: float = CONVERGED,
    ) -> None:  # fmt: skip
        self.links, self.joints, self.scheme, self.damping, self.actions = (
            links,
            joints,
            scheme,
            damping,
            actions,
        )
        self.tolerance = tolerance
        c_M, c_K = effective_coefficients(scheme, damping)
        self.coefficients = np.array([
            c_M, c_K, scheme.alpha_f, scheme.alpha_m, *scheme.acceleration, scheme.h, scheme.h * scheme.gamma,
            scheme.h * (1 - scheme.gamma), damping.alpha, damping.beta, tolerance,
        ])  # fmt: skip
        self.parts = [dense_part(link, joint, c_M, c_K) for link, joint in zip(links, joints, strict=True)]
        self.factorisations = len(self.parts)
        self._closure = closure(joints, [part.W for part in self.parts])
        self._counts = np.array([0.0, rounding(links), 0.0, 0.0, too_far(links), 0.0])
        self._sizes = (max(link.d for link in links), max(link.n for link in links),
                       max(1, *(len(joint.weights) for joint in joints)))  # fmt: skip
        size = len(links) * self._sizes[0] * self._sizes[1]
        self._memory = (
            np.zeros((2, DEPTH, size)),
            np.zeros((DEPTH, DEPTH)),
            np.zeros((2, size)),
            np.zeros((DEPTH + 1, DEPTH)),
        )
        self._matrices, self._unknowns = self._coupled()
        self._shapes, self._frames = self._fitted()
        self._beams = self._points()
        self._elements = element_tables(links, self.parts)
        self._element_room = room_for(self._elements)
        self._acting = acting_on(actions, links, [part.T for part in self.parts])
        self._kinds = np.array([KINDS[link.kind] for link in links])

    @property
    def sweeps(self) -> int:
        """Taken so far."""
        return int(self._counts[0])

    @property
    def eased(self) -> int:
        """Steps whose iterations were taken as converged at a tolerance EASIER times larger."""
        return int(self._counts[5])

    def begin(self, states: Sequence[LinkState]) -> State:
        """The loop's own state, from link states."""
        D, n, P = self._sizes
        L, (b, _, E) = len(self.links), self._beams[6].shape
        u, v, a, F, f = (np.zeros((L, D, n)) for _ in range(5))
        C, force, Q, angle = np.zeros((3, L, D, n)), np.zeros((L, D * P)), np.zeros((L, 3, 3)), np.zeros(L)
        g, strain, direction, turn = (
            np.zeros((3, L, D * n)),
            np.zeros((3, b, 3, E)),
            np.zeros((b, 2, E)),
            np.zeros((b, E)),
        )
        Q[:], direction[:, 0] = np.eye(3), 1.0
        general = [
            first_state(link, joint, self.damping, s)
            for link, joint, s in zip(self.links, self.joints, states, strict=True)
        ]
        for i, (link, joint, part, s) in enumerate(
            zip(self.links, self.joints, self.parts, general, strict=True)
        ):
            for out, rows in ((u, s.u), (v, s.v), (a, s.a)):
                out[i, : link.d, : link.n] = coordinates(link, part, rows)
            for out, rows in ((F, s.F), (f, s.f)):
                out[i, : link.d, : link.n] = work_on(part, rows)
            for m in range(3):
                C[m, i, : link.d, : link.n] = work_on(part, s.damped[m])
            force[i] = self._padded_ports(joint, s.port_forces)
            points = points_of(link)
            k = np.searchsorted(self._beams[0], i)
            for e, (point, seen) in enumerate(zip(points, s.frames, strict=False)):
                strain[0, k, :, e] = point.strains @ seen.g.ravel()
                strain[1, k, :, e] = point.strains @ seen.g1.ravel()
                direction[k, :, e], turn[k, e] = seen.Q[:2, :2] @ point.tangent, seen.angle
            for seen in s.frames if not points else ():
                Q[i, : link.d, : link.d], angle[i] = seen.Q, seen.angle
                for m, x in enumerate((seen.g, seen.g1)):
                    g[m, i].reshape(D, n)[: link.d, : link.n] = coordinates(link, part, x)
        return u, v, a, F, f, C, force, Q, angle, g, strain, direction, turn, np.zeros(len(self.actions))

    def copied(self, state: State) -> State:
        """A state that a solver may use up."""
        return tuple(x.copy() for x in state)

    def advance(
        self, state: State, forcing: Sequence[Forcing], motion: RigidMotion
    ) -> tuple[list[LinkHistory], State]:
        """All time points of a block, one step after the other, [KED, eq. (20)]; see `DenseSteps.advance`.

        Raises
        ------
        NotConverged
            With what was done before.
        """
        from kedfem.dynamics.following_kernel import follow_block

        self._close(state)
        D, n, P = self._sizes
        T, L = len(forcing[0].R), len(self.links)
        R, F = np.zeros((T, L, D, D)), np.zeros((T, L, D, n))
        for i, (link, part, each) in enumerate(zip(self.links, self.parts, forcing, strict=True)):
            R[:, i, : link.d, : link.d] = each.R
            F[:, i, : link.d, : link.n] = work_over_time(part, each.F)
        u, v, a, g = (np.empty((T, L, D, n)) for _ in range(4))
        strains = np.empty((T, *state[10].shape[1:]))
        history = (u, v, a, g, strains, np.zeros((T, L, D, D)), np.empty((T, L, D * P)), np.empty((T, L)))
        taken, worst = follow_block(
            self.coefficients, self._matrices, self._unknowns, self._shapes, self._frames, self._beams,
            self._elements, self._element_room, self._kinds,
            (R, F), over_block(self._acting, motion), state, history, self._memory, self._counts,
        )  # fmt: skip
        if self.actions:
            forcing = [self._acted(i, each, F[:, i]) for i, each in enumerate(forcing)]
        histories = [self._history(i, each, history, taken) for i, each in enumerate(forcing)]
        if taken < T:
            raise NotConverged(taken, histories, state, self.links[worst].name)
        return histories, state

    def _history(self, i: int, forcing: Forcing, history: State, taken: int) -> LinkHistory:
        link, part, held = self.links[i], self.parts[i], self._held(self.joints[i])
        strains, points = history[4][:taken, np.searchsorted(self._beams[0], i) :][:, :1], points_of(link)
        us, vs, as_, gs, Rs, forces, energies = (x[:taken, i] for x in (*history[:4], *history[5:]))
        u, v, a = (rows_of(link, part, x) for x in (us, vs, as_))
        if points:
            share = np.concatenate([point.share.T for point in points])  # (3E, 3n)
            seen = strains[:, 0, :, : len(points)].transpose(0, 2, 1).reshape(taken, 3 * len(points))
            g = (seen @ share).reshape(u.shape)
        else:
            g = rows_of(link, part, gs)
        R = Rs[:, : link.d, : link.d].copy()
        return LinkHistory(u, v, a, g, R, forcing.F[:taken], forces[:, held], energies.copy())

    def _close(self, state: State) -> None:
        """Close the joints in displacement and rates, in place."""
        for x in state[:3]:
            flat = [x[i, : link.d, : link.n].ravel() for i, link in enumerate(self.links)]
            for i, (link, y) in enumerate(zip(self.links, closed(self._closure, flat), strict=True)):
                x[i, : link.d, : link.n] = y.reshape(link.d, link.n)

    def _acted(self, i: int, forcing: Forcing, F: Float[np.ndarray, "T D n"]) -> Forcing:
        """The loads of a segment with the forces of motors and springs on it."""
        link, part = self.links[i], self.parts[i]
        rows = [F[:, c, : link.n] @ (part.T[c].T @ link.mass[c]) for c in range(link.d)]  # T⁻¹ = Tᵀ m
        return replace(forcing, F=np.stack(rows, axis=2))

    def _coupled(self) -> tuple[State, State]:
        D, n, P = self._sizes
        L, order = len(self.links), near_diagonal(self.joints)
        columns = [np.flatnonzero(joint.B.any(axis=0)) for joint in self.joints]
        count = np.array([len(each) for each in columns])
        G, Yt = np.zeros((L, D * n, D * n)), np.zeros((L, D * P, D * n))
        S, B = np.zeros((L, D * P, D * P)), np.zeros((L, D * P, count.max()))
        numbers = np.zeros((L, count.max()), int)
        first = np.arange(len(order))
        for i, (link, joint, part) in enumerate(zip(self.links, self.joints, self.parts, strict=True)):
            x, held = self._places(link), self._held(joint)
            G[i][np.ix_(x, x)] = part.G
            Yt[i][np.ix_(held, x)] = part.Y.T
            S[i][np.ix_(held, held)] = part.S
            B[i][held, : count[i]] = joint.B[:, columns[i]]
            numbers[i, : count[i]] = order[columns[i]]
            if count[i]:
                here = order[columns[i]]
                first[here] = np.minimum(first[here], here.min())
        return (G, Yt, S, B), (numbers, count, first)

    def _fitted(self) -> tuple[State, State]:
        """What frames need of all segments but those that know their strains, of which the mean rotation is enough."""
        D, n, _ = self._sizes
        L = len(self.links)
        X, one, fit = (np.zeros((L, D, n)) for _ in range(3))
        K, bends, follows = np.zeros((L, D * n, D * n)), np.zeros(L, bool), np.zeros(L, bool)
        for i, (link, part) in enumerate(zip(self.links, self.parts, strict=True)):
            rows = link.X[:, : link.d] * ([1, 1, 0] if link.kind == "beam" else 1)
            X[i, : link.d, : link.n] = coordinates(link, part, rows)
            one[i, : link.d, : link.n] = coordinates(link, part, np.repeat(link.one[:, None], link.d, axis=1))
            bends[i], follows[i] = bool(points_of(link)), link.fit is not None
            if link.fit is not None:
                fit[i, : link.d, : link.n] = work_on(part, link.fit[:, : link.d])
            if not bends[i]:
                x = self._places(link)
                K[i][np.ix_(x, x)] = component_first(part.T, link.K0)
        return (X, one), (bends, follows, fit, K)

    def _points(self) -> State:
        """Rows, tangents and rigidities of the planar beams that know their strains, see `dynamics.beams_kernel`."""
        which = np.array([i for i, link in enumerate(self.links) if points_of(link)], int)
        every = [points_of(self.links[i]) for i in which]
        b, E = len(which), max([1, *(len(points) for points in every)])
        rows, tangent, rigidity = (
            np.zeros((b, 3, E, self._sizes[1])),
            np.zeros((b, 2, E)),
            np.zeros((b, 3, E)),
        )
        tangent[:, 0] = 1.0
        for k, (i, points) in enumerate(zip(which, every, strict=True)):
            n, T = self.links[i].n, self.parts[i].T
            for e, point in enumerate(points):
                of_u, of_psi = (
                    point.strains.reshape(3, -1, 3)[:, :, :2],
                    point.strains.reshape(3, -1, 3)[:, :, 2],
                )
                rows[k, 0, e, :n] = T[0].T @ of_u[0] @ point.tangent
                rows[k, 1, e, :n] = T[2].T @ -of_psi[1]
                rows[k, 2, e, :n] = T[2].T @ of_psi[2]
                tangent[k, :, e], rigidity[k, :, e] = point.tangent, point.rigidity
        D, S, _ = self._sizes
        return which, which, D * S * which, np.full(b, S), rows, tangent, rigidity

    def _places(self, link: Link) -> Int[np.ndarray, " x"]:
        """Where the coordinates of a link stand among the padded ones."""
        return np.asarray((self._sizes[1] * np.arange(link.d)[:, None] + np.arange(link.n)).ravel())

    def _held(self, joint: Attachment) -> Int[np.ndarray, " q"]:
        """Where the held components of a link stand among the padded ones."""
        port, component = np.divmod(joint.keep, joint.components)
        return np.asarray(self._sizes[0] * port + component)

    def _padded_ports(self, joint: Attachment, force: Float[np.ndarray, " q"]) -> Float[np.ndarray, " Q"]:
        out = np.zeros((self._sizes[2], self._sizes[0]))
        vectors = port_vectors(joint, force)
        out[: len(vectors), : vectors.shape[1]] = vectors
        return out.ravel()


def points_of(link: Link) -> tuple[BeamPoint, ...]:
    """The Gauss points whose frames a planar beam's segment has."""
    return tuple(frame.point for frame in link.frames if frame.point)


def near_diagonal(joints: Sequence[Attachment]) -> Int[np.ndarray, " k"]:
    """New number of each interface unknown, so that those which share a segment stand near each other."""
    touched = np.array([joint.B.any(axis=0) for joint in joints], dtype=float)
    if not touched.shape[1]:
        return np.zeros(0, int)
    order = reverse_cuthill_mckee(sp.csr_array(touched.T @ touched).tocsr(), symmetric_mode=True)
    number = np.empty(len(order), int)
    number[order] = np.arange(len(order))
    return number
