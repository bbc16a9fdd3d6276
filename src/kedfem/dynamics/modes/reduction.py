"""Modes for reduced links: what the loads of this scene excite, and no more.

At some instants of the motion the linkage stands still in thought. Its static deflection under P − M R0'' there, and the
vibration modes that this deflection excites (Lanczos steps K⁻¹ M on the whole linkage, drive held), are what its links do
later. Taken apart into scalar components and sorted by strain energy, the first few of them make the basis.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float

from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.matrices.substructure import Substructure, coupled, factored
from kedfem.dynamics.model import Model
from kedfem.dynamics.stepping.start import Instant
from kedfem.dynamics.stepping.state import NodalOf
from kedfem.links.record import Link, mass_times
from kedfem.links.reduced import (
    mass_orthonormal,
    on_functions,
    rigid_functions,
    scalar_block,
    stiffness_blocks,
)

LANCZOS = 6  # modes of the linkage per instant (docs/performance/reduction.md)
INDEPENDENT = 1e-14  # of the largest energy: modes below repeat others
REPEATED = 1e-9  # of a deflection: what is left of it beside those before is rounding


@dataclass(frozen=True, slots=True)
class Basis:
    """Modes of one link, most important first.

    needed : (n, k) what every basis must hold: 1, position, one mode per port
    modes : (n, f) orthonormal in strain energy to those and to each other
    weights : (f,) share of the training deflections' strain-energy norm that each carries [-]
    """

    needed: Float[np.ndarray, "n k"]
    functions: Float[np.ndarray, "n f"]
    weights: Float[np.ndarray, " f"]

    def first(self, count: int) -> Float[np.ndarray, "n s"]:
        """The needed modes and as many others as make up the count."""
        more = max(0, count - self.needed.shape[1])
        return np.concatenate([self.needed, self.functions[:, :more]], axis=1)

    def count(self, tolerance: float) -> int:
        """How many modes leave out no more than a part of the strain-energy norm."""
        left = np.sqrt(np.cumsum((self.weights**2)[::-1])[::-1])
        return int(self.needed.shape[1] + np.count_nonzero(left > tolerance))


def static_parts(model: Model) -> list[Substructure]:
    """All links factored with A = K0."""
    return [factored(link, joint, 0.0, 1.0) for link, joint in zip(model.links, model.joints, strict=True)]


def excited(
    model: Model, parts: Sequence[Substructure], instant: Instant, levels: int = LANCZOS
) -> list[list[NodalOf]]:
    """Static deflection at an instant, and its shares in the modes of the frozen linkage that it excites; per link."""
    static = _static(parts, instant)
    out = [[x] for x in static]
    if not any(x.any() for x in static):
        return out
    vectors, images, T = _lanczos(model, parts, instant, static, levels)
    _, Z = np.linalg.eigh(T)
    share = Z.T @ np.array([_dot(M_b, static) for M_b in images])
    for mode, amount in zip(Z.T, share, strict=True):
        for kept, *several in zip(out, *vectors, strict=True):
            kept.append(amount * sum(c * x for c, x in zip(mode, several, strict=True)))
    return out


def frozen_frequencies(
    model: Model, parts: Sequence[Substructure], instant: Instant, levels: int = LANCZOS
) -> Float[np.ndarray, " f"]:
    """Lowest circular frequencies of the linkage standing still, drive held, among modes that its loads excite [rad/s].

    1/ω² are Ritz values of K⁻¹ M: the first is good, those after it less and less.
    """
    static = _static(parts, instant)
    if not any(x.any() for x in static):
        return np.zeros(0)
    values = np.linalg.eigvalsh(_lanczos(model, parts, instant, static, levels)[2])[::-1]
    return np.asarray(1 / np.sqrt(values[values > REPEATED * values[0]]))


def _static(parts: Sequence[Substructure], instant: Instant) -> list[NodalOf]:
    """The linkage's static deflection under P − M R0'' at an instant, link frames."""
    R = [now.R for now in instant.at]
    return _copied(coupled(parts, R, [now.F @ now.R for now in instant.at], instant.tie)[0])


def _lanczos(
    model: Model, parts: Sequence[Substructure], instant: Instant, start: list[NodalOf], levels: int
) -> tuple[list[list[NodalOf]], list[list[NodalOf]], Float[np.ndarray, "l l"]]:
    """Mass-orthonormal deflections b of the linkage by K⁻¹ M from a first one, M b, and T = Bᵀ M K⁻¹ M B."""
    vectors: list[list[NodalOf]] = []
    images: list[list[NodalOf]] = []
    T = np.zeros((levels, levels))
    x, size = start, _mass_norm(model, start)[0]
    for level in range(levels):
        whole = size
        for _ in range(2):
            for b, M_b in zip(vectors, images, strict=True):
                c = _dot(M_b, x)
                x = [y - c * z for y, z in zip(x, b, strict=True)]
        size, Mx = _mass_norm(model, x)
        if size <= REPEATED * whole:
            break
        vectors.append([y / size for y in x])
        images.append([y / size for y in Mx])
        x = _copied(coupled(parts, [now.R for now in instant.at], images[-1], instant.tie)[0])
        size = _mass_norm(model, x)[0]
        for k, M_b in enumerate(images):
            T[level, k] = T[k, level] = _dot(M_b, x)
    found = len(vectors)
    return vectors, images, T[:found, :found]


def _mass_norm(model: Model, x: Sequence[NodalOf]) -> tuple[float, list[NodalOf]]:
    """√(xᵀ M x) of the linkage, and M x."""
    Mx = [mass_times(link.mass, y) for link, y in zip(model.links, x, strict=True)]
    return float(np.sqrt(max(_dot(x, Mx), 0.0))), Mx


def energy_sorted(
    link: Link, ports: Float[np.ndarray, "n p"], deflections: Sequence[Float[np.ndarray, "n d"]]
) -> Basis:
    """Scalar components of deflections, orthonormal in an energy-like product and sorted by their weight in it."""
    H = energy_product(link)
    S = np.concatenate(deflections, axis=1)
    rigid = mass_orthonormal(link, rigid_functions(link))
    S, E = (x - rigid @ (rigid.T @ np.asarray(link.mass[0] @ x)) for x in (S, ports))
    E = orthonormal(E, H, 1e-10)[0]
    S = S - E @ (E.T @ np.asarray(H @ S))
    functions, weights = orthonormal(S, H, INDEPENDENT)
    size = np.sqrt((weights**2).sum()) or 1.0
    return Basis(np.concatenate([rigid, E], axis=1), functions, weights / size)


def enriched(
    link: Link, deflections: Sequence[Float[np.ndarray, "n d"]], most: int
) -> Float[np.ndarray, "n s"]:
    """The modes of a reduced link and those components of deflections that have most strain energy beside them.

    Parameters
    ----------
    deflections : of the link that it was made from
    most : modes to add
    """
    full, Q = link.full or link, on_functions(link)
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


def _dot(a: Sequence[NodalOf], b: Sequence[NodalOf]) -> float:
    return sum(float(np.vdot(x, y)) for x, y in zip(a, b, strict=True))


def _copied(vectors: Sequence[NodalOf]) -> list[NodalOf]:
    """Solutions live in the factor's buffer; these stay."""
    return [x.copy() for x in vectors]
