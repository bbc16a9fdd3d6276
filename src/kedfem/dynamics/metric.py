"""Arrays of the elements of beams in space for the compiled loops of `dynamics.metric_kernel`."""

from collections import namedtuple
from collections.abc import Sequence

import numpy as np

from kedfem.dynamics.matrices.dense import Coordinates
from kedfem.links.record import BeamElement, Link

Tables = tuple[np.ndarray, ...]
DIMENSIONS = (1, 2, 2, 1, 2, 3, 2, 2, 2, 1, 1, 2, 2, 2)
WHOLE_NUMBERS = (0, 3, 13)  # sizes, node, pairs


class Elements(namedtuple("Elements", (
    "number sizes tangents gradients node drawn directors N D bend stiffness drawn_strains rows share pairs"
))):  # fmt: skip
    """All elements of beams in space, b of them, as `links.record.BeamElement` has each; filled up with zeros.

    number : (L,) of a segment's element among these, -1 of others
    sizes : (b, 4) Gauss points E, nodes m, gradient functions K, pairs P
    tangents, gradients : (b, E, S), (b, K, S) from coordinates
    node, drawn, directors, N, D, bend, pairs : (b, K), (b, K, 3), (b, m, 2, 3), (b, E, m) twice, (b, E, 4), (b, P, 2)
    stiffness, drawn_strains : (b, s); rows, share : (b, s, 3 S), (b, 3 S, s) strains of coordinates, and back
    """


def element_tables(links: Sequence[Link], parts: Sequence[Coordinates]) -> Elements:
    """Of all links that are elements of beams in space; in the coordinates of their parts."""
    which = [k for k, link in enumerate(links) if link.element is not None]
    number, width = np.full(len(links), -1), max(link.n for link in links)
    number[which] = np.arange(len(which))
    every = [(links[k], links[k].element, parts[k]) for k in which]
    made = [_own(link, element, part, width) for link, element, part in every if element is not None]
    tables = (
        _padded([own[k] for own in made], size, int if k in WHOLE_NUMBERS else float) for k, size in enumerate(DIMENSIONS)
    )
    return Elements(number, *tables)


def room_for(elements: Elements) -> Tables:
    """Of one element at a time: rotations of nodes, x', d, g, forces on d, g and x', strains, stresses."""
    K, M = elements.node.shape[1], elements.directors.shape[1]
    E, s = elements.N.shape[1], elements.stiffness.shape[1]
    shapes = ((M, 3, 3), (E, 3), (M, 2, 3), (K, 3), (M, 2, 3), (K, 3), (E, 3), (s,), (s,))
    return tuple(np.zeros(shape) for shape in shapes)


def _own(link: Link, x: BeamElement, part: Coordinates, width: int) -> Tables:
    """Sizes and arrays of one element: rows of the position become rows of coordinates, y = T x, component first."""
    T, n, s = part.T[0], link.n, len(x.stiffness)
    sizes = np.array([len(x.tangents), len(x.directors), len(x.node), len(x.pairs)])
    rows, share = np.zeros((s, 3, width)), np.zeros((3, width, s))
    rows[:, :, :n] = x.rows.reshape(s, n, 3).transpose(0, 2, 1) @ T
    back = T.T @ link.mass[0]  # T⁻¹
    share[:, :n] = (back @ x.share.reshape(n, 3 * s)).reshape(n, 3, s).transpose(1, 0, 2)
    tangents, gradients = np.zeros((len(x.tangents), width)), np.zeros((len(x.node), width))
    tangents[:, :n], gradients[:, :n] = x.tangents @ T, x.gradients @ T
    return (sizes, tangents, gradients, x.node, x.drawn, x.directors, x.N, x.D, x.bend, x.stiffness,
            x.drawn_strains, rows.reshape(s, -1), share.reshape(-1, s), x.pairs)  # fmt: skip


def _padded(arrays: Sequence[np.ndarray], dimensions: int, kind: type) -> np.ndarray:
    """Arrays below each other, filled up with zeros."""
    shape = np.max([(0,) * dimensions, *(each.shape for each in arrays)], axis=0)
    out = np.zeros((len(arrays), *shape), kind)
    for each, to in zip(arrays, out, strict=True):
        to[tuple(slice(k) for k in each.shape)] = each
    return out
