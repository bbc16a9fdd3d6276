"""Laws of sections of beams: constants against integrals, published numbers and finite elements of the section."""

from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
import skfem
from scipy.sparse.linalg import spsolve
from skfem.helpers import ddot, sym_grad, trace
from skfem.models.poisson import laplace, unit_load

from kedfem.dynamics.matrices.cholesky import Cholesky
from kedfem.links.beams.section import (
    Section,
    cowper,
    cowper_box,
    cowper_i,
    outline,
    rectangle,
    scene_section,
    torsion_stress,
    tube,
)
from kedfem.scene import BoxSection, ISection, SectionShape

WALLS = {
    "box": BoxSection(width=0.06, thickness=0.04, wall=0.004),
    "upright box": BoxSection(width=0.04, thickness=0.06, wall=0.004),
    "square": BoxSection(width=0.05, thickness=0.05, wall=0.003),
    "i": ISection(width=0.1, thickness=0.06, web=0.005, flange=0.008),
    "wide flanges": ISection(width=0.08, thickness=0.08, web=0.006, flange=0.006),
}  # fmt: skip
NU = 0.3


def moment_of_torsion(section: Section, y: np.ndarray, z: np.ndarray, dA: np.ndarray) -> float:
    """∫ (y σ_xz − z σ_xy) dA per G and twist."""
    stress = np.array([torsion_stress(section, *point) for point in zip(y, z, strict=True)])
    return float(np.sum((y * stress[:, 1] - z * stress[:, 0]) * dA))


@pytest.mark.parametrize(("h", "t"), [(0.03, 0.03), (0.05, 0.02), (0.02, 0.1)])
def test_torsion_constant_of_a_rectangle_is_the_moment_of_its_stresses(h: float, t: float) -> None:
    r, w = np.polynomial.legendre.leggauss(40)
    y, z = (g.ravel() for g in np.meshgrid(h / 2 * r, t / 2 * r, indexing="ij"))
    section = rectangle(h, t)
    moment = moment_of_torsion(section, y, z, np.outer(w, w).ravel() * h * t / 4)
    assert moment == pytest.approx(section.torsion_constant, rel=1e-4)  # the series at the edges


@pytest.mark.parametrize(("ratio", "J", "most"), [(1, 0.1406, 0.675), (2, 0.229, 0.930), (10, 0.312, 1.000)])
def test_torsion_of_a_rectangle_is_the_published(ratio: float, J: float, most: float) -> None:
    """Timoshenko and Goodier, Theory of Elasticity, table of §109: J = k1 a b³, τ_max = k G θ b amid the long side."""
    wide, upright = rectangle(0.01 * ratio, 0.01), rectangle(0.01, 0.01 * ratio)
    for section in (wide, upright):
        assert section.torsion_constant == pytest.approx(J * ratio * 0.01**4, rel=2e-3)
    assert abs(torsion_stress(wide, 0, 0.005)[0]) == pytest.approx(most * 0.01, rel=2e-3)
    assert abs(torsion_stress(upright, 0.005, 0)[1]) == pytest.approx(most * 0.01, rel=2e-3)
    for corner in (torsion_stress(wide, 0.005 * ratio, 0.005), torsion_stress(wide, 0.005 * ratio, 0.002)[:1]):
        np.testing.assert_allclose(corner, 0, atol=1e-4)  # of 0.01: nothing crosses the edge


def test_sections_of_circles() -> None:
    """A tube is a circle less a circle; J = ∫ r² dA; κ of Cowper: 0.8864 solid, 0.5306 thin, ν = 0.3."""
    whole, bore, ring = tube(0.05, 0, 0.9), tube(0.03, 0, 0.9), tube(0.05, 0.03, 0.6)
    assert ring.area == pytest.approx(whole.area - bore.area)
    assert ring.second_moment == pytest.approx(whole.second_moment - bore.second_moment)
    assert ring.torsion_constant == pytest.approx(ring.second_moment + ring.second_moment_z)
    assert whole.second_moment == pytest.approx(np.pi * 0.05**4 / 64)
    assert torsion_stress(ring, 0.02, 0.01) == (-0.01, 0.02)
    assert cowper(0.3, 0.0) == pytest.approx(6 * 1.3 / (7 + 1.8))
    assert cowper(0.3, 1.0) == pytest.approx(2 * 1.3 / (4 + 0.9))


# -- thin walls -----------------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Grid:
    """Lines through all edges of a section, so finely that walls have some elements; which quadrilaterals are in it."""

    y: np.ndarray
    z: np.ndarray
    mesh: skfem.MeshQuad
    inside: np.ndarray


