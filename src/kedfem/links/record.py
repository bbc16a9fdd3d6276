"""The one record that every link has, solid or beam: DESIGN of the whole solver rests on it.

A link is a scalar function space {N_a} with a vector in R³ at each function. Its state is an array (n, 3), its mass
scalar matrices, its stiffness K0 constant in the link frame: [KED, eqs. (9)(11)-(14)].
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float, Int

Mass = tuple[sp.csr_array, sp.csr_array, sp.csr_array]


@dataclass(frozen=True, slots=True)
class Section:
    """Rectangular cross-section of a planar beam, bending in the xy plane.

    height : extent in the plane of motion [m]; thickness : extent along z [m]; shear_coefficient : κ of κGA [-].
    """

    height: float
    thickness: float
    shear_coefficient: float = 5 / 6

    @property
    def area(self) -> float:
        """A [m²]."""
        return self.height * self.thickness

    @property
    def second_moment(self) -> float:
        """I about z [m⁴]."""
        return self.thickness * self.height**3 / 12


@dataclass(frozen=True, slots=True)
class Link:
    """A link as the dynamics sees it; all arrays are for the drawn (reference) position, R = I.

    name : key of the link in the scene.
    kind : ``solid``: rows of a state are (u, v, w); ``beam``: rows are (u, v, ψ), [KED, eq. (21)].
    X : (n, 3) positions of the functions' nodes [m].
    cells, cell_type : elements in VTK order and their meshio name.
    axes : (3, 3) columns are the link axes (x along the link) in the reference position.
    mass : one scalar (n, n) matrix per component [kg; ψ: kg m²]; for solids the same object three times.
    K0 : (3n, 3n) stiffness in the link frame, dof 3·node + component [N/m].
    m1 : (n, 3) mass times one, component by component [kg].
    mX : (n, 3) mass times position [kg m].
    volume : (n,) ∫ N_a dV of the link alone, without attached bodies [m³].
    E, lame : Young's modulus and Lamé's (λ, μ) [Pa], for stresses.
    section : of a beam, else None.
    basis : scikit-fem basis of a solid (for this room only), else None.
    """

    name: str
    kind: Literal["solid", "beam"]
    X: Float[np.ndarray, "n 3"]
    cells: Int[np.ndarray, "e m"]
    cell_type: str
    axes: Float[np.ndarray, "3 3"]
    mass: Mass
    K0: sp.csr_array
    m1: Float[np.ndarray, "n 3"]
    mX: Float[np.ndarray, "n 3"]
    volume: Float[np.ndarray, " n"]
    E: float
    lame: tuple[float, float]
    section: Section | None = None
    basis: Any = None

    @property
    def n(self) -> int:
        """Number of scalar functions; the link has 3n unknowns."""
        return len(self.X)


def mass_times(mass: Mass, u: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """M u for a state u, component by component: M = m ⊗ I3, [KED, eqs. (9)(11)].

    Parameters
    ----------
    mass : three (n, n) scalar matrices
    u : (n, 3)

    Returns
    -------
    (n, 3)
    """
    out = np.empty_like(u)
    for k, m in enumerate(mass):
        out[:, k] = m @ np.ascontiguousarray(u[:, k])
    return out


def mass_constants(
    mass: Mass, X: Float[np.ndarray, "n 3"]
) -> tuple[Float[np.ndarray, "n 3"], Float[np.ndarray, "n 3"]]:
    """(m·1, m·X): all that the inertia load −M R0'' needs of a link, [KED, eq. (17)].

    Returns
    -------
    (n, 3) [kg] and (n, 3) [kg m]
    """
    m1 = mass_times(mass, np.ones_like(X))
    mX = np.asarray(mass[0] @ X)
    return m1, mX


def read_only(*arrays: np.ndarray) -> None:
    """Mark arrays of a record as constant."""
    for a in arrays:
        a.setflags(write=False)
