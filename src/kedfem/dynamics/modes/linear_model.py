"""A linkage frozen at a position as a small linear system: its lowest modes under forces, q'' + Γ q' + Ω² q = Φᵀ F.

The static response of the truncated modes, G F, is kept, so that a constant force deflects the linkage as in the
unreduced model, x = K⁻¹ F. With s the shift of `Frozen` and A = K + s M, which is factored there, conjugate gradients in
the scalar product of M find x, less rigid-body motions, in a few steps,

    (1 − s A⁻¹ M) x = A⁻¹ F,   G F = x − Φ Ω⁻² Φᵀ F
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.modes.frozen import Frozen
from kedfem.dynamics.stepping.state import Rayleigh
from kedfem.dynamics.system.starts.initial_states import as_work
from kedfem.dynamics.system.starts.linear_equations import LinearEquations
from kedfem.errors import SolveError
from kedfem.links.record import Link
from kedfem.motion.rigid import RigidMotion

ENOUGH, MOST = 1e-12, 200  # of the right-hand side, in the norm of M: what is left of it; steps

Flat = Float[np.ndarray, " _"]
Shapes = tuple[Float[np.ndarray, "_ n d"], ...]


@dataclass(frozen=True, slots=True)
class LinearModel:
    """Lowest modes of unit mass, f of them, under i inputs.

    omega : (f,) natural circular frequencies [rad/s], zero of motions without strain
    damping : (f, f) Γ [1/s]
    force : (f, i) Φᵀ F of each input at one [kg^½ m/s²]
    shapes : per link (f, n, d) Φ, world components [kg^-½]
    answer : per link (i, n, d) G F of each input [m]
    turned, answered : (e, f), (e, i) coordinates of the force elements that were asked for, of modes and in G F
    """

    omega: Float[np.ndarray, " f"]
    damping: Float[np.ndarray, "f f"]
    force: Float[np.ndarray, "f i"]
    shapes: Shapes
    answer: Shapes
    turned: Float[np.ndarray, "e f"]
    answered: Float[np.ndarray, "e i"]


def linear_model(
    frozen: Frozen,
    motion: RigidMotion,
    damping: tuple[Rayleigh, Sequence[Link]],
    loads: Sequence[Sequence[Float[np.ndarray, "n d"]]],
    elements: Sequence[int],
) -> LinearModel:
    """The modes of a frozen linkage under loads and the efforts of force elements, in this order.

    Parameters
    ----------
    motion : of one time
    damping : α M + β K0 and the links whose K0 that is; α damps vibrations, no motion without strain; dampers of joints
        and force elements damp beside it
    loads : of each the nodal forces on all links, world components [N]
    elements : numbers of constraints of the system, whose laws push along their coordinates

    Raises
    ------
    UnstableError
        If a motion away from the position would grow by itself.
    """
    omega, _, x = frozen.modes(motion)
    now, balance = frozen.balance(motion)
    rest = np.zeros(frozen.system.unknowns)
    C = now.gradients(rest)
    count = len(loads) + len(elements)
    r, f = np.zeros((len(x), count)), np.zeros((len(rest), count))
    for n, each in enumerate(loads):
        r[:, n] = as_work(frozen.of, each)
    f[:, len(loads) :] = C[list(elements)].T.toarray()
    Mx = frozen.momentum(x)
    z = (omega**2 + frozen.shift) * _answers(balance, Mx, np.zeros((len(f), len(omega))))[1]
    soft = np.divide(1.0, omega**2, out=np.zeros_like(omega), where=omega > 0)[:, None]
    kept = soft * (x.T @ r + z.T @ f)
    whole, moved = _constant(frozen, balance, (x[:, omega == 0], z[:, omega == 0]), (r, f))
    answer, answered = whole - x @ kept, moved - z @ kept
    turned, rates = C @ z, now.forces(now.coordinates(np.stack([rest] * 3)))[:, 2]
    shapes, (rayleigh, links) = frozen.per_link(x), damping
    gamma = rayleigh.alpha * np.diag(omega > 0) + rayleigh.beta * _strain(shapes, now.R, links)
    return LinearModel(
        omega, gamma + turned.T @ (rates[:, None] * turned), x.T @ r + z.T @ f,
        shapes, frozen.per_link(answer), turned[list(elements)], C[list(elements)] @ answered,
    )  # fmt: skip


def _answers(
    balance: LinearEquations, r: Float[np.ndarray, "N i"], f: Float[np.ndarray, "k i"]
) -> tuple[Float[np.ndarray, "N i"], Float[np.ndarray, "k i"]]:
    """(K + s M)⁻¹ of columns, and the interface with it."""
    x, z = np.zeros_like(r), np.zeros_like(f)
    for n in range(r.shape[1]):
        found = balance.solved(r[:, n], more=f[:, n])
        x[:, n], z[:, n] = found.x, found.z
    return x, z


def _constant(
    frozen: Frozen,
    balance: LinearEquations,
    still: tuple[Float[np.ndarray, "N m"], Float[np.ndarray, "k m"]],
    forces: tuple[Float[np.ndarray, "N i"], Float[np.ndarray, "k i"]],
) -> tuple[Float[np.ndarray, "N i"], Float[np.ndarray, "k i"]]:
    """Static response to constant forces, less rigid-body motions, with the interface.

    Parameters
    ----------
    still : motions without strain, and the interface with them
    forces : on coordinates and on the interface

    Raises
    ------
    SolveError
    """
    size, s = len(forces[0]), frozen.shift
    Mx = frozen.momentum(still[0]) if still[0].size else still[0]
    without = np.vstack(still)

    def bent(r: Float[np.ndarray, "N i"], f: Float[np.ndarray, "k i"]) -> Float[np.ndarray, "a i"]:
        """A⁻¹ of columns above the interface with it."""
        found = np.vstack(_answers(balance, r, f))
        return np.asarray(found - without @ (Mx.T @ found[:size]))

    def product(x: Float[np.ndarray, "a i"], Mx: Float[np.ndarray, "N i"]) -> Flat:
        return np.asarray((x[:size] * Mx).sum(axis=0))

    r = bent(*forces)
    x, p, M_r = np.zeros_like(r), r, frozen.momentum(r[:size])
    square = product(r, M_r)
    enough = ENOUGH**2 * square
    for _ in range(MOST):
        if (square <= enough).all():
            return x[:size], x[size:]
        M_p = frozen.momentum(p[:size])
        Tp = p - s * bent(M_p, np.zeros_like(forces[1]))
        along = product(Tp, M_p)
        step = np.divide(square, along, out=np.zeros_like(square), where=along > 0)
        x, r = x + step * p, r - step * Tp
        M_r, before = frozen.momentum(r[:size]), square
        square = product(r, M_r)
        p = r + np.divide(square, before, out=np.zeros_like(square), where=before > 0) * p
    raise SolveError(
        "state space: iterations for the static response must converge, got none that do: take another position"
    )


def _strain(shapes: Shapes, R: Float[np.ndarray, "L 3 3"], links: Sequence[Link]) -> Float[np.ndarray, "f f"]:
    """Φᵀ K0 Φ of links."""
    out = np.zeros((len(shapes[0]),) * 2)
    for u, each, link in zip(shapes, R, links, strict=True):
        g = (u @ each[: link.d, : link.d]).reshape(len(u), -1)
        out += g @ (link.K0 @ g.T)
    return out
