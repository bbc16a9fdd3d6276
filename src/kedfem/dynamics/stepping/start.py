"""Initial states that satisfy the equation: at rest, or quasi-static; rates where links start to move by themselves."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse.linalg import LinearOperator, gmres

from kedfem.arrays import Float
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.first_rows import FirstRows, interface_values
from kedfem.dynamics.joints.ports import Rotation
from kedfem.dynamics.matrices.closed import Closed, closed, coupled
from kedfem.dynamics.matrices.interface import Tie
from kedfem.dynamics.matrices.substructure import Substructure, factored, mass_substructure
from kedfem.dynamics.model import Model
from kedfem.dynamics.stepping.state import ForcingAt, LinkState, Nodal, NodalOf, Rayleigh
from kedfem.errors import SolveError
from kedfem.links.record import Link, mass_times
from kedfem.motion.constraints import cross
from kedfem.motion.initial import initial_twists
from kedfem.motion.linkage import Linkage
from kedfem.scene import Scene

TURNING_ITERATIONS = 20
KRYLOV = 50  # vectors
CONVERGED = 1e-9  # change of a iteration, of the deflection


@dataclass(frozen=True, slots=True)
class Deflected:
    """A link's given start: u, v (n, d) δ and δ' in world components, g_rate (n, d) rate of δ in the link frame.

    stressed : (n, d) force k g P of its stress stiffness, link frame [N]
    """

    u: Nodal
    v: Nodal
    g_rate: Nodal
    stressed: Nodal | float = 0.0


def initial_rates(scene: Scene, linkage: Linkage, model: Model) -> list[Nodal]:
    """δ' (n, d) of all links at the start, from the speeds that the scene asks for: rigid motions that the joints allow.

    Raises
    ------
    MotionError
        If the joints do not allow these speeds together.
    """
    v, omega = initial_twists(scene, linkage)
    return [rigid_rates(link, v[k], omega[k]) for link, k in zip(model.links, model.bodies, strict=True)]


def rigid_rates(link: Link, v: Float[np.ndarray, "3"], omega: Float[np.ndarray, "3"]) -> Nodal:
    """The rate of a link's state in the reference position: v at the origin [m/s], turning by ω [rad/s]."""
    rates = np.outer(link.one, v) + cross(omega[None], link.X)
    if link.kind == "beam":
        rates[:, 2] = omega[2] * link.one
    return np.asarray(rates[:, : link.d])


def initial_states(
    links: Sequence[Link], joints: Sequence[Attachment], at: Sequence[ForcingAt], damping: Rayleigh,
    deflected: Sequence[Deflected], rows: FirstRows | None = None,
) -> list[LinkState]:  # fmt: skip
    """States with given δ, δ' and the acceleration that equation (20) then asks for, joints closed, [KED, eq. (20)].

    Parameters
    ----------
    at : orientation and P − M R0'' of each link now
    deflected : joints closed
    rows : of joints enforced by constraint equations; rates are made to keep these closed, C z' = −C' z, accelerations
    too"""
    parts = [mass_substructure(link, joint) for link, joint in zip(links, joints, strict=True)]
    tie = None
    if rows is not None:
        deflected = _with_rates(links, parts, at, deflected, rows)
        tie = rows.acceleration_tie(interface_values(joints, [x.u for x in deflected]),
                                    interface_values(joints, [x.v for x in deflected]))  # fmt: skip
    g = [x.u @ now.R for x, now in zip(deflected, at, strict=True)]
    Kg = [_stiffness_times(link, x) for link, x in zip(links, g, strict=True)]
    Cg1 = [damping_times(link, damping, x.g_rate) for link, x in zip(links, deflected, strict=True)]
    f = [a + b + x.stressed for a, b, x in zip(Kg, Cg1, deflected, strict=True)]
    # the mass is the same in every frame, so the accelerations can be found in the link frames
    a_link, forces = coupled(
        parts, [now.R for now in at], [now.F @ now.R - x for now, x in zip(at, f, strict=True)], tie
    )
    states = []
    for k, (link, start, now) in enumerate(zip(links, deflected, at, strict=True)):
        a = a_link[k] @ now.R.T
        C = (
            np.stack([damping_times(link, damping, g[k]), Cg1[k], np.zeros_like(a)])
            if damping.present
            else None
        )
        Mu, Mv, Ma = (mass_times(link.mass, x) for x in (start.u, start.v, a))
        states.append(LinkState(start.u, start.v, a, Mu, Mv, Ma, now.R, f[k], C, forces[k]))
    return states


def _with_rates(
    links: Sequence[Link], parts: Sequence[Substructure], at: Sequence[ForcingAt], given: Sequence[Deflected],
    rows: FirstRows,
) -> list[Deflected]:  # fmt: skip
    """Starts whose rates keep the rows closed; changed as little as can be, in kinetic energy."""
    joints = [part.attachment for part in parts]
    z, z1 = (interface_values(joints, x) for x in ([x.u for x in given], [x.v for x in given]))
    none = [np.zeros((link.n, link.d)) for link in links]
    change, _ = coupled(parts, [now.R for now in at], none, rows.rate_tie(z, z1))
    return [
        replace(x, v=x.v + c @ now.R.T, g_rate=x.g_rate + c)
        for x, c, now in zip(given, change, at, strict=True)
    ]