def grid(shape: SectionShape, across: int = 4) -> Grid:
    h, t = shape.width / 2, shape.thickness / 2
    if isinstance(shape, BoxSection):
        cuts = [-h, shape.wall - h, h - shape.wall, h], [-t, shape.wall - t, t - shape.wall, t]
        wall = shape.wall
    else:
        assert isinstance(shape, ISection)
        half = shape.web / 2
        cuts = [-h, shape.flange - h, h - shape.flange, h], [-t, -half, half, t]
        wall = min(shape.web, shape.flange)
    y, z = (
        np.unique(np.round(np.concatenate([
            np.linspace(a, b, 1 + int(np.ceil(min(across, (b - a) / wall * across)))) if b - a < 1.01 * wall
            else a + (b - a) * 0.5 * (1 - np.cos(np.pi * np.linspace(0, 1, 4 * across + 1)))
            for a, b in pairwise(of)
        ]), 12))
        for of in cuts
    )  # fmt: skip
    mesh = skfem.MeshQuad.init_tensor(y, z)
    middle = mesh.p[:, mesh.t].mean(axis=1)
    (a, b), (c, d) = (of[1:3] for of in cuts)
    between, beside = (middle[0] > a) & (middle[0] < b), (middle[1] > c) & (middle[1] < d)
    inside = ~(between & beside) if isinstance(shape, BoxSection) else ~(between & ~beside)
    return Grid(y, z, mesh, inside)


@pytest.mark.parametrize("name", WALLS)
def test_area_and_second_moments_are_integrals(name: str) -> None:
    of, section = grid(WALLS[name]), scene_section(WALLS[name], None, NU)
    basis = skfem.Basis(of.mesh, skfem.ElementQuad1(), elements=np.flatnonzero(of.inside), intorder=4)
    dA, (y, z) = basis.dx, np.asarray(basis.global_coordinates())
    found = [float(np.sum(f * dA)) for f in (np.ones_like(y), y**2, z**2)]
    np.testing.assert_allclose([section.area, section.second_moment, section.second_moment_z], found, rtol=1e-12)


def membrane(of: Grid, hollow: bool) -> tuple[skfem.Basis, np.ndarray, float]:
    """−∇²φ = 2, φ = 0 on the outer edge, even over a hole: φ, and 2 ∫ φ with the hole."""
    element = skfem.ElementQuad2()
    whole = skfem.Basis(of.mesh, element)
    inside = skfem.Basis(of.mesh, element, elements=np.flatnonzero(of.inside))
    loaded = whole if hollow else inside
    K, f = laplace.assemble(inside), 2 * unit_load.assemble(loaded)
    hole = np.unique(whole.element_dofs[:, ~of.inside]) if hollow else np.zeros(0, int)
    sides = of.mesh.f2t
    within = np.where(sides >= 0, of.inside[sides] | hollow, False)
    fixed = np.unique(whole.get_dofs(np.flatnonzero(within[0] != within[1])).all())
    free = np.setdiff1d(np.unique(inside.element_dofs), np.union1d(fixed, hole))
    rows, columns = np.concatenate([free, hole]), np.r_[np.arange(len(free)), np.full(len(hole), len(free))]
    shape = len(f), len(free) + hollow
    tied = sp.csc_array(sp.coo_array((np.ones(len(rows)), (rows, columns)), shape=shape))
    phi = tied @ spsolve(sp.csc_array(tied.T @ K @ tied), tied.T @ f)
    return inside, phi, float(f @ phi)


@pytest.mark.parametrize("name", WALLS)
def test_torsion_is_that_of_the_membrane_over_the_section(name: str) -> None:
    """J, and amid walls the stress: the slope of φ."""
    shape = WALLS[name]
    section = scene_section(shape, None, NU)
    basis, phi, J = membrane(grid(shape), isinstance(shape, BoxSection))
    assert section.torsion_constant == pytest.approx(J, rel=6e-3)
    slopes = basis.interpolate(phi).grad
    y, z = np.asarray(basis.global_coordinates())
    h, t = section.height, section.thickness
    along, across = np.abs(y.mean(axis=1)) / h, np.abs(z.mean(axis=1)) / t
    if isinstance(shape, BoxSection):
        amid = (along < 0.1) | (across < 0.1)
    else:
        amid = (along < 0.2) | ((across > 0.25) & (across < 0.35))
    known = np.array([torsion_stress(section, *at) for at in zip(y[amid].ravel(), z[amid].ravel(), strict=True)])
    found = np.stack([slopes[1][amid].ravel(), -slopes[0][amid].ravel()], axis=1)
    assert np.abs(known).max(axis=0).min() > 0  # both walls
    np.testing.assert_allclose(known, found, atol=0.03 * np.abs(found).max())


