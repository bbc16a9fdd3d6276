"""A mechanism with its own steps of generalised-α, and its linear equation with rigid-body frames, dense.

    M q'' + C q' + (K + G) q = f + Bᵀ m,   B q = 0

M is constant and all else of time; B are the directions of slides between moving links, at unknowns that links share.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from time import process_time
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from jaxtyping import Float

from benchmarks.monolithic import shared_nodes
from benchmarks.orders_schemes import RHO
from kedfem.accuracy.reduction import prepared
from kedfem.dynamics.matrices.substructure import mass_matrix
from kedfem.dynamics.rigid_body import forcings
from kedfem.dynamics.stepping.scheme import generalised_alpha
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.start import motion_of, started
from kedfem.dynamics.system.march import march
from kedfem.dynamics.system.ready import displacements, ready
from kedfem.dynamics.system.starts.instant import Instant
from kedfem.dynamics.system.state import State
from kedfem.scene import scene_from

TURN, TURNS = 0.1, 2  # s
SEEN = 100  # instants of a run at which its error is examined
PART = 20_000  # steps whose histories are in memory together
WAVES = 256  # instants of a turn whose constraints are interpolated by trigonometric polynomials, exact to rounding


@dataclass(frozen=True)
class Run:
    """Coordinates and strain energy at `SEEN` instants, iterations, processor time [s]."""

    u: Float[np.ndarray, "S N"]
    passes: int
    seconds: float
    energy: Float[np.ndarray, " S"]


class Mechanism:
    """A scene with its links, its start, and the solver's own steps."""

    def __init__(self, raw: Mapping[str, Any]) -> None:
        made = prepared(scene_from(raw))[0]
        given = made.scene, made.linkage, made.path
        solver = steps_of(made.scene, made.model)
        self.of = solver.ready
        self.model = self.of.system.model
        self.motion_at = motion_of(*given)
        self.state: State = started(*given, made.model, solver)

    def alpha(self, steps: int) -> "Run":
        """So many steps of generalised-α in all."""
        h = TURN * TURNS / steps
        of, state = ready(self.of.system, generalised_alpha(h, RHO), self.of.c.tolerance), self.state
        seen, part, spent = steps // SEEN, max(1, PART // (steps // SEEN)) * (steps // SEEN), 0.0
        u, energy = [], []
        for first in range(0, steps, part):
            motion = self.motion_at(h * np.arange(first + 1, min(first + part, steps) + 1))
            since = process_time()
            state, history = march(of, state, motion)
            spent += process_time() - since
            u.append(history.u[seen - 1 :: seen])
            energy.append(history.energy[seen - 1 :: seen].sum(axis=1))
        passes = int(state.passes[0] - self.state.passes[0])
        return Run(np.concatenate(u), passes, spent, np.concatenate(energy))


class Equation:
    """The equation of a mechanism with rigid-body frames: unknowns that joints leave which share points."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.mechanism, model = mechanism, mechanism.model
        self.T = shared_nodes(model.links, model.joints).toarray()
        self.at = np.concatenate([[0], np.cumsum([link.unknowns for link in model.links])])
        parts = [self.T[a:b] for a, b in zip(self.at, self.at[1:], strict=False)]
        masses = [mass_matrix(link).toarray() for link in model.links]
        self.M = sum(T.T @ M @ T for T, M in zip(parts, masses, strict=True))
        K, C, G = [], [], []
        for link, M, T in zip(model.links, masses, parts, strict=True):
            K0 = link.K0.toarray() if sp.issparse(link.K0) else np.asarray(link.K0)
            C0 = model.damping.alpha * M + model.damping.beta * K0
            K += _waves(T, K0, link.d, turning=False)
            C += _waves(T, C0, link.d, turning=False)
            G += _waves(T, C0, link.d, turning=True)
        self.K, self.C, self.G = np.array(K), np.array(C), np.array(G)

    def along(self, t: Float[np.ndarray, " T"]) -> "Along":
        """What it depends on at some times."""
        model, motion = self.mechanism.model, self.mechanism.motion_at(t)
        forcing = forcings(model, motion)
        f = sum(each.F.reshape(len(t), -1) @ self.T[a:b]
                for each, a, b in zip(forcing, self.at, self.at[1:], strict=False))  # fmt: skip
        c, s = (np.stack([x.R[:, k, 0] for x in forcing], axis=1) for k in (0, 1))
        basis = np.stack([np.ones_like(c), c, s, c * c - s * s, 2 * c * s], axis=2)
        rates = motion.omega[:, list(model.bodies), 2]
        turning = (rates[..., None] * basis).reshape(len(t), -1)
        return Along(self, t, np.asarray(f), basis.reshape(len(t), -1), turning)

    def unknowns(self, u: Float[np.ndarray, "S N"]) -> Float[np.ndarray, "S F"]:
        """The unknowns from the solver's coordinates."""
        of = self.mechanism.of
        rows = [displacements(of, k, u).reshape(len(u), -1) for k in range(len(of.parts))]
        return np.asarray(np.linalg.lstsq(self.T, np.concatenate(rows, axis=1).T, rcond=None)[0].T)

    @cached_property
    def start(self) -> Float[np.ndarray, "2 F"]:
        """Displacement and rate at the start."""
        state = self.mechanism.state
        return self.unknowns(np.stack([state.u, state.v]))

    @cached_property
    def directions(self) -> Float[np.ndarray, "w r F"]:
        """Fourier coefficients of B over a revolution."""
        at, of = self.mechanism.motion_at, self.mechanism.of
        if not of.system.constraints:
            return np.zeros((1, 0, self.T.shape[1]))
        k, first = of.system.unknowns, Instant(of, self.mechanism.motion_at, 0.0)
        instants = (Instant(of, at, TURN * n / WAVES, first) for n in range(WAVES))
        found = np.zeros((WAVES, len(of.system.constraints), self.T.shape[1]))
        found[:, :, found.shape[2] - k :] = [each.gradients(np.zeros(k)).toarray() for each in instants]
        waves = np.asarray(np.fft.rfft(found, axis=0)) / WAVES
        waves[1:] *= 2
        return waves[: 1 + int(np.flatnonzero(np.abs(waves).max(axis=(1, 2), initial=0.0) > 1e-14).max(initial=0))]


