"""Errors against exact solutions fall at the elements' order, no slower and no faster, and end below a cap.

Natural frequencies and compliances converge at twice the order of the energy norm: 4 for quadratic functions,
2 for linear ones (Strang and Fix, An Analysis of the Finite Element Method, 1973, ch. 1 and 6).
"""

from collections.abc import Callable

import numpy as np
import pytest

from kedfem.scene import Material

from .linear import free_map, frequencies, frequency_of
from .meshes import box, mapped_link
from .planes import energy_error
from .rotation import bar, steady_deflection, steady_state
from .spatial_beams import (
    FLAT,
    cantilever_modes,
    curved_cantilever,
    quarter_circle,
    straight,
    tip_displacement,
    wanted_modes,
)
from .vibrations import CUBE, DEEP, STEEL, lame_mode, lame_shape, pinned_beam, timoshenko


def slopes(error: Callable[[int], float], counts: list[int]) -> tuple[np.ndarray, float]:
    """Orders between neighbouring meshes of `counts` elements, and the last error's size."""
    errors = np.abs([error(n) for n in counts])
    return -np.diff(np.log(errors)) / np.diff(np.log(counts)), float(errors[-1])


def turning_bar_error(nodes: int) -> Callable[[int], float]:
    def error(n: int) -> float:
        link, T, force = bar(n, nodes)
        tip = link.X[:, 0].argmax()
        return steady_state(link, T, force)[tip, 0] / steady_deflection(np.array(0.5)) - 1

    return error


@pytest.mark.parametrize(("nodes", "order", "cap"), [(8, 2, 1.1e-3), (20, 4, 1e-7), (27, 4, 1e-7)])
def test_the_turning_bar_converges_to_SSLV105(nodes: int, order: int, cap: float):
    """Tip of the steady state, against u = sin(αx)/(α cos αL) − x."""
    found, last = slopes(turning_bar_error(nodes), [2, 4, 8])
    np.testing.assert_allclose(found, order, atol=0.1)  # smooth solution: asymptotic from the start
    assert last < cap


def cube_error(material: Material, nodes: int) -> Callable[[int], float]:
    def error(n: int) -> float:
        link = mapped_link((n, n, n), box((1, 1, 1)), material, nodes)
        return frequency_of(link, lame_shape(link.X), 40, 0.26) / lame_mode(material) - 1

    return error


@pytest.mark.parametrize(
    ("nodes", "order", "counts", "cap"),
    [
        (8, 2, [6, 8, 12], 5.9e-3),
        (10, 3.55, [4, 6, 8], 1.9e-4),  # six to a cube; on its way to 4
        (20, 4, [3, 4, 6], 1.2e-4),
        (27, 4, [3, 4, 6], 1.1e-4),
    ],
)
def test_the_cube_converges_to_lames_mode(nodes: int, order: int, counts: list[int], cap: float):
    """Unlike beams a case with shear in all directions; ν = 0.3."""
    found, last = slopes(cube_error(Material(density=1, youngs_modulus=1, poisson_ratio=0.3), nodes), counts)
    np.testing.assert_allclose(found, order, atol=0.2)  # the next term of the error still shows
    assert last < cap


def test_the_nearly_incompressible_cube_locks_with_8_nodes_and_hardly_with_more():
    """ν = 0.499: a mode without change of volume, which full integration cannot quite follow.

    On affordable meshes 20 and 27 nodes lose about two orders and 8 nodes all of theirs (Hughes, The Finite Element
    Method, 1987, ch. 4): do not use 8-node elements for nearly incompressible material.
    """
    for nodes in (20, 27):
        found, last = slopes(cube_error(CUBE, nodes), [3, 4, 6])
        np.testing.assert_allclose(found, 2.2, atol=0.3)
        assert last < 2.3e-3
    assert 0.08 < cube_error(CUBE, 8)(8) < 0.11


@pytest.mark.parametrize(("nodes", "order", "cap"), [(2, 2, 1.3e-3), (3, 4, 1.2e-6)])
@pytest.mark.parametrize("mode", [1, 2])
def test_beams_converge_to_timoshenko(nodes: int, order: int, cap: float, mode: int):
    """Bending frequencies of FV5; without shear locking the order shows already with a few elements."""
    exact = timoshenko(mode, 10, DEEP, STEEL)

    def error(n: int) -> float:
        link, fixed = pinned_beam(n, nodes)
        return frequencies(link, free_map(link, fixed), 4, 42.6)[{1: 0, 2: 2}[mode]] / exact - 1

    found, last = slopes(error, [10, 20, 40])
    np.testing.assert_allclose(found, order, atol=0.1)
    assert last < mode**2 * cap


@pytest.mark.parametrize(("nodes", "order", "cap"), [(2, 2, 1e-2), (3, 4, 1.2e-4)])
@pytest.mark.parametrize("kind", ["along y", "along z"])
def test_beams_in_space_converge_to_timoshenkos_cantilever(nodes: int, order: int, cap: float, kind: str):
    """Second bending frequencies, about both axes of the section."""
    exact = wanted_modes(0.5, FLAT)[kind][1]

    def error(n: int) -> float:
        link = straight([[0, 0, 0], [0.5, 0, 0]], FLAT, n, nodes)
        return cantilever_modes(link, 8, 80)[kind][1] / exact - 1

    found, last = slopes(error, [4, 8, 16])
    np.testing.assert_allclose(found, order, atol=0.35)  # of 4 elements not yet
    assert last < cap


def curved_error(radius: float, axis: str) -> Callable[[int], float]:
    """Of a quarter circle's tip under a force in its plane or across it."""
    k, exact = "xyz".index(axis), quarter_circle(radius, FLAT)[axis]
    return lambda n: tip_displacement(curved_cantilever(radius, FLAT, n + 1), np.eye(3)[k])[k] / exact - 1


@pytest.mark.parametrize(
    ("axis", "counts", "cap"), [("x", [8, 16, 32], 3e-7), ("y", [8, 16, 32], 3e-7), ("z", [16, 24, 32], 7e-8)]
)
def test_curved_beams_converge_to_castigliano(axis: str, counts: list[int], cap: float):
    """Element's and spline's error, along z against each other: they pass zero between 6 and 12 elements.

    Rounding is 2e-10 with 32 elements, where the order is judged, and 1e-9 with 64, where only a cap holds.
    """
    error = curved_error(0.5, axis)
    found, last = slopes(error, counts)
    assert ((found > 3.2) & (found < 4.2)).all()
    assert last < cap
    assert abs(error(64)) < 3e-8


@pytest.mark.parametrize("axis", ["x", "y", "z"])
def test_slender_curved_beams_do_not_lock(axis: str):
    """170 sections in radius: as exact with the same elements as 17 sections in radius."""
    for n, cap in ((4, 2e-3), (8, 1e-4), (16, 1e-5)):
        assert abs(curved_error(5.0, axis)(n)) < cap


def test_a_plane_cantilever_converges_in_energy() -> None:
    """Order 2 at least in the energy's norm; nodal values of quadratic elements on a regular mesh do better."""
    e = [energy_error((2 * n, n)) for n in (2, 4, 8, 16)]
    rates = np.log2(np.divide(e[:-1], e[1:]))
    assert (rates > 2.3).all()
    assert (rates < 2.8).all()
    assert e[-1] < 1e-4
