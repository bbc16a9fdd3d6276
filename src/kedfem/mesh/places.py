"""Points in messages about meshes and parts, in millimetres, as in CAD and in the tables of `kedfem mesh`."""

from collections.abc import Iterable


def in_mm(X: Iterable[float]) -> str:
    """A point [m] as text in millimetres.

    >>> in_mm((0.0127, -0.005, 0.0))
    '(12.7, -5, 0) mm'
    """
    return "({:.5g}, {:.5g}, {:.5g}) mm".format(*(round(1e3 * float(x), 6) + 0.0 for x in X))
