"""Large bodies of a system, with sparse factors that are solved between the compiled parts of a step.

Their coordinates are nodal rows, component first, so that their mass is not one. A compiled step needs Ã⁻¹ r of its
right-hand side, once a step, or once a pass of bodies with co-rotational frames: by compiled triangular solves, or by a
call out of compiled code where the factor is too large to be copied from CHOLMOD.
"""

import ctypes
from collections.abc import Callable, Sequence
from contextlib import AbstractContextManager, nullcontext
from dataclasses import dataclass, field
from functools import cache, partial
from typing import Any

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float, Int
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.ports import port_columns
from kedfem.dynamics.matrices.cholesky import Cholesky
from kedfem.dynamics.matrices.dense import DensePart
from kedfem.dynamics.matrices.substructure import Substructure
from kedfem.dynamics.stepping.state import Nodal
from kedfem.dynamics.system.arrays import Masses, ends_of
from kedfem.dynamics.system.state import Trial
from kedfem.links.record import Link
from kedfem.processes import caught_in

TAKEN = 30_000  # unknowns up to which a factor is: for a moment that takes four times its memory
ARRAYS = 13  # that such a factor is used with
SHIFT = 1e-9  # of the mean eigenvalue: what makes the stiffness of a free link definite
Held = Callable[[Nodal], tuple[Nodal, Float[np.ndarray, " q"]]]


@dataclass(frozen=True, slots=True)
class SparsePart:
    """A body held at its interface points by a sparse factor, in nodal coordinates, component first.

    components : d; held : r (n, d) → G r (n, d), Yᵀ r (q,)
    solve : r (n, d) → Ã⁻¹ r (n, d); no more where the factor was taken
    Y : (N, q); S : (q, q); W : (q, N)
    T : none: coordinates are nodal rows; G : none
    arrays : see `compiled_arrays`
    """

    components: int
    held: Held
    solve: Callable[[Nodal], Nodal]
    arrays: tuple[np.ndarray, ...]
    Y: Float[np.ndarray, "N q"]
    S: Float[np.ndarray, "q q"]
    W: Float[np.ndarray, "q N"]
    T: tuple[np.ndarray, ...] = ()
    unit: bool = True
    G: Float[np.ndarray, "_ _"] = field(default_factory=lambda: np.zeros((0, 0)))


Part = DensePart | SparsePart


def sparse_part(link: Link, joint: Attachment, of: Substructure) -> SparsePart:
    """A link whose matrix is factored and condensed onto its interface points, seen from these.

    A sparse factor that is not too large is taken from the substructure, which solves no more.
    """
    order, q = component_order(link), len(joint.keep)
    W, S = port_columns(joint, link.n)[order].T, of.S[:, :q]
    factor = of.factor if link.unknowns <= TAKEN else None
    arrays = compiled_arrays(of, factor, order, W)

    def held(r: Nodal) -> tuple[Nodal, Float[np.ndarray, " q"]]:
        y = of.solve(r)
        at_ports = of.S @ of.seen(y)
        return y - (of.Y @ at_ports).reshape(y.shape), at_ports[:q]

    return SparsePart(
        link.d, compiled_held(arrays, link.d, q) if factor else held, of.solve, arrays, (of.Y @ S)[order], S[:q], W
    )  # fmt: skip


def compiled_arrays(
    of: Substructure, factor: Cholesky | None, order: Int[np.ndarray, " N"], W: Float[np.ndarray, "q N"]
) -> tuple[np.ndarray, ...]:
    """What `products_kernel` works with: the triangle's arrays, C row by row, S, Y, and room for two vectors.

    Parameters
    ----------
    factor : which is taken; without one arrays of the triangle are empty
    order : of `component_order`
    """
    place = np.empty(len(order), int)
    place[order] = np.arange(len(order))
    E = np.zeros((len(of.anchors), len(order)))
    E[np.arange(len(E)), place[of.anchors]] = 1.0
    C = sp.csr_array(np.concatenate([W, E]))
    triangle: tuple[np.ndarray, ...] = (np.zeros(0, int),) * 6
    if factor is not None:
        x = factor.taken()
        triangle = x.first, x.below_at, x.below, x.at, x.L, place[x.place]
    made = (
        *triangle, C.indptr.astype(int), C.indices.astype(int), C.data,
        of.S.ravel(), of.Y[order].T.ravel(), *np.zeros((2, max(C.shape))),
    )  # fmt: skip
    return tuple(np.ascontiguousarray(each) for each in made)


def compiled_held(arrays: tuple[np.ndarray, ...], d: int, q: int) -> Held:
    """`SparsePart.held` by compiled code."""

    def held(r: Nodal) -> tuple[Nodal, Float[np.ndarray, " q"]]:
        from kedfem.dynamics.system.products_kernel import held_alone

        g, reaction = np.empty(r.size), np.empty(q)
        held_alone(addresses(arrays)[None], np.ascontiguousarray(r.T, float).ravel(), g, reaction)
        return g.reshape(d, -1).T, reaction

    return held


def addresses(arrays: Sequence[np.ndarray]) -> Int[np.ndarray, "a 2"]:
    """Where arrays are, and how many numbers each has."""
    return np.array([(x.ctypes.data, x.size) for x in arrays], int).reshape(-1, 2)


