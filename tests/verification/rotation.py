"""A bar that turns about its clamped end: SSLV104 and SSLV105 of code_aster, the latter also as a scene."""

import numpy as np
import scipy.sparse as sp
from scipy.sparse.linalg import spsolve

from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.rigid_body import drive_range
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.links.point_rows import point_rows
from kedfem.links.record import Link
from kedfem.links.surfaces.coupling_surfaces import face_surface
from kedfem.motion.linkage import linkage
from kedfem.motion.path import path
from kedfem.scene import Material, Scene, scene_from
from tests.moving import snapshots

from .cases import Row, case
from .linear import deflection, free_map, held, vector_mass
from .meshes import box, mapped_link, model

STATIC = "code_aster V3.04.104: u = ρω²(xL² − x³/3)/(2E)"
STEADY = "code_aster V3.04.105: u = sin(αx)/(α cos αL) − x, α = √(ρω²/E)"
BAR = Material(density=7800, youngs_modulus=2e11, poisson_ratio=0.0)
LENGTH, SIDE, SPEED = 0.5, 0.02, 3000.0


def static_deflection(x: np.ndarray) -> np.ndarray:
    """u(x) of SSLV104 [m]: −M R0'' alone."""
    return BAR.density * SPEED**2 * (x * LENGTH**2 - x**3 / 3) / (2 * BAR.youngs_modulus)


def steady_deflection(x: np.ndarray) -> np.ndarray:
    """u(x) of SSLV105 [m]: with the inertia of δ."""
    alpha = np.sqrt(BAR.density * SPEED**2 / BAR.youngs_modulus)
    return np.sin(alpha * x) / (alpha * np.cos(alpha * LENGTH)) - x


def bar(along: int, nodes: int = 27) -> tuple[Link, sp.csr_array, np.ndarray]:
    """The bar, clamped at x = 0, and −M R0'' in the link frame with only x'' taken (a bar, not a body)."""
    link = mapped_link((along, 1, 1), box((LENGTH, SIDE, SIDE), (0, -SIDE / 2, -SIDE / 2)), BAR, nodes)
    T = free_map(link, held((link.X[:, 0] < 1e-12, "xyz")))
    return link, T, SPEED**2 * link.mX * [1, 0, 0]


def steady_state(link: Link, T: sp.csr_array, force: np.ndarray) -> np.ndarray:
    """(K0 − ω² M) g = −M R0'' in the link frame, the fixed point of the general equation: along x."""
    A = sp.csc_array(T.T @ (link.K0 - SPEED**2 * vector_mass(link)) @ T)
    return np.asarray(T @ spsolve(A, T.T @ force.ravel())).reshape(-1, 3)


def bar_stress(x: float) -> float:
    """σ = ρω²(L² − x²)/2 of SSLV104 [MPa]."""
    return BAR.density * SPEED**2 * (LENGTH**2 - x**2) / 2 / 1e6


@case("SSLV104: rotating bar, static", STATIC)
def turning_bar_at_rest() -> list[Row]:
    """K0 δ = −M R0''; all nodes have the cubic u(x) up to the elements' error."""
    link, T, force = bar(10)
    u = deflection(link, T, force)
    text, tip = model((10, 1, 1), link), link.X[:, 0].argmax()
    worst = np.abs(u[:, 0] - static_deflection(link.X[:, 0])).max()
    stress = (point_rows(link, "root", np.array([0.0, 0, 0])).stress @ u.ravel())[0] / 1e6
    return [
        Row("tip [m]", 0.014625, float(u[tip, 0]), 1e-6, text),
        Row("greatest error of u(x) / tip", 0.0, float(worst / 0.014625), 1e-5, text),
        Row("σxx at the root [MPa]", bar_stress(0.0), float(stress), 0.002, text),
    ]


@case("SSLV105: rotating bar, steady state", STEADY)
def turning_bar() -> list[Row]:
    """(K0 − ω² M) g = −M R0'' in the link frame."""
    link, T, force = bar(10)
    u = steady_state(link, T, force)
    tip = link.X[:, 0].argmax()
    return [Row("tip [m]", 0.0151572424, float(u[tip, 0]), 1e-6, model((10, 1, 1), link))]


WIDE = 0.3  # of the bar in the scene; u(x) knows neither width nor thickness when ν = 0


def turning_bar_scene(
    initial: str, steps_per_revolution: int = 360, revolutions: float = 4, width: float = WIDE
) -> Scene:
    """SSLV105 as a scene: a solid bar driven in a revolute joint about its end at a constant 3000 rad/s.

    In the plane of motion the bar is 0.3 wide instead of 0.02. The equation has no geometric stiffness, so a
    bar whose first bending frequency is below the speed (width 0.02: 411 rad/s, 0.3: 5136) runs away sideways
    at the slightest disturbance, such as the Coriolis force while it is drawn out.
    Damping acts on the rate of the co-rotated deformation alone: it ends the vibration, not the steady state.
    """
    shape = {"kind": "bar", "between": ["A", "B"], "width": width, "thickness": SIDE}
    return scene_from(
        {
            "title": "SSLV105",
            "materials": {"bar": {"density": 7800.0, "youngs_modulus": 2e11, "poisson_ratio": 0.0}},
            "points": {"A": [0.0, 0.0], "B": [LENGTH, 0.0]},
            "links": {"bar": {"material": "bar", "shape": shape, "mesh": {"elements": [6, 2, 1]}}},
            "joints": {"A": {"kind": "revolute", "links": ["ground", "bar"], "at": "A"}},
            "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": SPEED}},
            "damping": {"alpha": 0.0, "beta": 2e-4},
            "analysis": {"revolutions": revolutions, "steps_per_revolution": steps_per_revolution, "initial": initial},
        }
    )


def tip_history(scene: Scene) -> tuple[np.ndarray, Link]:
    """(T, 3) mean deflection of the tip's face in the link frame at every step, by the transient solver."""
    rigid = linkage(scene)
    along = path(rigid, *drive_range(scene))
    elastic = elastic_model(scene, rigid)
    link = elastic.links[0]
    mean = face_surface(link, "tip", np.array([LENGTH, 0, 0])).fit[0]
    shots = snapshots(scene, rigid, along, elastic, steps_of(scene, elastic))
    return np.array([mean @ shot.states[0].g for shot in shots]), link


@case("SSLV105: rotating bar, by the transient solver", STEADY)
def turning_bar_by_steps() -> list[Row]:
    """From the quasi-static start, which is the steady state, and from rest, over four revolutions."""
    g, link = tip_history(turning_bar_scene("quasi-static"))
    from_rest, _ = tip_history(turning_bar_scene("rest"))
    text, tip = f"{model((6, 2, 1), link, 'hex20')}, 360 steps a revolution", 0.0151572424
    return [
        Row("tip at the quasi-static start [m]", tip, float(g[0, 0]), 1e-6, text),
        Row("greatest way from there in four revolutions / tip", 0.0, float(np.abs(g - g[0]).max() / tip), 1e-4, text),
        Row("tip after four revolutions [m]", tip, float(g[-1, 0]), 1e-5, text),
        Row("tip after four revolutions, from rest [m]", tip, float(from_rest[-1, 0]), 1e-5, text),
        Row("sideways then / tip", 0.0, float(np.abs(from_rest[-1, 1:]).max() / tip), 1e-5, text),
    ]
