"""Accelerations that balance all forces and satisfy all constraints; on request those of bodies without strain.

With P the motions of a body without strain, its acceleration is then a_c + b, a_c centripetal, and b = P Pᵀ b:

    P Pᵀ b + s (1 − P Pᵀ) b = r − a_c − μ + Wᵀ λ,   μ + s (1 − P Pᵀ) b → μ

each iteration reduces the strain of b by a factor s.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.matrices.bordered import ConstraintTerms
from kedfem.dynamics.matrices.dense import coordinates
from kedfem.dynamics.system.sparse import SparsePart
from kedfem.dynamics.system.starts.instant import Flat, Instant
from kedfem.dynamics.system.starts.internal_forces import drawn, own, rotated_rate, rows
from kedfem.dynamics.system.starts.linear_equations import LinearEquations, Solved, held_body, stepped_body
from kedfem.links.record import Link
from kedfem.motion.newton import cross_matrix

STIFFER = 1e6  # s
AGAIN = 3  # times: what strains is then 1e-18 of b


def accelerations(now: Instant, r: Flat, u: Flat, v: Flat, asked: ConstraintTerms, rigid: bool = False) -> Solved:
    """Accelerations under forces r (N,), world components, with joints and constraints closed.

    Parameters
    ----------
    u, v : (N,) displacements and rates
    rigid : whether all bodies accelerate as rigid ones do where they are; links that are stiff beside others always do
    """
    of = now.of
    stiff = [rigid or (link.rigid and link.fit is not None) for link in of.system.model.links]
    pure = [rigid_motions(now, k, u) if each else None for k, each in enumerate(stiff)]
    held = []
    for k, (P, part) in enumerate(zip(pure, of.parts, strict=True)):
        if P is None:
            held.append(now.always.mass(k))
        else:
            held.append(held_body(P @ P.T + STIFFER * (np.eye(len(P)) - P @ P.T), part.W))
    balance = LinearEquations(of, held, now.R, asked)
    stress = np.zeros_like(r)
    turning = centripetal(now, u, v, stiff) if any(stiff) else stress
    for _ in range(AGAIN if any(stiff) else 1):
        found = balance.solved(r - turning - stress, turning)
        for k, P in enumerate(pure):
            if P is not None:
                x = balance.rotated(k, found.x[own(of, k)], back=True)
                stress[own(of, k)] += STIFFER * balance.rotated(k, x - P @ (P.T @ x))
    return replace(found, x=found.x + turning)


def accelerated_in_a_step(now: Instant, r: Flat, u: Flat, v: Flat, asked: ConstraintTerms) -> Solved:
    """The same, but for what springs, motors and follower loads do: A x = c_M Wᵀ λ with a step's matrix.

    Their whole force would at first accelerate next to no mass about their points: no step resolves that, and laws would
    see its rates. What stands against it in that matrix, c_K/c_M K x, is internal force at the start, so that all
    forces balance there.
    """
    pushed = now.pushed(u)
    alone = accelerations(now, r - pushed, u, v, replace(asked, known=0 * asked.known))
    if not (asked.known.any() or pushed.any()):
        return alone
    more = in_a_step(now, pushed, replace(asked, target=0 * asked.target), now.R)
    return Solved(alone.x + more.x, alone.z + more.z, alone.m + more.m, alone.forces + more.forces, more.f)


def in_a_step(now: Instant, pushed: Flat, asked: ConstraintTerms, R: Float[np.ndarray, "bodies 3 3"]) -> Solved:
    """Accelerations under forces on bodies, and that constraints know, with a step's matrix, turned by R; see above."""
    of, still = now.of, now.always.static
    share = of.c.c_K / of.c.c_M
    held = [
        stepped_body(part, of.c.c_M) if isinstance(part, SparsePart)
        else held_body(np.eye(len(still.K[k])) + share * still.K[k], part.W)
        for k, part in enumerate(of.parts)
    ]  # fmt: skip
    balance = LinearEquations(of, held, R, asked)
    more = balance.solved(pushed)
    x = [balance.rotated(k, more.x[own(of, k)], back=True) for k in range(len(held))]
    f = np.concatenate([balance.rotated(k, share * still.times(k, each)) for k, each in enumerate(x)])
    return replace(more, f=f)


def rigid_motions(now: Instant, k: int, u: Flat) -> Float[np.ndarray, "N m"]:
    """Motions of body k without strain where it is, in coordinates of its frame, orthonormal."""
    link, part = now.of.system.model.links[k], now.of.parts[k]
    x = _position(now, k, u) @ now.R[k][: link.d, : link.d]
    axes = np.eye(3)[2 if link.planar else 0 :]
    moved = [np.outer(link.one, e)[:, : link.d] for e in np.eye(3)[: 2 if link.planar else 3]]
    for e in axes:
        turning = rotated_rate(cross_matrix(e), x)
        if link.kind == "beam":
            turning[:, 2] = link.one
        moved.append(turning)
    basis = [coordinates(link, part, each).ravel() for each in moved]
    return np.asarray(np.linalg.qr(np.array(basis).T)[0])


def _position(now: Instant, k: int, u: Flat) -> Float[np.ndarray, "n d"]:
    """Rows of body k against the origin that its rigid-body motion turns, world components; of ψ those of u."""
    link = now.of.system.model.links[k]
    out = drawn(link) @ now.R[k][: link.d, : link.d].T + rows(now.of, k, u[own(now.of, k)])
    if link.kind == "beam":
        out[:, 2] = 0.0
    return np.asarray(out)


def centripetal(now: Instant, u: Flat, v: Flat, which: Sequence[bool]) -> Flat:
    """([ω]² − [ω₀]²) x + ([α₀]× + [ω₀]²) u of some bodies where they are, at x = X + u; world components.

    They turn at ω in all, ω₀ of it rigid-body, whose rate is α₀.
    """
    out, alpha = np.zeros_like(v), now.motion.alpha[0][now.of.bodies.motion]
    for k, link in enumerate(now.of.system.model.links):
        if not which[k]:
            continue
        here = own(now.of, k)
        moved, x = rows(now.of, k, u[here]), _position(now, k, u)
        omega = cross_matrix(now.omega[k])
        spin = omega + own_spin(link, rows(now.of, k, v[here]) - rotated_rate(omega, moved), x)
        rate = rotated_rate(spin @ spin - omega @ omega, x)
        rate += rotated_rate(cross_matrix(alpha[k]) + omega @ omega, moved)
        out[here] = coordinates(link, now.of.parts[k], rate).ravel()
    return out


def own_spin(link: Link, v: Float[np.ndarray, "n d"], x: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "3 3"]:
    """[ω]× of the rigid motion nearest to rates of a body at places x: the skew part of their gradient."""
    k = 2 if link.planar else 3
    if link.kind == "beam":  # its axis alone does not determine it
        return cross_matrix(np.array([0.0, 0.0, link.one @ v[:, 2] / (link.one @ link.one)]))
    basis = np.column_stack([link.one, x[:, :k]])
    gradient = np.linalg.lstsq(basis, v[:, :k], rcond=1e-10)[0][1:].T
    out = np.zeros((3, 3))
    out[:k, :k] = gradient
    return np.asarray((out - out.T) / 2)