def _waves(
    T: Float[np.ndarray, "n N"], K0: Float[np.ndarray, "n n"], d: int, turning: bool
) -> list[Float[np.ndarray, "N N"]]:
    """Tᵀ R K0 Rᵀ T of a link turned by θ, or Tᵀ R K0 (dR/dθ)ᵀ T, on 1, cos θ, sin θ, cos 2θ, sin 2θ."""
    angles = 2 * np.pi * np.arange(5) / 5
    found = []
    for a in angles:
        R, dR = np.eye(d), np.zeros((d, d))
        R[:2, :2] = [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]
        dR[:2, :2] = [[-np.sin(a), -np.cos(a)], [np.cos(a), -np.sin(a)]]
        whole, other = (scipy.linalg.block_diag(*[x] * (len(K0) // d)) for x in (R, dR if turning else R))
        found.append(T.T @ whole @ K0 @ other.T @ T)
    basis = np.stack([np.ones(5), np.cos(angles), np.sin(angles), np.cos(2 * angles), np.sin(2 * angles)], axis=1)
    return list(np.tensordot(np.linalg.inv(basis), np.array(found), 1))


@dataclass(frozen=True)
class Along:
    """An equation at T times: f (T, N), and what K and C, and G, are composed of."""

    of: Equation
    t: Float[np.ndarray, " T"]
    f: Float[np.ndarray, "T N"]
    basis: Float[np.ndarray, "T b"]
    turning: Float[np.ndarray, "T b"]

    def all_matrices(self) -> tuple[Float[np.ndarray, "T N N"], Float[np.ndarray, "T N N"]]:
        """K + G and C at all of the times."""
        of = self.of
        K = np.tensordot(self.basis, of.K, 1) + np.tensordot(self.turning, of.G, 1)
        return K, np.tensordot(self.basis, of.C, 1)

    @cached_property
    def constraints(self) -> Float[np.ndarray, "T 3 r N"]:
        """B and its rates at all of the times."""
        directions = self.of.directions
        waves = 2j * np.pi / TURN * np.arange(len(directions))
        turns = np.exp(np.outer(self.t, waves))
        return np.stack([np.tensordot(turns * waves**m, directions, 1).real for m in range(3)], axis=1)


def error(of: Equation, found: Float[np.ndarray, "S N"], truth: Float[np.ndarray, "S N"]) -> float:
    """Largest error in time in the norm of strain energy, of its largest value."""
    t = TURN * TURNS / SEEN * np.arange(1, SEEN + 1)
    K = np.tensordot(of.along(t).basis, of.K, 1)
    size = np.sqrt(np.einsum("ti,tij,tj->t", truth, K, truth)).max()
    off = found - truth
    with np.errstate(over="ignore", invalid="ignore"):
        e = np.sqrt(np.abs(np.einsum("ti,tij,tj->t", off, K, off))).max() / size
    return float(e) if np.isfinite(e) else np.inf
