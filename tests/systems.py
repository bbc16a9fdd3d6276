"""Scenes as systems, marched from rest; the same by the oracle."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

from kedfem.accuracy.prepared import Prepared, moving
from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.rigid_body import forcings
from kedfem.dynamics.stepping.scheme import generalised_alpha
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.start import initial_rates
from kedfem.dynamics.system.build import system_of
from kedfem.dynamics.system.march import march
from kedfem.dynamics.system.monolithic.monolithic import Monolithic
from kedfem.dynamics.system.monolithic.monolithic_steps import begun as as_the_oracle_begins
from kedfem.dynamics.system.monolithic.monolithic_tangent import inverse, rotated_stiffness
from kedfem.dynamics.system.ready import Ready, displacements, ready
from kedfem.dynamics.system.starts.accelerations import accelerated_in_a_step, accelerations
from kedfem.dynamics.system.starts.initial_states import rest
from kedfem.dynamics.system.state import History, State
from kedfem.links.build import bare_links
from kedfem.links.record import mass_times
from kedfem.motion.newton import cross_matrix
from kedfem.motion.rigid import RigidMotion, rigid_motion
from kedfem.scene import path_parameter, scene_from, time_grid


@dataclass(frozen=True)
class Begun:
    """A system at rest at t = 0, and its rigid-body motion."""

    prepared: Prepared
    ready: Ready
    state: State
    motion: Callable[[np.ndarray], RigidMotion]

    def steps(self, count: int, first: int = 1) -> RigidMotion:
        """The rigid-body motion at the ends of successive steps."""
        return self.motion(self.ready.c.h * np.arange(first, first + count))


def begun(
    raw: dict[str, Any], frames: str | None = None, driven: bool = True, today: bool = True, as_run: bool = False,
    **unchecked: Any,
) -> Begun:  # fmt: skip
    """A scene as a system.

    Parameters
    ----------
    frames : given after the scene has been checked: what today's solvers refuse
    driven : whether its drives stay
    today : whether there is a model as today's solvers have it, without points for springs, motors and rigid links
    as_run : whether it begins as runs with co-rotational frames begin
    unchecked : sections put in after the check
    """
    raw = {**raw, "analysis": {**raw["analysis"], "initial": "rest"}}
    scene = scene_from(raw)
    if frames is not None:
        scene.analysis.fill(frames=frames)
    if not driven:
        scene.fill(drive=None, drives={})
    scene.fill(**unchecked)
    linkage, path = moving(scene)
    known = bare_links(scene)
    system = system_of(scene, linkage, path, elastic_model(scene, linkage, known, path, elements=True))
    model = elastic_model(scene, linkage, known, path) if today else system.model
    made = Prepared(scene, linkage, path, model)
    of = ready(system, generalised_alpha(time_grid(scene).step, scene.analysis.rho_inf))

    def motion(t: np.ndarray) -> RigidMotion:
        return rigid_motion(made.linkage, made.path, t, path_parameter(scene, t))

    rates = initial_rates(scene, made.linkage, made.path, system.model)
    found = accelerated_in_a_step if as_run else accelerations
    return Begun(made, of, rest(of, motion, rates, accelerated=found), motion)


def stiffened(of: Begun) -> Begun:
    """The same from rest, its links stiffened by the stresses of their motion."""
    scene, model = of.prepared.scene, of.prepared.model
    system = replace(of.ready.system, stiffening=steps_of(scene, model).stiffening)
    made = ready(system, of.ready.scheme)
    return replace(
        of,
        ready=made,
        state=rest(made, of.motion, initial_rates(scene, of.prepared.linkage, of.prepared.path, system.model)),
    )


def rows(of: Ready, x: np.ndarray) -> np.ndarray:
    """All bodies' rows, flat, over time (T, N)."""
    every = [displacements(of, k, x).reshape(len(x), -1) for k in range(len(of.system.names))]
    return np.concatenate(every, axis=1)


def by_oracle(
    of: Begun, count: int, keeps: bool = False, divided: bool = False, first: int = 1
) -> tuple[np.ndarray, np.ndarray]:  # fmt: skip
    """Displacements (T, N) and multipliers (T, r) of some steps, by the oracle from the same state.

    keeps : see `Monolithic`; where forces bend sharply it may find another solution
    divided : whether steps are where stops with damping are met
    first : number of the first step
    """
    solver = Monolithic(of.ready.system, of.ready.scheme, keeps)
    now = as_the_oracle_begins(of.ready, of.state, of.motion)
    along, out = of.steps(count, first), []
    for k in range(count):
        now = solver.step(now, along.part(k, k + 1), of.motion if divided else None)
        out.append((now.u, now.multiplier))
    return np.stack([u for u, _ in out]), np.stack([m for _, m in out])


def against_oracle(of: Begun, count: int = 3, keeps: bool = False) -> float:
    """Largest difference of displacements, of their peak."""
    _, history = march(of.ready, of.state, of.steps(count))
    wanted = by_oracle(of, count, keeps)[0]
    return float(np.abs(rows(of.ready, history.u) - wanted).max() / np.abs(wanted).max())


def marched(of: Begun, count: int, divided: bool = False, first: int = 1) -> tuple[State, History]:
    """Some steps, the first ones at first, divided where they must be if that is asked for."""
    return march(of.ready, of.state, of.steps(count, first), of.motion if divided else None)


def assembled_deflection(of: Ready, at: RigidMotion) -> np.ndarray:
    """Quasi-static u (N,) of rigid-body frames at one time, all equations in one matrix, with what stresses stiffen.

    K u + M ([α]× + [ω]×²) u − Wᵀ λ = F, W u = B z, Bᵀ λ = Cᵀ m − Cᵀ k C z, C z = −e(0); dampers are left out.
    """
    solver, system, model = Monolithic(of.system, of.scheme), of.system, of.system.model
    K = [rotated_stiffness(x.K0, at.R[0, body, : x.d, : x.d]) for x, body in zip(model.links, model.bodies, strict=True)]
    if system.stiffening is not None:
        stressed = system.stiffening.stiffness(forcings(model, at), at)
        K = [own + more for own, more in zip(K, stressed, strict=True)]
    turning = []
    for link, body in zip(model.links, model.bodies, strict=True):
        W = cross_matrix(at.omega[0, body])
        spin = (cross_matrix(at.alpha[0, body]) + W @ W)[: link.d, : link.d]
        every = np.eye(link.unknowns).reshape(-1, link.n, link.d)
        turning.append(np.array([mass_times(link.mass, x @ spin.T).ravel() for x in every]).T)
    e, C = solver.coordinates(np.zeros(solver.k), np.zeros(sum(len(x.terms) for x in system.constraints)), at)
    hard, k = np.array(solver.hard, int), [getattr(x.law, "stiffness", 0.0) for x in system.constraints]
    springs = sp.csr_array(C.T @ (np.array(k)[:, None] * C)) if k else None
    rows_of = sp.csr_array(C[hard])
    equations = sp.block_array([
        [sp.block_diag(K) + sp.block_diag(turning), None, -solver.W.T, None], [solver.W, -solver.B, None, None],
        [None, springs, solver.B.T, -rows_of.T], [None, rows_of, None, None],
    ])  # fmt: skip
    right = np.zeros(equations.shape[0])
    right[: solver.N], right[len(right) - len(hard) :] = solver.applied(at), -e[hard]
    return inverse(sp.csr_array(equations), C[hard])(right)[: solver.N]
