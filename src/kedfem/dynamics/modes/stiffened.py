"""Natural frequencies of a linkage frozen at a position, with geometric stiffening and the inertia of rotation.

For a link that rotates at Ω, δ = R y with M (y'' + 2 Ω̃ y' + Ω̃² y) + (K0 + k ⊗ P) y = 0 (`dynamics.stiffening`). The
symmetric part K0 + k ⊗ P + M Ω̃², with the link's Ω, is kept; the gyroscopic term 2 M Ω̃ y' is left out. Motions that
released drives let go have no frequency: along the path of a linkage its inertia changes, and its loads do work, which a
frozen position would take for a stiffness of either sign. Vibrations are those orthogonal to them.
"""

from dataclasses import replace

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from kedfem.arrays import Float
from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.matrices.substructure import mass_matrix
from kedfem.dynamics.model import Model
from kedfem.dynamics.modes.frozen import Frozen, Modes, UnstableError
from kedfem.dynamics.rigid_body import forcings
from kedfem.dynamics.rigid_elements import RigidElements, rigid_elements
from kedfem.dynamics.stiffening import stiffening
from kedfem.dynamics.system.record import System
from kedfem.errors import SceneError, SolveError
from kedfem.links.record import Link, Matrix
from kedfem.links.reduced import rigid_modes
from kedfem.motion.linkage import Linkage
from kedfem.motion.newton import cross_matrix
from kedfem.motion.path import Path
from kedfem.motion.rigid import RigidMotion
from kedfem.scene import Scene, corotational_links

Rigid = tuple[Float[np.ndarray, "k r"], Float[np.ndarray, "r r"]]
"""Rigid motions of a link, and its mass in them."""
BUCKLES = "buckles under the stresses of its motion, or tips over under its loads"
AMPLE = 2.0  # times what holds a link that its stresses alone would let turn over


class Stiffened:
    """`Frozen` for links with geometric stiffening, which are factored anew at each position.

    Parameters
    ----------
    driven : the model of the same links that the drive moves, from which their stresses come
    elements : motors and springs on these links, if there are any
    loose : the linkage without these stresses, whose motions without strain remain that; None if drives hold it

    Raises
    ------
    SolveError
        If a link is not supported.
    """

    def __init__(
        self, system: System, driven: Model, count: int, free: int = 0, elements: RigidElements | None = None,
        loose: Frozen | None = None,
    ) -> None:  # fmt: skip
        self.system, self.driven, self.count, self.free, self.loose = system, driven, count, free, loose
        self.stresses = stiffening(driven, elements)
        self.rigid = [_rigid(link) for link in system.model.links]
        self.factorisations = 0

    def at(self, motion: RigidMotion) -> Modes:
        """As `Frozen.at`; stresses may make the linkage buckle there."""
        solver = self.frozen(motion)
        if self.loose is not None:
            _, still, shapes = self.loose.modes(motion)
            solver.excluded = shapes[:, :still]
        try:
            found = solver.at(motion)
        except SolveError as fault:
            raise UnstableError(BUCKLES, motion) from fault
        self.factorisations += solver.factorisations
        return found

    def frozen(self, motion: RigidMotion) -> Frozen:
        """The linkage as it is at a position.

        Raises
        ------
        UnstableError
        """
        system, shift = self.system_at(motion)
        try:
            return Frozen(system, self.count, self.free, shift, preloaded=True)
        except SolveError as fault:
            raise UnstableError(BUCKLES, motion) from fault

    def system_at(self, motion: RigidMotion) -> tuple[System, float]:
        """The system with its links as they are at a position, and s [1/s²] with which K + s M holds each of them."""
        factors = self.stresses.over(forcings(self.driven, motion), motion)
        links, shift = [], 0.0
        model = self.system.model
        for link, rigid, modes, body, s in zip(
            model.links, self.rigid, self.stresses.modes, model.bodies, factors, strict=True
        ):
            R = motion.R[0, body]
            added = sp.kron(modes.stiffness(s[0]), modes.P) + _rotation_inertia(link, R.T @ motion.omega[0, body])
            links.append(replace(link, K0=_plus(link.K0, added)))
            shift = max(shift, AMPLE * _unstable(rigid, added))
        return replace(self.system, model=replace(model, links=tuple(links))), shift


def _rotation_inertia(link: Link, omega: Float[np.ndarray, "3"]) -> sp.csr_array:
    """M Ω̃², (dn, dn)."""
    space = 2 if link.planar else 3
    W = np.zeros((link.d, link.d))
    W[:space, :space] = (cross_matrix(omega) @ cross_matrix(omega))[:space, :space]
    return sp.csr_array(sp.kron(sp.csr_array(link.mass[0]), W))


def _plus(K: Matrix, added: sp.csr_array) -> Matrix:
    return sp.csr_array(K + added) if sp.issparse(K) else np.asarray(K) + added.toarray()


def _rigid(link: Link) -> Rigid:
    B = rigid_modes(link)
    return B, B.T @ (mass_matrix(link) @ B)


def _unstable(rigid: Rigid, added: sp.csr_array) -> float:
    """By how much ω² of a link's rigid motions is below zero [1/s²]."""
    B, mass = rigid
    lowest = scipy.linalg.eigh(B.T @ (added @ B), mass, eigvals_only=True)[0]
    return max(0.0, -float(lowest))


def frozen_linkage(
    scene: Scene, system: System, linkage: Linkage, along: Path, count: int, free: bool
) -> Frozen | Stiffened:
    """The solver for the modes of a scene's system at positions.

    Parameters
    ----------
    count : vibrations that are wanted
    free : whether the drives have released their joints in the system

    Raises
    ------
    SceneError
        Stiffening of a link that a released drive has prescribed, or beside links with co-rotational frames.
    """
    released = linkage.mobility + (len(scene.all_drives) if free else 0)
    if not scene.analysis.stiffening:
        return Frozen(system, count, released)
    if names := ", ".join(sorted(corotational_links(scene))):
        raise SceneError(
            "analysis.stiffening: must be combined with rigid-body frames of all links for frequencies (co-rotational "
            f"links have no stress modes), got co-rotational ones of {names}: take rigid-body frames"
        )
    driven = elastic_model(scene, linkage, along=along)
    _refuse_prescribed(driven, free)
    loose = Frozen(system, 1, released) if free else None
    return Stiffened(system, driven, count, released, rigid_elements(scene, linkage, along, driven), loose)


def _refuse_prescribed(driven: Model, free: bool) -> None:
    """Refuse to release rigid links that a drive prescribes: the forces of their joints, which stiffen them, are unknown.

    Raises
    ------
    SceneError
    """
    if free and driven.prescribed:
        names = ", ".join(each.link.name for each in driven.prescribed)
        raise SceneError(
            "--free: must be left out with analysis.stiffening where the drive prescribes rigid links, whose stresses "
            f"are not known, got {names}: take model = 'beam' or 'solid' for it"
        )
