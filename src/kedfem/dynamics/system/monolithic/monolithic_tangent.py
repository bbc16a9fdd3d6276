"""Tangents of the monolithic solver: of bodies and force laws by differences, in one matrix with all constraints."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
import scipy.sparse as sp
from scipy.linalg import qr
from scipy.sparse.linalg import splu

from kedfem.arrays import Bool, Float
from kedfem.dynamics.system.monolithic.monolithic_places import force
from kedfem.errors import SolveError
from kedfem.motion.rigid import RigidMotion

if TYPE_CHECKING:
    from kedfem.dynamics.system.monolithic.monolithic import Monolithic, Now

DIFFERENCE = 1e-6  # of central differences for tangents: Newton's method needs no better ones
ONE_SIDED = 1e-8  # of others: with 1e-6 a stiff body that turns freely by 0.02 rad a step had Newton's method diverge
TINY = 1e-300  # size of a row of zeros
REPEATED = 1e-9  # singular values of rows of length one that repeat each other
Matrix = Float[np.ndarray, "_ _"]
Column = Float[np.ndarray, " _"]
Inverse = Callable[[Column], Column]
"""Solutions for right sides."""


def tangent(of: Monolithic, now: Now, old: Now, at: RigidMotion, C: Matrix, m: Column) -> sp.csr_array:
    """Of all equations by all unknowns.

    Parameters
    ----------
    C, m : gradients of all constraints, and their multipliers
    """
    s, bodies = of.scheme, sp.block_diag([_of_body(of, n, now, old, at) for n in range(len(of.of))])
    A = (1 - s.alpha_m) * s.a0 * of.M + (1 - s.alpha_f) * bodies
    return assembled(of, A, _of_pull(of, now, old, at, m), C[of.hard])


def assembled(of: Monolithic, A: sp.csr_array, pull: Matrix, C: Matrix) -> sp.csr_array:
    """Bodies with a matrix A, coupled by interface points and constraints; `pull` is what forces on z change with z."""
    hard, none = sp.csr_array(C), sp.csr_array((len(C), len(C)))
    blocks = [
        [A, None, -of.W.T, None], [of.W, -of.B, None, None], [None, -sp.csr_array(pull), of.B.T, -hard.T],
        [None, hard, None, none],
    ]  # fmt: skip
    return sp.csr_array(sp.block_array(blocks))


def _of_body(of: Monolithic, n: int, now: Now, old: Now, at: RigidMotion) -> sp.csr_array | Matrix:
    """Of the internal force of body n: K + a₁ C with a rigid-body frame, else by differences; world components."""
    model, own, a1 = of.system.model, of.of[n], of.scheme.a1
    link = model.links[n]
    if link.fit is None:
        K = rotated_stiffness(link.K0, at.R[0, model.bodies[n], : link.d, : link.d])
        out = K + a1 * (model.damping.alpha * of.masses[n] + model.damping.beta * K)
        return sp.csr_array(out + of.stressed[n] if of.stressed else out)
    pushed = np.eye(own.stop - own.start) * ONE_SIDED
    change = [of.force_of(n, now.u[own] + x, old, at)[0] - now.f[own] for x in pushed]
    return np.array(change).T / ONE_SIDED


def rotated_stiffness(K0: sp.csr_array, R: Matrix) -> sp.csr_array:
    """K = T K0 Tᵀ, [KED, eq. (14)], block by block.

    Parameters
    ----------
    K0 : (dn, dn) in the link frame
    R : (d, d) link to world

    Returns
    -------
    (dn, dn) in the world frame
    """
    blocks = sp.bsr_array(K0, blocksize=R.shape)
    return sp.csr_array(sp.bsr_array((R @ blocks.data @ R.T, blocks.indices, blocks.indptr), shape=K0.shape))


def _of_pull(of: Monolithic, now: Now, old: Now, at: RigidMotion, m: Column) -> Matrix:
    """Of all constraints' forces Cᵀ m on interface unknowns, by those which a constraint that is not linear sees."""
    out = np.zeros((of.k, of.k))
    varied = [n for n, x in enumerate(of.system.constraints) if not x.linear or n not in of.hard]
    felt = np.array([_felt(of, n) for n in varied]).reshape(len(varied), of.k)
    for column in np.flatnonzero(felt.any(axis=0)):
        x, pushed = DIFFERENCE * np.eye(of.k)[column], []
        which = [n for n, each in zip(varied, felt[:, column], strict=True) if each]
        for sign in (1, -1):
            e, moved = of.coordinates(now.z + sign * x, now.term_angles.copy(), at, which)
            pull, rate = m.copy(), of.rates(e, *old.e)[0]
            for n in set(which).difference(of.hard):
                each = of.system.constraints[n]
                pull[n] = -(1 - of.scheme.alpha_f) * force(each, at, e[n], rate[n], of.sides[n])
            pushed.append(moved[which].T @ pull[which])
        out[:, column] = (pushed[0] - pushed[1]) / (2 * DIFFERENCE)
    return out


def _felt(of: Monolithic, n: int) -> Bool[np.ndarray, " k"]:
    """Whether interface unknowns move the ends of constraint n."""
    ends = {end for term in of.system.constraints[n].terms for end in (term.i, term.j)}
    felt = np.zeros(of.k, bool)
    for end in ends:
        felt[of.system.ends[end].columns] = True
    return felt


def inverse(J: sp.csr_array, C: Matrix) -> Inverse:
    """Of scaled equations; where constraints C, the last of them, repeat each other, with multipliers of least size.

    Raises
    ------
    SolveError
        If the equations do not determine all unknowns.
    """
    size, n = np.linalg.norm(C, axis=1), J.shape[0]
    some = size > REPEATED * size.max(initial=0.0)  # one that says nothing is rounding of any direction
    unit = C * np.where(some, 1 / np.where(some, size, 1.0), 0.0)[:, None]
    R, order = qr(unit.T, mode="r", pivoting=True)
    independent = order[: int((np.abs(np.diag(R)) > REPEATED).sum())] if len(C) else order[:0]
    first = n - len(C)
    kept = np.concatenate([np.arange(first), first + np.sort(independent)])
    own = J[kept][:, kept]
    rows = 1 / np.maximum(abs(own).max(axis=1).toarray().ravel(), TINY)
    scaled = sp.diags_array(rows) @ own
    columns = 1 / np.maximum(abs(scaled).max(axis=0).toarray().ravel(), TINY)
    try:
        factors = splu(sp.csc_array(scaled @ sp.diags_array(columns)))
    except RuntimeError as singular:
        raise SolveError(f"analysis.solver: the monolithic solver's equations must be regular, got {singular}") from None
    least = np.linalg.pinv(C.T, rcond=REPEATED) @ C.T if len(independent) < len(C) else np.eye(len(C))

    def solution(right: Column) -> Column:
        out = np.zeros(n)
        out[kept] = factors.solve(right[kept] * rows) * columns
        out[first:] = least @ out[first:]
        return out

    return solution
