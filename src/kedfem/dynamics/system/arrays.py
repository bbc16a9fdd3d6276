"""Constant arrays of a step, as named tuples: coefficients of the scheme, bodies, ends and constraints.

Bodies are solved in coordinates in which their mass is one, component first: all x, then all y. Arrays hold all bodies
one after the other; `at` says where each begins.
"""

from collections import namedtuple
from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from kedfem.arrays import Int


def ends_of(sizes: Sequence[int]) -> Int[np.ndarray, " _"]:
    """Where each of some arrays begins that stand one after the other, and where the last ends."""
    return np.concatenate([[0], np.cumsum(np.array(sizes, int))])


def flat(arrays: Sequence[np.ndarray], kind: type = float) -> np.ndarray:
    """All numbers of some arrays, one after the other."""
    return np.concatenate([np.zeros(0, kind), *(np.asarray(x, kind).ravel() for x in arrays)])


def groups(ports: Sequence[Int[np.ndarray, " q"]]) -> Int[np.ndarray, " _"]:
    """Where the components of each one's interface point begin, from these points' numbers on each body."""
    starts = ends_of([len(each) for each in ports])[:-1]
    return flat([at + np.searchsorted(each, each) for at, each in zip(starts, ports, strict=True)], int)


def reach(B: Sequence[np.ndarray], ports: Sequence[Int[np.ndarray, " q"]]) -> Int[np.ndarray, "c 2"]:
    """First row of each column of each Rᵀ B that may have something, and the one after the last: (0, 0) of none.

    Parameters
    ----------
    B : (q, c) of each body
    ports : number of the interface point of each row, in rising order
    """
    out = [np.zeros((0, 2), int)]
    for each, port in zip(B, ports, strict=True):
        for column in each.T != 0:
            rows = np.flatnonzero(np.isin(port, port[column]))
            out.append(np.array([[rows[0], rows[-1] + 1]] if len(rows) else [[0, 0]]))
    return np.concatenate(out)


class Coefficients(NamedTuple):
    """Of one member of generalised-α at a fixed step, and of Rayleigh damping.

    c_M [1/s²], c_K [-] : of A = c_M M + c_K K0
    acceleration, rate : (3,) Newmark's formulas, see `dynamics.stepping.scheme`
    h, late, early : step, h γ, h (1 − γ) [s]
    alpha [1/s], beta [s] : C0 = α M + β K0
    tolerance, floor : change of a pass, of what a step moves and at least [-, kg^½ m]
    weight : of interface unknowns beside coordinates [kg^½]
    single : whether all is linear, so that one pass solves a step
    """

    c_M: float
    c_K: float
    alpha_m: float
    alpha_f: float
    acceleration: Any
    rate: Any
    h: float
    late: float
    early: float
    alpha: float
    beta: float
    tolerance: float
    floor: float
    weight: float
    single: bool


class Beams(namedtuple("Beams", "segment body at stride rows tangent rigidity")):
    """Planar beams with strains at points, as `beams_kernel` takes them."""


class FollowerLoads(namedtuple("FollowerLoads", (
    "body force_at shown_at planar_beam drawn shown force axis fixed"
))):  # fmt: skip
    """Loads that turn with bodies, as directions shown by the body turn; see `follower_loads`.

    body, at : (w,) number, and where its coordinates' share of `force` and its functions' of `shown` begin, thrice those
    planar_beam : (w,) whether an angle shows how it turns
    drawn : (w, 3, 3) Σ e ⊗ e of the directions in the reference position
    shown : Σ e ⊗ of functions' weights on what they move by; of planar beams those on ψ
    force : on the body's coordinates, components in the reference position
    axis, fixed : (w, 3) there and in the world, whose product a load's amount has for a factor; zero: none
    """


class Stresses(namedtuple("Stresses", "at P row_at row column_at column")):
    """Stress stiffness k g P of links with geometric stiffening, see `stresses`.

    at : (i + 1,) where the entries of k of each begin; P : (i, 3, 3) what they act on of components
    row_at, row, column_at, column : of sparse bodies k's pattern, row by row
    """


