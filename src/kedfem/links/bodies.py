"""Rigid bodies attached to links (flywheels, point masses, any inertia); the mass stays scalar and constant."""

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float
from kedfem.links.record import Link, Mass, mass_constants, read_only
from kedfem.links.surfaces.coupling_surfaces import CouplingSurface, face_normal, is_flat


def euler_tensor(inertia: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3"]:
    """∫ ρ x xᵀ dV = ½ tr(I) 1 − I of a rigid body from its inertia tensor I [kg m²]."""
    return np.asarray(0.5 * np.trace(inertia) * np.eye(3) - inertia)


def inertia_of(euler: Float[np.ndarray, "3 3"]) -> Float[np.ndarray, "3 3"]:
    """Inertia tensor tr(G) 1 − G from the Euler tensor G [kg m²]."""
    return np.asarray(np.trace(euler) * np.eye(3) - euler)


def flywheel_tensor(surface: CouplingSurface, axis: Float[np.ndarray, "3"], inertia: float) -> Float[np.ndarray, "3 3"]:
    """Euler tensor of a flywheel with moment of inertia J about an axis [kg m²].

    On a bore a thin disc, ½ J (1 − a aᵀ). The affine fit of a flat face has no gradient along its normal: there
    J t tᵀ, t across the axis within the face. In a plane both have xx + yy = J.
    """
    if not is_flat(surface):
        return np.asarray(inertia / 2 * (np.eye(3) - np.outer(axis, axis)))
    t = np.cross(face_normal(surface), axis)
    return np.asarray(inertia * np.outer(t, t))


def with_body(
    link: Link, surface: CouplingSurface, mass: float, centre: Float[np.ndarray, "3"], euler: Float[np.ndarray, "3 3"]
) -> Link:
    """A link with a rigid body on one of its coupling surfaces: W4ᵀ Γ W4 is added to the scalar mass.

    Γ = [[mass, mass·cᵀ], [mass·c, G]], c the body's centre from the coupling surface's origin, G its Euler tensor about
    that origin. On a planar beam it adds its mass to the node's translation, and its inertia about z to its rotation.

    Parameters
    ----------
    mass : [kg]
    centre : centre of mass in the reference position [m]; the coupling surface of a beam or a flat face must have
        a gradient along the direction to it
    euler : (3, 3) Euler tensor ∫ ρ x xᵀ dV about the centre [kg m²]
    """
    c = centre - surface.origin
    G = euler + mass * np.outer(c, c)
    if link.kind == "beam":
        return _with_node_body(link, surface, mass, float(inertia_of(G)[2, 2]))
    gamma = np.zeros((4, 4))
    gamma[0, 0] = mass
    gamma[0, 1:] = gamma[1:, 0] = mass * c
    gamma[1:, 1:] = G
    W4 = sp.csr_array(surface.fit)
    m = sp.csr_array(link.mass[0] + W4.T @ sp.csr_array(gamma) @ W4)
    return with_mass(link, (m,) * link.d)


def with_point_mass(link: Link, weights: Float[np.ndarray, " n"], mass: float) -> Link:
    """A link with a mass that follows one interface point and does not rotate with the link, such as a slider's [kg]."""
    w = sp.csr_array(weights[None, :])
    lump = sp.csr_array(mass * (w.T @ w))
    m = sp.csr_array(link.mass[0] + lump)
    return with_mass(link, (m, m, link.mass[2]) if link.kind == "beam" else (m,) * link.d)


def _with_node_body(link: Link, surface: CouplingSurface, mass: float, inertia: float) -> Link:
    w = sp.csr_array(surface.fit[:1])
    lump = sp.csr_array(w.T @ w)
    xy = sp.csr_array(link.mass[0] + mass * lump)
    return with_mass(link, (xy, xy, sp.csr_array(link.mass[2] + inertia * lump)))


def with_mass(link: Link, mass: Mass) -> Link:
    """A link with another mass, one matrix for each component."""
    m1, mX = mass_constants(mass, link.one, link.X * [1, 1, 0 if link.planar else 1])
    read_only(m1, mX)
    return replace(link, mass=mass, m1=m1, mX=mX)
