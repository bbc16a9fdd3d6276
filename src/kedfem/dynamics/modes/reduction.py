"""Modes for reduced links: those that the loads of the scene excite.

The linkage is frozen at some instants of the motion. Its static deflection under P − M R0'' and the vibration modes that
this deflection excites (Lanczos steps K⁻¹ M on the whole linkage, drive fixed) represent the motion of its links. Their
scalar components are sorted by strain energy, and the first few make the basis.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.constraint_matrices import constraint_matrices
from kedfem.dynamics.matrices.closed import closed
from kedfem.dynamics.matrices.substructure import Substructure, factored
from kedfem.dynamics.model import Model
from kedfem.dynamics.rigid_elements import Acting, nothing, whole_forcings
from kedfem.dynamics.stepping.state import NodalOf
from kedfem.links.record import Link, mass_times_over
from kedfem.links.reduced import (
    mass_orthonormal,
    mode_matrix,
    rigid_body_functions,
    scalar_block,
    stiffness_blocks,
    wave_frequency,
)
from kedfem.motion.rigid import RigidMotion

LANCZOS = 6  # modes of the linkage per instant (docs/performance/reduction.md)
INDEPENDENT = 1e-14  # of the largest energy: modes below repeat others
SOFT = 1e-3  # of the first axial frequency of a link: what mass holds of a free linkage
REPEATED = 1e-9  # of a deflection: what is left of it beside those before is rounding

Rows = Float[np.ndarray, "T _ _"]


@dataclass(frozen=True, slots=True)
class Basis:
    """Modes of one link, most important first.

    needed : (n, k) modes of every basis: 1, position, one mode per port
    modes : (n, f) orthonormal in strain energy to those and to each other
    weights : (f,) share of the training deflections' strain-energy norm that each carries [-]
    """

    needed: Float[np.ndarray, "n k"]
    modes: Float[np.ndarray, "n f"]
    weights: Float[np.ndarray, " f"]

    def first(self, count: int) -> Float[np.ndarray, "n s"]:
        """The needed modes and as many others as make up the count."""
        more = max(0, count - self.needed.shape[1])
        return np.concatenate([self.needed, self.modes[:, :more]], axis=1)

    def count(self, tolerance: float) -> int:
        """The number of modes whose truncation error is no more than a part of the strain-energy norm."""
        left = np.sqrt(np.cumsum((self.weights**2)[::-1])[::-1])
        return int(self.needed.shape[1] + np.count_nonzero(left > tolerance))


def static_parts(model: Model, free: bool = False) -> list[Substructure]:
    """All links factored with A = K0; with so little of their mass where motions are free that only these take forces.

    Then what balances no force accelerates as a rigid body.
    """
    shift = SOFT**2 * min((wave_frequency(link) ** 2 for link in model.links if not link.rigid), default=0.0) * free
    return [factored(link, joint, shift, 1.0) for link, joint in zip(model.links, model.joints, strict=True)]


def excited(
    model: Model, parts: Sequence[Substructure], motion: RigidMotion, acting: Acting = nothing
) -> list[list[NodalOf]]:
    """Static deflections at the times of a motion, with their shares in modes of the frozen linkage; per link.

    Parameters
    ----------
    acting : forces of motors and springs in the rigid-body motion, and such as are released at the start
    """
    out: list[list[NodalOf]] = [[] for _ in model.links]
    krylov = _krylov(model, parts, motion, acting)
    shares = np.array([_dots(M_b, krylov.static) for M_b in krylov.images])  # (l, T)
    for t, found in enumerate(krylov.found):
        Z = np.linalg.eigh(krylov.T[t, :found, :found])[1]
        Z = Z * (Z.T @ shares[:found, t])
        for k, kept in enumerate(out):
            kept.append(krylov.static[k][t])
            if found:
                several = np.stack([each[k][t] for each in krylov.vectors[:found]])
                kept += list(np.tensordot(Z.T, several, axes=1))
    return out


def frozen_frequencies(model: Model, parts: Sequence[Substructure], motion: RigidMotion) -> list[Float[np.ndarray, " f"]]:
    """Lowest circular frequencies of the linkage standing still, drive held, among modes that its loads excite [rad/s].

    1/ω² are Ritz values of K⁻¹ M: the first is good, those after it less and less. None where nothing is loaded.
    """
    out, krylov = [], _krylov(model, parts, motion)
    for T, found in zip(krylov.T, krylov.found, strict=True):
        values = np.linalg.eigvalsh(T[:found, :found])[::-1]
        out.append(np.asarray(1 / np.sqrt(values[values > REPEATED * values[:1]])))
    return out


class _Krylov:
    """Mass-orthonormal deflections b of a linkage frozen at some times by K⁻¹ M from its static ones, M b, and
    T = Bᵀ M K⁻¹ M B.

    static : (T, n, d) of each link; vectors, images : the same of each level, zero at times with fewer levels
    T : (T, l, l); found : (T,) levels at each time
    """

    def __init__(self, model: Model, static: list[Rows]) -> None:
        self.static = static
        self.vectors: list[list[Rows]] = []
        self.images: list[list[Rows]] = []
        self.T = np.zeros((len(static[0]), LANCZOS, LANCZOS))
        self.found = np.zeros(len(static[0]), int)
        self._model, self._next, self._size = model, static, _mass_norms(model, static)[0]

    def grows(self) -> bool:
        """Whether there is one more deflection b at any time, the last of `vectors`; K⁻¹ M b is to be given to `add`."""
        x, level = self._next, len(self.vectors)
        for _ in range(2):
            for b, M_b in zip(self.vectors, self.images, strict=True):
                c = _dots(M_b, x)[:, None, None]
                x = [y - c * z for y, z in zip(x, b, strict=True)]
        size, Mx = _mass_norms(self._model, x)
        grown = (self.found == level) & (size > REPEATED * self._size)
        self.found += grown
        factor = np.where(grown, 1 / np.where(grown, size, 1.0), 0.0)[:, None, None]
        self.vectors.append([y * factor for y in x])
        self.images.append([y * factor for y in Mx])
        return bool(grown.any())

    def add(self, x: list[Rows]) -> None:
        """The static deflections K⁻¹ M b under the last ones' inertia."""
        self._next, self._size = x, _mass_norms(self._model, x)[0]
        level = len(self.vectors) - 1
        for k, M_b in enumerate(self.images):
            self.T[:, level, k] = self.T[:, k, level] = _dots(M_b, x)