def address_tables(parts: Sequence[Part]) -> Int[np.ndarray, "i a 2"]:
    """Addresses of all sparse bodies' arrays, which must be kept as long as they are used."""
    out = np.zeros((len(parts), ARRAYS, 2), int)
    for row, part in zip(out, parts, strict=True):
        if isinstance(part, SparsePart):
            row[:] = addresses(part.arrays)
    return out


def component_order(link: Link) -> Int[np.ndarray, " N"]:
    """Where each component-first coordinate stands among nodal rows laid flat."""
    return np.arange(link.unknowns).reshape(link.n, link.d).T.ravel()


def momentum(link: Link, x: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
    """M x of a sparse body."""
    return np.concatenate([m @ each for m, each in zip(link.mass, x.reshape(link.d, -1), strict=True)])


def softening(link: Link) -> float:
    """What of its mass makes the stiffness of a free link definite, a share of the mean eigenvalue [1/s²]."""
    return SHIFT * float(link.K0.diagonal().sum() / sum(m.diagonal().sum() for m in link.mass))


def mass_of(link: Link) -> float:
    """√ of the mass of a link for each of its functions [kg^½]."""
    return float(np.sqrt(link.one @ link.m1[:, 0] / link.n))


def mass_tables(links: Sequence[Link], parts: Sequence[Part]) -> Masses:
    """Matrices m of all components of sparse bodies, each once, and of each row what ends at its diagonal."""
    of, every = np.full((len(links), 3), -1), dict[int, tuple[int, Any]]()
    for row, link, part in zip(of, links, parts, strict=True):
        for c, m in enumerate(link.mass if isinstance(part, SparsePart) else ()):
            row[c] = every.setdefault(id(m), (len(every), _lower(m)))[0]
    return _row_by_row(of, [m for _, m in every.values()])


def stiffness_tables(links: Sequence[Link], parts: Sequence[Part], which: Sequence[bool]) -> Masses:
    """K0 of some of the sparse bodies, in the order of their coordinates."""
    of, every = np.full((len(links), 3), -1), list[sp.csr_array]()
    for row, link, part, wanted in zip(of, links, parts, which, strict=True):
        if wanted and isinstance(part, SparsePart):
            row[0], order = len(every), component_order(link)
            every.append(sp.csr_array(sp.csr_array(link.K0)[order][:, order]))
    return _row_by_row(of, every)


def _lower(m: Any) -> sp.csr_array:
    """The lower triangle of a matrix, rows in order of columns; what is on its diagonal is there, be it zero."""
    below, n = sp.tril(m, -1, format="coo"), np.arange(m.shape[0])
    row, column = np.concatenate([below.row, n]), np.concatenate([below.col, n])
    return sp.csr_array((np.concatenate([below.data, m.diagonal()]), (row, column)), shape=m.shape)


def _row_by_row(of: Int[np.ndarray, "L 3"], every: Sequence[Any]) -> Masses:
    ends = ends_of([m.nnz for m in every])
    none = np.zeros(1, int)
    return Masses(
        of,
        ends_of([m.shape[0] + 1 for m in every]),
        np.concatenate([none, *(m.indptr + end for m, end in zip(every, ends, strict=False))])[1:],
        np.concatenate([none, *(m.indices for m in every)])[1:].astype(np.uint32),  # else asked whether it is negative
        np.concatenate([np.zeros(1), *(m.data for m in every)])[1:],
    )


def solver(parts: Sequence[Part], at: Int[np.ndarray, " _"], trial: Trial) -> Any:
    """What a compiled step calls with the number of a sparse body whose factor was not taken: trial.held from trial.r.

    It must be kept as long as the step runs.
    """
    every = {
        k: (part, slice(at[k], at[k + 1]))
        for k, part in enumerate(parts) if isinstance(part, SparsePart) and not part.arrays[0].size
    }  # fmt: skip

    failed: list[BaseException] = []

    def solved(k: int) -> int:
        if not failed:
            try:
                part, here = every[k]
                y = part.solve(trial.r[here].reshape(part.components, -1).T)
                trial.held[here].reshape(part.components, -1)[:] = y.T
            except BaseException as error:  # noqa: BLE001  (an interruption too: ctypes would print it and go on)
                failed.append(error)
        return 0

    watched = partial(caught_in, solved.__code__, failed.append) if every else nullcontext
    return _kind_of_call()(solved, failed, watched)


@cache
def _kind_of_call() -> Any:
    """The class of functions that compiled steps call, one for all: numba takes a while to know another."""
    from numba.core import types
    from numba.experimental import function_type  # noqa: F401  (makes numba know such arguments)

    class Called(types.WrapperAddressProtocol):
        def __init__(
            self,
            solved: Callable[[int], int],
            failed: list[BaseException],
            watched: Callable[[], AbstractContextManager[None]],
        ) -> None:
            self.kept = ctypes.CFUNCTYPE(ctypes.c_int64, ctypes.c_int64)(solved)
            self.failed = failed
            self.watched = watched
            """What a signal raises as a call begins or ends counts as raised within it."""

        def __wrapper_address__(self) -> int:
            return int(ctypes.cast(self.kept, ctypes.c_void_p).value or 0)

        def signature(self) -> Any:
            return types.int64(types.int64)

        def check(self) -> None:
            """Raise what was raised within a call."""
            if self.failed:
                raise self.failed[0]

    return Called
