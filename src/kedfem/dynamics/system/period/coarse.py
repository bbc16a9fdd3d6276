"""Two-level preconditioner for the steady motion of unreduced links: the period map of reduced ones.

    (I − Φ)⁻¹ ≈ 1 + L [(I − Φ_r)⁻¹ − 1] R

R projects a state onto the modes of the reduced links, by Qᵀ M of displacements and rates; L maps back. Φ_r
is the derivative of the period map of the system with reduced links, whose marches are cheap; its equations are solved
by GMRES. The unreduced map then needs iterations only for vibrations outside the modes, and for the modes' errors.
"""

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.matrices.dense import coordinates
from kedfem.dynamics.system.period.krylov import Derivative, gmres
from kedfem.dynamics.system.period.map import PeriodMap
from kedfem.dynamics.system.starts.instant import Flat
from kedfem.dynamics.system.starts.internal_forces import own, rows
from kedfem.links.reduced import mode_matrix

START, LATER = 1e-6, 1e-2  # what is left of the first of its equations, and of those that precondition
MOST = 60  # its marches for one of them
RESONANT = 1e-3  # |1 − μ| of a vibration of reduced links that would be taken for one that repeats itself
SAME = ("port_force", "z", "e", "term_angles", "bearing", "multiplier")  # whose meaning reduction does not change


class Coarse:
    """About (I − Φ)⁻¹ of a linear system, from reduced links.

    Parameters
    ----------
    fine, small : maps of the same system, of the second some links are reduced
    """

    def __init__(self, fine: PeriodMap, small: PeriodMap) -> None:
        self.fine, self.small = fine, small
        x = small.vector(small.start)
        self._at = x, small(x)
        small.weighed(self._at[1])
        links = zip(fine.of.system.model.links, small.of.system.model.links, strict=True)
        self._modes = [mode_matrix(less) if less is not each else None for each, less in links]
        self.usable = True

    def __call__(self, r: Flat) -> Flat:
        """About (I − Φ)⁻¹ r."""
        return self._answer(r, LATER)

    def start(self, r: Flat) -> Flat:
        """The same, as closely as reduced links show."""
        return self._answer(r, START)

    def _answer(self, r: Flat, left: float) -> Flat:
        reduced = self._moved(r, self.fine, self.small)
        size = self.small.whole(reduced)
        if not self.usable or not size > 0.0:
            return r
        found = gmres(Derivative(self.small, *self._at, size), reduced, left * size, MOST)
        self.usable = found.nearest > RESONANT
        return r + self._moved(found.d - reduced, self.small, self.fine) if self.usable else r

    def _moved(self, x: Flat, source: PeriodMap, target: PeriodMap) -> Flat:
        """A difference of vectors of one map as that of the other."""
        old, new = source.state(x), target.state(np.zeros_like(target.vector(target.start)))
        for k in range(len(self._modes)):
            for name in "uva":
                moved = self._rows(k, rows(source.of, k, getattr(old, name)[own(source.of, k)]), target)
                link, part = target.of.system.model.links[k], target.of.parts[k]
                getattr(new, name)[own(target.of, k)] = coordinates(link, part, moved).ravel()
        for name in SAME:
            getattr(new, name)[...] = getattr(old, name)
        target.complete(new)
        return target.vector(new)

    def _rows(self, k: int, x: Float[np.ndarray, "_ d"], target: PeriodMap) -> Float[np.ndarray, "_ d"]:
        """Nodal rows of body k, or amounts of its modes, as those of the other map."""
        Q, mass = self._modes[k], self.fine.of.system.model.links[k].mass
        if Q is None:
            return x
        if target is self.fine:
            return np.asarray(Q @ x)
        return np.stack([Q.T @ np.asarray(m @ x[:, c]) for c, m in enumerate(mass[: x.shape[1]])], axis=1)
