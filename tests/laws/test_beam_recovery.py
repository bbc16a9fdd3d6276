"""Stress at a probe on a planar beam: third and fourth order along straight runs, exact on both sides of a kink."""

import numpy as np
import pytest
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.testing import assert_allclose

from kedfem.dynamics.history import bent
from kedfem.links.beams.beam import beam_link
from kedfem.links.beams.beam_recovery import straight_run
from kedfem.links.beams.section import rectangle
from kedfem.links.point_rows import point_rows
from kedfem.links.record import Link
from kedfem.links.recovery import extreme_stresses, stress_modes, stress_recovery
from kedfem.output.frames import link_field
from tests.laws.strategies import MATERIAL

LENGTH, HEIGHT, THICKNESS = 2.0, 0.05, 0.02
SECTION = rectangle(HEIGHT, THICKNESS)
TURN = np.array([[0.6, -0.8], [0.8, 0.6]])


def beam(elements: int, points: tuple[tuple[float, float], ...] = ((0, 0), (LENGTH, 0)), nodes: int = 3) -> Link:
    """Its axis turned by an angle, so that no direction is special."""
    turned = np.array(points) @ TURN.T
    X = np.column_stack([turned, np.zeros(len(turned))])
    return beam_link("beam", X, SECTION, MATERIAL, elements, nodes)


def place(x: float, y: float) -> np.ndarray:
    return np.array([*(TURN @ [x, y]), 0.0])


def held_still(link: Link, held: list[int], forces: np.ndarray) -> np.ndarray:
    """K0 g = forces (n, 3) with nodes held by (u, v), the last of them clamped."""
    fixed = [3 * node + k for node in held for k in (0, 1)] + [3 * held[-1] + 2]
    free = np.setdiff1d(np.arange(link.unknowns), fixed)
    g = np.zeros(link.unknowns)
    K = sp.csc_array(link.K0[free][:, free])
    g[free] = spla.spsolve(K, forces.ravel()[free])
    return g


def sine_load(link: Link, k: float) -> np.ndarray:
    """Nodal forces of a load per length sin(k x) to the left of a beam from the origin: with its mass per length."""
    along = link.X[:, :2] @ TURN[:, 0]
    per_length = MATERIAL.density * SECTION.area
    out = np.zeros((link.n, 3))
    out[:, :2] = np.outer(link.mass[0] @ np.sin(k * along) / per_length, TURN[:, 1])
    return out


@pytest.mark.parametrize(("at", "order"), [(0.0, 2.7), (0.13, 1.7), (0.77, 3.0), (0.25, 3.8), (0.5, 3.8)])
def test_stress_on_a_straight_run_converges_at_nodes_with_the_fourth_power(at: float, order: float) -> None:
    """Elsewhere with the third, where the error has one sign.

    Cantilever under q = sin(kx): M = (sin kL − sin kx)/k² − (L − x) cos(kL)/k, σ = −M y/I.
    """
    k, x, y = 2.0, at * LENGTH, 0.4 * HEIGHT
    M = (np.sin(k * LENGTH) - np.sin(k * x)) / k**2 - (LENGTH - x) * np.cos(k * LENGTH) / k
    exact = -M * y / SECTION.second_moment
    largest = y / SECTION.second_moment / k
    errors = []
    for elements in (8, 16, 32):
        link = beam(elements)
        root = int(np.argmin(np.linalg.norm(link.X, axis=1)))
        g = held_still(link, [root], sine_load(link, k))
        stress = point_rows(link, "probe", place(x, y), np.zeros((0, 3))).stress @ g
        errors.append(abs(stress[0] - exact) / largest)
    assert errors[0] < (4e-3 if at == 0 else 5e-4)
    assert np.log2(errors[0] / errors[2]) / 2 > order  # at 0.13 the coarsest error passes zero
    assert errors[2] < 5e-5


def test_a_frame_of_a_bent_beam_shows_tension_and_compression() -> None:
    """A force F across the end of a cantilever and a pull N along it: σ = N/A ± F L h/2I at the wall, N/A at the end."""
    link, F, N = beam(8), 50.0, 2000.0
    root, end = (int(np.argmin(np.linalg.norm(link.X[:, :2] - TURN @ [x, 0], axis=1))) for x in (0, LENGTH))
    forces = np.zeros((link.n, 3))
    forces[end, :2] = TURN @ [N, F]
    g = held_still(link, [root], forces).reshape(-1, 3)
    moment, place_of_link = bent(g, np.eye(3)), (np.zeros(3), np.eye(3))
    field = link_field(link, stress_recovery(link), place_of_link, moment, 1.0)
    direct, bending = N / SECTION.area, F * LENGTH * HEIGHT / 2 / SECTION.second_moment
    assert_allclose(field.principal[root], [direct - bending, direct + bending], rtol=1e-6)
    assert_allclose(field.von_mises[root], direct + bending, rtol=1e-6)
    assert_allclose(field.principal[end], [0.0, direct], atol=1e-6 * bending)


