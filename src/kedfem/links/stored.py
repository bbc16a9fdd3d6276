"""Reduced links as they are kept in a file: without the large matrices of the links that they were made from."""

from dataclasses import replace

import scipy.sparse as sp
import skfem

from kedfem.links.record import Link


def can_be_stored(link: Link) -> bool:
    """Whether a link is small once its origin's matrices are left out."""
    return link.full is not None or link.basis is None


def stored(link: Link) -> Link:
    """A changed copy that can be pickled: of the full link only geometry and function space are left."""
    if link.full is None:
        return link
    full, none = link.full, sp.csr_array((0, 0))
    if full.basis is not None:
        basis = full.basis
        full = replace(full, basis=(basis.mesh, type(basis.elem), basis.X, basis.W))
    return replace(link, basis=None, full=replace(full, K0=none, mass=(none,) * full.d))


def restored(link: Link) -> Link:
    """The link that `stored` was given, but for the matrices."""
    if link.full is None or link.full.basis is None:
        return link
    mesh, element, X, W = link.full.basis
    basis = skfem.Basis(mesh, element(), quadrature=(X, W))
    return replace(link, basis=basis, full=replace(link.full, basis=basis))