def _krylov(model: Model, parts: Sequence[Substructure], motion: RigidMotion, acting: Acting = nothing) -> _Krylov:
    """Of the linkage frozen at the times of a motion, from its static deflection under P − M R0'' there, link frames."""
    forcing = whole_forcings(model, motion, acting)
    frozen = closed(parts, [x.R for x in forcing], constraint_matrices(model.rows, motion, model.interface_unknowns))
    found = _Krylov(model, list(frozen.deflections([x.F @ x.R for x in forcing])))
    for _ in range(LANCZOS):
        if not found.grows():
            break
        found.add(list(frozen.deflections(found.images[-1])))
    return found


def _mass_norms(model: Model, x: Sequence[Rows]) -> tuple[Float[np.ndarray, " T"], list[Rows]]:
    """√(xᵀ M x) of the linkage at each time, and M x."""
    Mx = [mass_times_over(link.mass, y) for link, y in zip(model.links, x, strict=True)]
    return np.sqrt(np.maximum(_dots(x, Mx), 0.0)), Mx


def energy_sorted(link: Link, ports: Float[np.ndarray, "n p"], deflections: Sequence[Float[np.ndarray, "n d"]]) -> Basis:
    """Scalar components of deflections, orthonormal in an energy-like product and sorted by their weight in it."""
    H = energy_product(link)
    S = np.concatenate(deflections, axis=1)
    rigid = mass_orthonormal(link, rigid_body_functions(link))
    S, E = (x - rigid @ (rigid.T @ np.asarray(link.mass[0] @ x)) for x in (S, ports))
    E = orthonormal(E, H, 1e-10)[0]
    S = S - E @ (E.T @ np.asarray(H @ S))
    modes, weights = orthonormal(S, H, INDEPENDENT)
    size = np.sqrt((weights**2).sum()) or 1.0
    return Basis(np.concatenate([rigid, E], axis=1), modes, weights / size)


def enriched(link: Link, deflections: Sequence[Float[np.ndarray, "n d"]], most: int) -> Float[np.ndarray, "n s"]:
    """The modes of a reduced link and those components of deflections that have most strain energy beside them.

    Parameters
    ----------
    deflections : of the link that it was made from
    most : modes to add
    """
    full, Q = link.full or link, mode_matrix(link)
    H = energy_product(full)
    S = np.concatenate(deflections, axis=1)
    own = orthonormal(Q, H, INDEPENDENT)[0]
    S = S - Q @ (Q.T @ np.asarray(full.mass[0] @ S))
    S = S - own @ (own.T @ np.asarray(H @ S))
    return np.concatenate([Q, orthonormal(S, H, 1e-10)[0][:, :most]], axis=1)


def energy_product(link: Link) -> sp.csr_array:
    """H = Σ_k K0_kk, of a solid (λ + 4 μ) ∫ ∇N_a · ∇N_b: a scalar product that sees shear, unlike the mass's."""
    blocks = stiffness_blocks(link)
    return sp.csr_array(sum(scalar_block(blocks, k, k) for k in range(link.d)))


def port_functions(link: Link, joint: Attachment, part: Substructure) -> Float[np.ndarray, "n p"]:
    """One function per port, without which ports would depend on each other: the link's own answer to its force."""
    port, component = np.divmod(joint.keep, link.d)
    out = np.zeros((link.n, len(joint.weights)))
    for k, (p, c) in enumerate(zip(port, component, strict=True)):
        out[:, p] += part.Y[:, k].reshape(-1, link.d)[:, c]
    return out


def orthonormal(
    S: Float[np.ndarray, "n k"], H: sp.csr_array, least: float
) -> tuple[Float[np.ndarray, "n f"], Float[np.ndarray, " f"]]:
    """Principal modes of S in the product H, and their weights; those below `least` of the first's energy go."""
    G = S.T @ np.asarray(H @ S)
    values, vectors = np.linalg.eigh((G + G.T) / 2)
    values, vectors = values[::-1], vectors[:, ::-1]
    kept = values > least * max(values[0], 0.0) if len(values) else np.zeros(0, bool)
    return S @ (vectors[:, kept] / np.sqrt(values[kept])), np.sqrt(values[kept])


def _dots(a: Sequence[Rows], b: Sequence[Rows]) -> Float[np.ndarray, " T"]:
    """Products of states of the linkage at each time."""
    return np.asarray(np.sum([np.einsum("tnd,tnd->t", x, y) for x, y in zip(a, b, strict=True)], axis=0))
