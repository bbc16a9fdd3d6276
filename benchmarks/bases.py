"""Textbook ways to choose the functions of a link, to compare with kedfem's: fixed-interface and free-interface modes."""

from collections.abc import Callable

import numpy as np
import scipy.sparse as sp
from jaxtyping import Float
from scipy.sparse.linalg import LinearOperator, eigsh

from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.ports import port_columns
from kedfem.dynamics.matrices.cholesky import Cholesky
from kedfem.dynamics.matrices.substructure import Substructure, mass_matrix
from kedfem.dynamics.model import Model
from kedfem.dynamics.modes.reduction import Basis, energy_sorted, port_functions
from kedfem.links.record import Link
from kedfem.links.reduced import rigid_modes

MODES = 8  # normal modes of a link
SHIFT = (2 * np.pi * 50.0) ** 2  # [1/s²], lets a free link be factored
Columns = Float[np.ndarray, "k c"]


def interface_bases(model: Model, parts: list[Substructure], fixed: bool) -> list[Basis]:
    """A basis for every solid link from its own modes.

    Parameters
    ----------
    parts : `static_parts` of the model
    fixed : constraint modes, and normal modes with the ports held (Craig, Bampton 1968), else static answers to port
        forces, and normal modes of the free link (Rubin 1975); both with answers to the twelve inertia loads
    """
    return [
        energy_sorted(link, port_functions(link, joint, part), _deflections(link, joint, fixed))
        for link, joint, part in zip(model.links, model.joints, parts, strict=True)
    ]


def _deflections(link: Link, joint: Attachment, fixed: bool) -> list[Float[np.ndarray, "n d"]]:
    """Modes and statics of a link without their rigid parts, each of unit strain energy."""
    M = mass_matrix(link)
    factor = Cholesky(sp.csr_array(link.K0 + SHIFT * M), f"links.{link.name}")
    ports = port_columns(joint, link.n)
    answers = factor.solve_many(ports)
    held = answers @ np.linalg.inv(ports.T @ answers)

    def solve(b: Float[np.ndarray, " k"]) -> Float[np.ndarray, " k"]:
        y = factor.solve(np.ascontiguousarray(b)).copy()
        return y - held @ (ports.T @ y) if fixed else y

    statics = held if fixed else answers
    inertia = np.stack([solve(b) for b in _inertia_loads(link).T], axis=1)
    found = np.concatenate([_normal_modes(link, M, solve, fixed), statics, inertia], axis=1)
    R = rigid_modes(link)
    found -= R @ np.linalg.solve(R.T @ (M @ R), R.T @ (M @ found))
    found /= np.sqrt(np.einsum("kc,kc->c", found, link.K0 @ found))
    return [column.reshape(link.n, link.d) for column in found.T]


def _normal_modes(link: Link, M: sp.csr_array, solve: Callable[[np.ndarray], np.ndarray], fixed: bool) -> Columns:
    """The lowest, without the six rigid ones of a free link."""
    rigid = 0 if fixed else 6
    inverse = LinearOperator(M.shape, matvec=solve, dtype=float)
    values, vectors = eigsh(link.K0, k=MODES + rigid, M=M, sigma=-SHIFT, OPinv=inverse, tol=1e-8)
    return np.asarray(vectors[:, np.argsort(values)][:, rigid:])


def _inertia_loads(link: Link) -> Columns:
    """M times the twelve states of acceleration that a link can have: three of its frame's origin, nine of R''."""
    columns = []
    for weights in (link.m1[:, 0], *link.mX.T):
        for component in range(3):
            load = np.zeros((link.n, link.d))
            load[:, component] = weights
            columns.append(load.ravel())
    return np.stack(columns, axis=1)