class Masses(namedtuple("Masses", "of at row column value")):
    """Matrices of sparse bodies, whose coordinates are nodal: of components, row by row, one after the other.

    of : (i, 3) number of the matrix of each component; at : where its rows' ends begin in `row`
    """


class Bodies(namedtuple("Bodies", (
    "at functions components motion frame kind dense arrays passed port_at component group G_at Y_at S_at B_at "
    "G Y W S B column_at columns reach place first row_at multiplier X one fit K beams elements mass turning "
    "stiffness size rigid stresses"
))):  # fmt: skip
    """All bodies as flat arrays, constant; i counts bodies.

    at : (i + 1,) where the coordinates of each begin; functions, components : n and d; motion : number in the linkage
    frame, kind : NOMINAL, STRESSED, COROTATIONAL or TANGENTIAL; as `frames_kernel` counts kinds
    dense : whether G, Y and W are here; else a sparse factor gives Ã⁻¹ r, coordinates are nodal and `mass` counts
    arrays : (i, 13, 2) where what `products_kernel` works with of sparse ones is, and how many numbers; without a
        triangle Ã⁻¹ r is called for
    passed : where its coordinates stand among those that passes change, −1 if none
    port_at : (i + 1,) held components q; component : of each; group_at : (i + 2...) where interface points begin
    G, Y, W : N × N, q × N, q × N of each, in `G_at`, `Y_at`; S, B : q × q and q × c, in `S_at`, `B_at`
    column_at, columns : interface unknowns that each body knows; reach : (c, 2) rows that Rᵀ B may have of each, from
        the first to the last
    place, first, row_at, multiplier : row of each of these in the matrix of the interface, and its profile, see `Profile`
    X, one, fit : coordinates of position and of unity, and the frames' weights; K : N × N of co-rotational ones
    beams : those that know their strains at points; elements : of beams in space, whose strains need no frame
    turning : follower loads
    stiffness : K0 of sparse co-rotational bodies, row by row, the number of its matrix first in `of`
    size : √ of the mass that a coordinate of a body counts with where passes are judged: one of dense ones [kg^½]
    rigid : whether it is so stiff that passes foresee K of its strain, see `unforeseen`
    """


class Ends(namedtuple("Ends", (
    "body form origin directions lengths known components column_at columns onto_at onto line line_at full_at "
    "full number free axis knots cubic_at cubics weights slopes pin"
))):  # fmt: skip
    """All ends as flat arrays; see `End`.

    line, line_at, full_at, full : ends on lines of slots, where their stations' weights begin, and what these stations
        have of z: a step makes `onto` of them
    number : (E,) of each end's line, −1: none; free : whether its pin is where both links are, as for `ON_LINES`
    axis, knots : (L, 3) their reference directions, and (n,) places of all stations; cubic_at, cubics : (p − 1, 4, p) of
        each the cardinal functions from each station on
    weights, slopes, pin : (n,) and (L,), where a step puts the stations' weights with their slopes, and the pins' places
    """


class Constraints(namedtuple("Constraints", (
    "term_at kind i j a a_j b factor linear law numbers drive over curve_at abscissa cubics period jumps place "
    "column_at columns"
))):  # fmt: skip
    """All constraints and laws as flat arrays; terms stand in order of their constraints.

    term_at : (r + 1,); kind, i, j, a, a_j, b, factor : of each term
    linear, law : (r,); numbers : (r, 4) of a law; drive : (r,) whose travel is taken from the coordinate, −1: none
    over, curve_at, abscissa, period : of curves; cubics : (c, 4) from each abscissa on, as `Pieces` has them
    jumps : (r,) stops with damping, whose push begins at once: a step in which it does is divided
    place : (r,) row of each in the matrix of the interface; column_at, columns : interface unknowns that each couples
    """
