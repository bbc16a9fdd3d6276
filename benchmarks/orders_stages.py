"""Marches of the linear equation by stages: diagonally implicit or coupled, with constraints whose directions vary.

A stage's accelerations keep constraints, (B q)'' = 0, and displacements and rates are projected onto them at the end of
each step, in the norm of mass: the equation is one of index 1, whose stages keep their order.

    M a + C (w + g a) + K (x + g² a) = f + Bᵀ m,   (B + 2 g B' + g² B'') a = −2 B' w − B'' x

with x, w of the stages before, g the step times the diagonal of A. Matrices depend on time alone: those of many steps
are inverted together.
"""

from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from benchmarks.orders_equation import SEEN, TURN, TURNS, Equation
from benchmarks.orders_schemes import Tableau, is_coupled

BLOCK = 128  # steps whose matrices are in memory together
Flat = Float[np.ndarray, " N"]
Stack = Float[np.ndarray, "n _ _"]


@dataclass
class Moving:
    """A march: displacement and rate, and the last stage's acceleration, from which an explicit first one goes on."""

    q: Flat
    v: Flat
    last: Flat | None = None


def marched(of: Equation, tableau: Tableau, steps: int) -> Float[np.ndarray, "S N"]:
    """The displacements at `SEEN` instants after so many steps in all."""
    now, out = Moving(*of.start), []
    block = _coupled_block if is_coupled(tableau) else _diagonal_block
    for first in range(0, steps, BLOCK):
        found = block(of, tableau, TURN * TURNS / steps, range(first, min(first + BLOCK, steps)), now)
        out += [q for k, q in enumerate(found, first + 1) if k % (steps // SEEN) == 0]
    return np.array(out)


def _diagonal_block(of: Equation, tableau: Tableau, h: float, steps: range, now: Moving) -> list[Flat]:
    """Steps with stages one after the other; the displacement after each."""
    A, b, c = tableau
    s, N, out = len(b), len(of.M), []
    along = of.along(((np.array(steps)[:, None] + c) * h).clip(0.0).ravel())
    (K, C), B = along.all_matrices(), along.constraints
    g = np.tile(h * A.diagonal(), len(steps))[:, None, None]
    solve = _inverses(of.M + g * C + g * g * K, B[:, 0], B[:, 0] + 2 * g * B[:, 1] + g * g * B[:, 2])
    ends = _Ends(of, h * (np.array(steps) + 1.0))
    V, a = np.zeros((2, s, N))
    for n in range(len(steps)):
        for i in range(s):
            k, own = n * s + i, h * A[i, i]
            if own == 0.0 and now.last is not None:
                V[i], a[i] = now.v, now.last
                continue
            w = now.v + h * A[i, :i] @ a[:i]
            x = now.q + h * A[i, :i] @ V[:i] + own * w
            right = along.f[k] - C[k] @ w - K[k] @ x
            a[i] = solve[k] @ np.concatenate([right, -2 * B[k, 1] @ w - B[k, 2] @ x])
            V[i] = w + own * a[i]
        now.last = a[-1].copy()
        now.q, now.v = ends.projected(n, now.q + h * b @ V, now.v + h * b @ a)
        out.append(now.q)
    return out


def _coupled_block(of: Equation, tableau: Tableau, h: float, steps: range, now: Moving) -> list[Flat]:
    """Steps with stages as one system."""
    A, b, c = tableau
    A2, s, N, out = A @ A, len(b), len(of.M), []
    along = of.along(((np.array(steps)[:, None] + c) * h).ravel())
    (K, C), B = along.all_matrices(), along.constraints
    K, C, B = (x.reshape(len(steps), s, *x.shape[1:]) for x in (K, C, B))
    r = B.shape[3]
    left, rows, kept = (np.zeros((len(steps), s * m, s * n)) for m, n in ((N, N), (r, N), (r, N)))
    for i in range(s):
        for j in range(s):
            p, square, to = h * A[i, j], h * h * A2[i, j], slice(j * N, (j + 1) * N)
            own = float(i == j)
            left[:, i * N : (i + 1) * N, to] = own * of.M + p * C[:, i] + square * K[:, i]
            rows[:, i * r : (i + 1) * r, to] = own * B[:, i, 0] + 2 * p * B[:, i, 1] + square * B[:, i, 2]
            kept[:, i * r : (i + 1) * r, to] = own * B[:, i, 0]
    solve = _inverses(left, kept, rows)
    ends = _Ends(of, h * (np.array(steps) + 1.0))
    for n in range(len(steps)):
        x = now.q + h * np.outer(c, now.v)
        right = [along.f[n * s + i] - C[n, i] @ now.v - K[n, i] @ x[i] for i in range(s)]
        asked = [-2 * B[n, i, 1] @ now.v - B[n, i, 2] @ x[i] for i in range(s)]
        a = (solve[n] @ np.concatenate(right + asked)).reshape(s, N)
        now.q, now.v = ends.projected(n, now.q + h * now.v + h * h * b @ A @ a, now.v + h * b @ a)
        out.append(now.q)
    return out


class _Ends:
    """Projections at the ends of steps, to the nearest displacement and rate that keep constraints, by mass."""

    def __init__(self, of: Equation, t: Flat) -> None:
        self.B = of.along(t).constraints
        self.free = not self.B.shape[2]
        self.solve = _inverses(np.broadcast_to(of.M, (len(t), *of.M.shape)), self.B[:, 0], self.B[:, 0])

    def projected(self, n: int, q: Flat, v: Flat) -> tuple[Flat, Flat]:
        """At the end of the step of a number in the block."""
        if self.free:
            return q, v
        B, N = self.B[n], len(q)
        q = q - self.solve[n][:, N:] @ (B[0] @ q)
        return q, v - self.solve[n][:, N:] @ (B[0] @ v + B[1] @ q)


def _inverses(A: Stack, B: Stack, rows: Stack) -> Stack:
    """What gives x of A x − Bᵀ m = right, rows x = target, from both."""
    (count, N), r = A.shape[:2], B.shape[1]
    size = float(np.abs(np.diagonal(A, axis1=1, axis2=2)).mean())
    whole = np.zeros((count, N + r, N + r))
    whole[:, :N, :N], whole[:, :N, N:], whole[:, N:, :N] = A, -size * B.transpose(0, 2, 1), rows
    return np.asarray(np.linalg.inv(whole)[:, :N])