@dataclass(frozen=True, slots=True)
class Instant:
    """What a quasi-static deflection needs at one time, per link: R and F = P − M R0'', and angular_velocity = [α]× +
    [ω]×².

    turnings : g → k g P of the links' stress stiffness, if it counts
    tie : of joints enforced by constraint equations
    """

    at: Sequence[ForcingAt]
    spin: Sequence[Rotation]
    turnings: Sequence[Callable[[Nodal], Nodal]] | None = None
    tie: Tie | None = None


def quasi_static(
    links: Sequence[Link], joints: Sequence[Attachment], instants: Sequence[Instant]
) -> list[list[NodalOf]]:
    """Deflections that turn with their links without vibrating: K δ = P − M R0'' − M ([α]× + [ω]×²) δ.

    The inertia of the turning deflection is put in by iteration where that converges (a drive well below the first
    frequency), else, and with stress stiffness K_σ δ, by GMRES.

    Raises
    ------
    SolveError
        If no deflection is found.

    Returns
    -------
    per instant, per link (n, d), world components
    """
    parts = [factored(link, joint, 0.0, 1.0) for link, joint in zip(links, joints, strict=True)]
    return [_turning(links, parts, instant) for instant in instants]


def _turning(links: Sequence[Link], parts: Sequence[Substructure], instant: Instant) -> list[NodalOf]:
    """Static deflection, then iterations with the inertia that it has as it turns."""
    R = [now.R for now in instant.at]
    load = [now.F @ now.R for now in instant.at]
    spin = [R_.T @ S @ R_ for S, R_ in zip(instant.spin, R, strict=True)]
    linkage = closed(parts, R, instant.tie)
    g, _ = linkage.coupled(load)
    before = np.inf
    for _ in range(TURNING_ITERATIONS if instant.turnings is None else 0):
        inertia = [mass_times(link.mass, x @ S.T) for link, x, S in zip(links, g, spin, strict=True)]
        new, _ = linkage.coupled([b - m for b, m in zip(load, inertia, strict=True)])
        change, size = _change(new, g)
        if change > 0.5 * before:
            break
        before, g = change, new
        if change <= CONVERGED * size:
            return [x @ R_.T for x, R_ in zip(g, R, strict=True)]
    found = _turned_static(links, linkage, instant, g, linkage.coupled(load)[0])
    return [x @ R_.T for x, R_ in zip(found, R, strict=True)]


def _turned_static(
    links: Sequence[Link], linkage: Closed, instant: Instant, guess: Sequence[NodalOf],
    static: Sequence[NodalOf],
) -> list[NodalOf]:  # fmt: skip
    """The deflection by GMRES: inertia and stress stiffness need not be small, (1 + K0⁻¹ (M spin + k P)) g = g0.

    Parameters
    ----------
    guess, static : where it begins, and g0, link frames

    Raises
    ------
    SolveError
        If it is not found.
    """
    R = [now.R for now in instant.at]
    spin = [R_.T @ S @ R_ for S, R_ in zip(instant.spin, R, strict=True)]
    ends = np.cumsum([x.size for x in static])[:-1]
    none = [np.zeros_like(x) for x in static]
    fixed = np.concatenate([y.ravel() for y in linkage.coupled(none)[0]])

    def applied(x: Float[np.ndarray, " N"]) -> Float[np.ndarray, " N"]:
        each = [y.reshape(z.shape) for y, z in zip(np.split(x, ends), static, strict=True)]
        forces = [mass_times(link.mass, y @ S.T) for link, y, S in zip(links, each, spin, strict=True)]
        if instant.turnings is not None:
            forces = [f + k(y) for f, k, y in zip(forces, instant.turnings, each, strict=True)]
        solved = np.concatenate([y.ravel() for y in linkage.coupled(forces)[0]])
        return np.asarray(x + solved - fixed)

    start, first = (np.concatenate([x.ravel() for x in each]) for each in (static, guess))
    operator = LinearOperator((len(start),) * 2, applied, dtype=float)
    x, left = gmres(operator, start, x0=first, rtol=CONVERGED, restart=KRYLOV, maxiter=4)
    if left:
        raise SolveError(
            "analysis.initial: must be a quasi-static deflection that can be found, got none: the drive turns too near "
            'a natural frequency of the links; take initial = "rest", a slower drive or stiffer links'
        )
    return [y.reshape(z.shape) for y, z in zip(np.split(x, ends), static, strict=True)]


def _change(new: Sequence[NodalOf], old: Sequence[NodalOf]) -> tuple[float, float]:
    """Largest change and largest value."""
    change = max(float(np.abs(x - y).max()) for x, y in zip(new, old, strict=True))
    return change, max(float(np.abs(x).max()) for x in new)


def damping_times(link: Link, damping: Rayleigh, g: Nodal) -> Nodal:
    """C0 g = α M g + β K0 g, link frame."""
    return np.asarray(damping.alpha * mass_times(link.mass, g) + damping.beta * _stiffness_times(link, g))


def _stiffness_times(link: Link, g: Nodal) -> Nodal:
    return np.asarray((link.K0 @ g.ravel()).reshape(g.shape))
