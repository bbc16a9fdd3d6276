"""Planar beams with co-rotational frames: few elements of many nodes against closed forms and converged solutions."""

from collections.abc import Sequence

import numpy as np
import pytest
import scipy.linalg
from numpy.testing import assert_allclose

from kedfem.accuracy.histories import histories
from kedfem.accuracy.prepared import meshed
from kedfem.dynamics.frames import Deformed, deformation, frame_force, frames_of, position, rotation
from kedfem.links.beams.beam import beam_link
from kedfem.links.beams.beam_segments import beam_segments
from kedfem.links.beams.section import Section, rectangle
from kedfem.links.record import Link
from kedfem.scene import Material, Scene, scene_from
from tests.scenes import example

from .large_deflection import ELASTICA, history

METAL = Material(density=2796.0, youngs_modulus=7e10, shear_modulus=2.7e10)
THIN = rectangle(1e-3, 1e-3)  # of a beam of 1 m: stretch and shear are 1e-6 of the deflection


def cantilever(elements: int, nodes: int, section: Section = THIN) -> Sequence[Link]:
    """Segments of a beam of 1 m, in a direction of no account."""
    link = beam_link("any", np.array([[0.1, 0.2, 0.0], [0.7, 1.0, 0.0]]), section, METAL, elements, nodes)
    return beam_segments(link, METAL).parts


def force(parts: Sequence[Link], u: np.ndarray) -> np.ndarray:
    """Internal forces at the nodes of segments in a row, for displacements (n, 3) there."""
    f, first = np.zeros_like(u), 0
    for part in parts:
        here = slice(first, first + part.n)
        y = position(part, u[here])
        for frame in frames_of(part):
            Q, angle = rotation(part, frame.fit, y, float(u[here, 2].mean()))
            none = np.zeros_like(y)
            now = Deformed(Q, angle, deformation(part, y, Q, angle), none)
            f[here] += frame_force(part, frame, now, y, 0.0)[0]
        first += part.n - 1
    return f


def bent(parts: Sequence[Link], load: np.ndarray, shares: int) -> np.ndarray:
    """Displacements of a clamped beam with a load (3,) at its tip, applied in parts; Newton, tangent by differences."""
    u = np.zeros((sum(part.n - 1 for part in parts) + 1, 3))
    size, step = u[1:].size, 1e-6

    def internal(free: np.ndarray) -> np.ndarray:
        return force(parts, np.concatenate([np.zeros((1, 3)), free.reshape(-1, 3)]))[1:].ravel()

    x, wanted = np.zeros(size), np.zeros(size)
    for share in np.arange(1, shares + 1) / shares:
        wanted[-3:] = share * load
        for _ in range(30):
            tangent = [internal(x + step * e) - internal(x - step * e) for e in np.eye(size)]
            change = np.linalg.solve(np.transpose(tangent) / (2 * step), wanted - internal(x))
            x += change
            if np.abs(change).max() < 1e-8:
                break
        else:
            raise AssertionError("does not converge")
    u[1:] = x.reshape(-1, 3)
    return u


# Digits in print 5e-7, stretch and shear 1e-6; a single element of 5 nodes is that good while it bends by less than 60°.
@pytest.mark.parametrize(
    ("elements", "nodes", "cap"),
    [pytest.param(1, 5, 8e-4, marks=pytest.mark.long), pytest.param(1, 7, 6e-6, marks=pytest.mark.long)],
)
def test_few_elements_of_many_nodes_bend_into_the_elastica(elements: int, nodes: int, cap: float) -> None:
    parts = cantilever(elements, nodes)
    EI = METAL.youngs_modulus * THIN.second_moment
    along, across = np.array([0.6, 0.8]), np.array([-0.8, 0.6])
    for load, expected in ELASTICA.items():
        tip = bent(parts, np.array([*(load * EI * across), 0.0]), int(2 * load))[-1, :2]
        assert_allclose([tip @ across, -tip @ along], expected, atol=cap)


def four_bar(element: str, elements: int, steps: int, revolutions: float = 3.0) -> Scene:
    """The source's four-bar from rest at 600 rpm, 2 % damping, co-rotational frames."""
    raw = example("four_bar_beams")
    for link in raw["links"].values():
        link |= {"element": element, "mesh": {"elements": elements}}
    raw["analysis"] = {
        "revolutions": revolutions,
        "steps_per_revolution": steps,
        "initial": "rest",
        "frames": "co-rotational",
    }
    return scene_from(raw)


def test_one_element_of_seven_nodes_a_link_follows_the_four_bar_within_a_third_of_a_percent() -> None:
    """Two thirds of that are the steps', of which twice as many leave a quarter."""
    found = histories(meshed(four_bar("beam7", 1, 2200)))
    stress = found.channels["probes/rocker_outer/stress"][1][:, :1]
    assert history("four_bar_600_damped").difference(found.time, stress)[0] < 0.0035


@pytest.mark.parametrize(("nodes", "order"), [(3, 4), (4, 6), (5, 8)])
def test_frequencies_of_a_beam_converge_with_twice_the_degree(nodes: int, order: int) -> None:
    """Eigenvalues of degree p: error of order 2p; a simply supported beam's first."""
    thick = rectangle(0.05, 0.05)
    I, A = thick.second_moment, thick.area  # noqa: E741
    E, GA = METAL.youngs_modulus, METAL.shear_modulus * A * thick.shear_coefficient
    exact = timoshenko_frequency(np.pi, E * I, GA, METAL.density * A, METAL.density * I)
    errors = []
    counts = {3: (4, 8), 4: (2, 4), 5: (2, 3)}[nodes]  # the last error at least 1e-7: far above rounding
    for elements in counts:
        link = beam_link("any", np.array([[0.0, 0, 0], [1, 0, 0]]), thick, METAL, elements, nodes)
        K, M = link.K0.toarray(), scipy.linalg.block_diag(*(m.toarray() for m in link.mass))
        M = M[np.ix_(*[np.arange(3 * link.n).reshape(3, -1).T.ravel()] * 2)]
        free = np.setdiff1d(np.arange(3 * link.n), [0, 1, 3 * link.n - 2])
        values = scipy.linalg.eigh(K[np.ix_(free, free)], M[np.ix_(free, free)], eigvals_only=True)
        errors.append(np.abs(values / exact - 1).min())
    slope = np.log(errors[0] / errors[1]) / np.log(counts[1] / counts[0])
    assert order - 0.5 < slope < order + 0.5
    assert errors[1] < 1e-3


def timoshenko_frequency(k: float, EI: float, GA: float, mass: float, inertia: float) -> float:
    """Least ω² of a simply supported Timoshenko beam at the wave number k: v = a sin kx, ψ = b cos kx, exactly."""
    K = np.array([[GA * k * k, -GA * k], [-GA * k, EI * k * k + GA]])
    return float(scipy.linalg.eigh(K, np.diag([mass, inertia]), eigvals_only=True)[0])
