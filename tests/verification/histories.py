"""Histories of a single link by the march of a system; NAFEMS 5T and 5H."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.matrices.dense import work_on
from kedfem.dynamics.model import Model
from kedfem.dynamics.stepping.scheme import Scheme, generalised_alpha
from kedfem.dynamics.stepping.state import Rayleigh
from kedfem.dynamics.system.march import march
from kedfem.dynamics.system.ready import displacements, ready
from kedfem.dynamics.system.record import System
from kedfem.dynamics.system.starts.initial_states import as_coordinates, begun
from kedfem.dynamics.system.starts.instant import Instant
from kedfem.links.record import Link
from kedfem.motion.rigid import RigidMotion, resting

from .cases import Row, case
from .linear import deflection, free_map, vector_mass
from .vibrations import DEEP, STEEL, pinned_beam

NAFEMS = "Maguire, Dawswell, Gould: Selected benchmarks for forced vibration, NAFEMS R0016 (1989)"
DAMPING = Rayleigh(alpha=5.36, beta=7.46e-5)  # 2 % at the first frequency
FIRST = 42.65  # Hz
BLOCK = 1000  # steps whose states are kept together


def grounded(link: Link, dofs: np.ndarray) -> Attachment:
    """The link's unknowns `dofs` held to the ground, node by node."""
    nodes = np.unique(dofs // 3)
    keep = 3 * np.searchsorted(nodes, dofs // 3) + dofs % 3
    return Attachment(
        nodes,
        np.eye(len(nodes)),
        3,
        link.X[nodes],
        ("ground",) * len(nodes),
        keep,
        np.zeros(0, int),
        np.zeros((len(keep), 0)),
        0,
    )


@dataclass(frozen=True, slots=True)
class Run:
    """One link, its supports, scheme and damping, and what acts on it.

    forces, R : of time, P − M R0'' in world components and the orientation
    start : δ, δ' and the rate of the co-rotated deformation; rest if not given
    """

    link: Link
    joint: Attachment
    scheme: Scheme
    damping: Rayleigh
    forces: Callable[[float], np.ndarray]
    R: Callable[[float], np.ndarray] = lambda _: np.eye(3)
    start: tuple[np.ndarray, np.ndarray, np.ndarray] | None = None


class Moving(NamedTuple):
    """Displacement and rate of a link at one time, (n, d), world components."""

    u: np.ndarray
    v: np.ndarray


def history(run: Run, steps: int) -> Iterator[Moving]:
    """All states from t = 0, by the march of a system of one body."""
    link, joint = run.link, run.joint
    model = Model((link,), (0,), (joint,), ((),), run.damping)
    of = ready(System(("link",), (), (), joint.unknowns, model), run.scheme)
    u, v, g1 = run.start or [np.zeros((link.n, 3))] * 3
    now = Instant(of, lambda t: motion_of(run, t), 0.0)
    now.F[:] = work_on(of.parts[0], run.forces(0.0)).ravel()
    state = begun(now, *(as_coordinates(of, [x]) for x in (u, v)), strained=as_coordinates(of, [g1 @ run.R(0.0).T]))
    yield Moving(u, v)
    for first in range(1, steps + 1, BLOCK):
        t = run.scheme.h * np.arange(first, min(first + BLOCK, steps + 1))
        state, found = march(of, state, motion_of(run, t), loads=[np.stack([run.forces(x) for x in t])])
        yield from map(Moving, *(displacements(of, 0, x) for x in (found.u, found.v)))


def motion_of(run: Run, t: np.ndarray) -> RigidMotion:
    """The link turned at given times."""
    return replace(resting(1, t), R=np.stack([run.R(x) for x in t])[:, None])


def uniform_load(link: Link) -> np.ndarray:
    """1e6 N/m along the beam, as (n, 3) nodal forces."""
    return np.outer(link.volume / link.volume.sum() * 1e7, [0.0, 1.0, 0.0])


def middle(link: Link) -> int:
    """The node in the middle of the beam."""
    return int(np.abs(link.X[:, 0] - 5).argmin())


@case("NAFEMS 5T: deep beam, step load", f"{NAFEMS}, test 5T")
def step_load() -> list[Row]:
    """FV5's beam, 1e6 N/m from t = 0, C = 5.36 M + 7.46e-5 K, step 1e-4 s.

    The published static deflection is 0.35 % above Timoshenko's beam, 5qL⁴/384EI + qL²/8κGA = 0.5361 mm with
    the κ that gives FV5's frequencies.
    """
    link, fixed = pinned_beam(10)
    F, node, h = uniform_load(link), middle(link), 1e-4
    run = Run(link, grounded(link, fixed), generalised_alpha(h, 1.0), DAMPING, lambda _: F)
    states = history(run, 200)
    v = 1e3 * np.array([s.u[node, 1] for s in states])
    rest = 1e3 * deflection(link, free_map(link, fixed), F)[node, 1]
    E, G, A, I = 200e9, STEEL.shear_modulus, DEEP.area, DEEP.second_moment  # noqa: E741
    exact = 1e3 * (5 * 1e6 * 10**4 / (384 * E * I) + 1e6 * 10**2 / (8 * DEEP.shear_coefficient * G * A))
    text = f"10 beam3, {3 * link.n} unknowns"
    return [
        Row("peak [mm]", 1.043, float(v.max()), 0.001, f"{text}, step 1e-4 s"),
        Row("time of the peak [s]", 0.0117, h * int(v.argmax()), 0.005, f"{text}, step 1e-4 s"),
        Row("static [mm]", 0.538, float(rest), 0.004, text),
        Row("static, Timoshenko's beam [mm]", exact, float(rest), 1e-4, text),
    ]


@case("NAFEMS 5H: deep beam, harmonic load", f"{NAFEMS}, test 5H")
def harmonic_load() -> list[Row]:
    """FV5's beam, 1e6 N/m · sin ωt at 42.65 Hz, 100 steps a period, 1.5 s long: e^(−0.02 ω t) = 3e-4."""
    link, fixed = pinned_beam(10)
    F, node, omega = uniform_load(link), middle(link), 2 * np.pi * FIRST
    scheme = generalised_alpha(1 / (100 * FIRST), 1.0)
    run = Run(link, grounded(link, fixed), scheme, DAMPING, lambda t: F * np.sin(omega * t))
    states = history(run, 6400)
    v = 1e3 * np.array([s.u[node, 1] for s in states])[-101:]
    amplitude = np.hypot(*(2 / 100 * f(2 * np.pi * np.arange(100) / 100) @ v[1:] for f in (np.sin, np.cos)))
    text = f"10 beam3, {3 * link.n} unknowns"
    exact = 1e3 * abs(steady_response(link, fixed, F, omega)[node, 1])
    return [
        Row("amplitude, by steps [mm]", 13.45, float(amplitude), 0.003, f"{text}, 100 steps a period"),
        Row("amplitude, in the frequency domain [mm]", 13.45, float(exact), 0.003, text),
        Row("by steps, against frequency domain [mm]", float(exact), float(amplitude), 0.001, text),
    ]


def steady_response(link: Link, fixed: np.ndarray, force: np.ndarray, omega: float) -> np.ndarray:
    """Complex (n, 3) amplitude of (K + iωC − ω²M) u = force, by a dense solve without any time steps."""
    free = np.setdiff1d(np.arange(3 * link.n), fixed)
    M, K = (A.toarray()[np.ix_(free, free)] for A in (vector_mass(link), link.K0))
    C = DAMPING.alpha * M + DAMPING.beta * K
    u = np.zeros(3 * link.n, complex)
    u[free] = np.linalg.solve(K + 1j * omega * C - omega**2 * M, force.ravel()[free])
    return u.reshape(-1, 3)