def test_a_run_ends_at_kinks_corners_and_ends() -> None:
    link = beam(4, ((0, 0), (1, 0), (2, 0), (2, 1)))  # elements 0–3, 4–7 in one line, 8–11 round a corner
    nothing = np.zeros((0, 3))
    assert straight_run(link, 5, nothing).tolist() == list(range(8))
    assert straight_run(link, 9, nothing).tolist() == [8, 9, 10, 11]
    assert straight_run(link, 5, np.array([place(1.0, 0.0)])).tolist() == [4, 5, 6, 7]
    within = np.array([place(0.6, 0.0)])  # on element 2
    assert straight_run(link, 1, within).tolist() == [0, 1]
    assert straight_run(link, 2, within).tolist() == [2]
    assert straight_run(link, 5, within).tolist() == [3, 4, 5, 6, 7]


def test_a_kink_of_the_moment_is_not_smoothed() -> None:
    """Clamped, a force in the middle: M = F (L/2 − x) up to there, none beyond."""
    link = beam(8)
    distance = np.linalg.norm(link.X, axis=1)
    root, middle = int(distance.argmin()), int(np.abs(distance - LENGTH / 2).argmin())
    F = np.zeros((link.n, 3))
    F[middle, :2] = TURN[:, 1]
    g = held_still(link, [root], F)
    kinks = np.array([place(LENGTH / 2, 0.0)])
    for x in (0.9, 0.99, 1.01, 1.1):
        exact = -max(0.0, LENGTH / 2 - x) * (HEIGHT / 2) / SECTION.second_moment
        stress = (point_rows(link, "probe", place(x, HEIGHT / 2), kinks).stress @ g)[0]
        largest = LENGTH / 2 * HEIGHT / 2 / SECTION.second_moment
        assert abs(stress - exact) < 1e-7 * largest  # linear on both sides: exact but for rounding
    smooth = (point_rows(link, "probe", place(0.99, HEIGHT / 2), np.zeros((0, 3))).stress @ g)[0]
    assert abs(smooth + 0.01 * HEIGHT / 2 / SECTION.second_moment) > 1e-3 * largest  # what kinks are there for


@pytest.mark.parametrize("nodes", [2, 3, 5])
@pytest.mark.parametrize("elements", [2, 8])
def test_a_jump_of_the_moment_is_not_averaged(elements: int, nodes: int) -> None:
    """Clamped, F at the end and −F L in the middle: the highest moment is F L/2."""
    link = beam(elements, nodes=nodes)
    distance = np.linalg.norm(link.X, axis=1)
    root, middle, end = int(distance.argmin()), int(np.abs(distance - LENGTH / 2).argmin()), int(distance.argmax())
    F = np.zeros((link.n, 3))
    F[end, :2], F[middle, 2] = TURN[:, 1], -LENGTH
    recovery, g = stress_recovery(link), held_still(link, [root], F)
    highest = LENGTH / 2 * HEIGHT / 2 / SECTION.second_moment
    von, principal = extreme_stresses(recovery, g.reshape(-1, 3))
    assert von.argmax() == middle
    assert_allclose([von.max(), principal.max(), -principal.min()], highest, rtol=1e-6)
    modes = stress_modes(recovery, link, g[None])  # those of the envelope and of fatigue
    assert_allclose(np.linalg.norm(modes[:, :5, 0], axis=1).max(), highest, rtol=1e-6)


@pytest.mark.parametrize("offset", [0.5, 0.53])
def test_a_probe_a_little_outside_has_the_stress_of_the_outer_fibre(offset: float) -> None:
    """A thousandth of the length is 4 % of the height of a slender beam."""
    link = beam(4)
    g = held_still(link, [int(np.linalg.norm(link.X, axis=1).argmin())], sine_load(link, 1.0))
    fibre = point_rows(link, "probe", place(0.7, HEIGHT / 2)).stress @ g
    assert_allclose(point_rows(link, "probe", place(0.7, offset * HEIGHT)).stress @ g, fibre)


def test_two_node_elements_and_single_ones_keep_what_they_have() -> None:
    """One element of three nodes has two Gauss points; elements of two nodes one each."""
    for elements, nodes, used in ((1, 3, 3), (1, 2, 2), (6, 2, 5)):
        link = beam(elements, nodes=nodes)
        row = point_rows(link, "probe", place(1.0, HEIGHT / 2), np.zeros((0, 3))).stress[[0]]
        assert len(np.unique(row.indices // 3)) == used
