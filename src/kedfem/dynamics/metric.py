"""Tables of the elements of beams in space as compiled loops take them, see `dynamics.metric_kernel`."""

from collections.abc import Sequence

import numpy as np

from kedfem.dynamics.dense import DensePart
from kedfem.links.record import BeamElement, Link

Tables = tuple[np.ndarray, ...]
DIMENSIONS = (1, 2, 2, 1, 2, 3, 2, 2, 2, 1, 1, 2, 2, 2)
WHOLE_NUMBERS = (0, 3, 13)  # sizes, node, pairs


def element_tables(links: Sequence[Link], parts: Sequence[DensePart]) -> Tables:
    """Of all links that are elements of beams in space, padded to the largest; in the coordinates of their parts."""
    which = [k for k, link in enumerate(links) if link.element is not None]
    number, width = np.full(len(links), -1), max(link.n for link in links)
    number[which] = np.arange(len(which))
    every = [(links[k], links[k].element, parts[k]) for k in which]
    made = [_own(link, element, part, width) for link, element, part in every if element is not None]
    tables = (
        _padded([own[k] for own in made], size, int if k in WHOLE_NUMBERS else float)
        for k, size in enumerate(DIMENSIONS)
    )
    return number, *tables


def _own(link: Link, x: BeamElement, part: DensePart, width: int) -> Tables:
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