@pytest.mark.long
@pytest.mark.parametrize("axis", [0, 1])
@pytest.mark.parametrize("name", WALLS)
def test_a_short_cantilever_bends_as_a_solid_one(name: str, axis: int) -> None:
    """Five times as long as it is deep, its foot free to warp: shear is 3 to 30 % of its deflection."""
    shape, section = WALLS[name], scene_section(WALLS[name], None, NU)
    deep = (section.height, section.thickness)[axis]
    of, length = grid(shape, across=1), 5 * deep
    hexes = skfem.MeshHex.init_tensor(of.y, of.z, np.linspace(0, length, 9))
    middle = hexes.p[:, hexes.t].mean(axis=1)
    quads = of.mesh.element_finder()(middle[0], middle[1])
    mesh = hexes.restrict(np.flatnonzero(of.inside[quads]))
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementHex2()), intorder=5)
    lam, mu = NU / ((1 + NU) * (1 - 2 * NU)), 0.5 / (1 + NU)

    @skfem.BilinearForm
    def elastic(u: Any, v: Any, w: Any) -> Any:
        e, d = sym_grad(u), sym_grad(v)
        return lam * trace(e) * trace(d) + 2 * mu * ddot(e, d)

    @skfem.LinearForm
    def pulled(v: Any, w: Any) -> Any:
        return v[axis]

    @skfem.LinearForm
    def bent(v: Any, w: Any) -> Any:
        return v[2] * w.x[axis]

    K, f = elastic.assemble(basis), np.zeros(basis.N)
    moment = (section.second_moment, section.second_moment_z)[axis]
    for place, sign in ((0.0, -1), (length, 1)):
        end = mesh.facets_satisfying(lambda x, place=place: np.abs(x[2] - place) < 1e-9)
        beside = np.abs(mesh.p[1 - axis][mesh.facets[:, end]].mean(axis=0))  # the walls that carry the force
        web, half = section.kind == "i" and axis == 0, (section.thickness, section.height)[axis] / 2
        walls = end[beside < section.walls[0] if web else beside > half - section.walls[axis]]
        loaded, whole = (skfem.FacetBasis(mesh, basis.elem, facets=x) for x in (walls, end))
        f += sign * pulled.assemble(loaded) / loaded.dx.sum()
        if not place:
            f += length * bent.assemble(whole) / moment
    soft = sp.eye_array(basis.N) * 1e-9 * K.diagonal().max()  # the loads are in balance
    deflection = f @ Cholesky(sp.csr_array(K + soft), "the cantilever").solve(f)
    bending = length**3 / (3 * moment)
    shear = length / (section.shear_coefficients[axis] * mu * section.area)
    assert deflection == pytest.approx(bending + shear, rel=0.02)
    assert 0.03 < shear / bending < 0.3


def test_constants_of_profiles_are_those_of_tables() -> None:
    """EN 10365, IPE 200 without its fillets of 12 mm: less by 0.0644·4 r² of area, and by what they add to I."""
    ipe = scene_section(ISection(width=0.2, thickness=0.1, web=0.0056, flange=0.0085), None, NU)
    fillets = (4 - np.pi) * 0.012**2
    assert ipe.area + fillets == pytest.approx(28.48e-4, rel=1e-3)
    arm = 0.1 - 0.0085 - 0.223 * 0.012
    assert ipe.second_moment + fillets * arm**2 == pytest.approx(1943e-8, rel=2e-3)
    assert ipe.second_moment_z == pytest.approx(142.4e-8, rel=5e-3)
    assert cowper_box(0.3, 1.0, 1.0) == pytest.approx(0.4355, rel=1e-2)  # of a thin square tube
    assert cowper_i(0.3, 1.0, 0.0, 1.0, 1.0) == pytest.approx(10 * 1.3 / (12 + 11 * 0.3))  # no flanges: a rectangle


def test_drawn_sections_have_the_area_and_corners_of_the_section() -> None:
    for name, shape in WALLS.items():
        section = scene_section(shape, None, NU)
        points, quads = outline(section)
        a, b, c, d = points[quads].transpose(1, 0, 2)
        p, q = c - a, d - b
        cross = p[:, 0] * q[:, 1] - p[:, 1] * q[:, 0]
        assert np.abs(cross).sum() / 2 == pytest.approx(section.area), name
        assert (cross > 0).all() or (cross < 0).all(), name
        np.testing.assert_allclose(np.ptp(points, axis=0), [section.height, section.thickness])
