"""Stress concentrations of parts from CAD, and the modes and stress of one rod meshed in three ways."""

from collections.abc import Callable
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from types import ModuleType

import numpy as np
import scipy.sparse as sp
import skfem
from geometry.catalogue import chamfered
from geometry.drawing import box, disc, strap, without
from geometry.make import empty_model
from skfem.helpers import grad

from kedfem.accuracy.meshes import FINEST_FILLET
from kedfem.links.record import Link
from kedfem.links.recovery import COMPONENTS, nodal_stress, stress_recovery
from kedfem.links.solid import solid_link
from kedfem.mesh.cad.model import CadKeys
from kedfem.mesh.methods import made_mesh
from kedfem.mesh.session import gmsh_options
from kedfem.scene import Cad, link_from

from .cad import STEEL
from .cases import Row, case
from .linear import deflection, free_map, frequencies, held

LENGTH, TALL, SLIM, FILLET = 100.0, 20.0, 15.0, 5.0  # mm: half heights of a stepped bar or radii of a shaft
STEP_AT, HOLE, FLAT = 45.0, 4.0, 4.0  # where the fillet begins, the bore's radius, the flat bars' thickness


def _outline(occ: ModuleType, low: float) -> int:
    """A section with the fillet, from y = 0 (a half) or symmetric about it; its face."""
    upper = [(LENGTH, SLIM), (STEP_AT + FILLET, SLIM), (STEP_AT, TALL), (0.0, TALL)]
    lower = [(0.0, low), (LENGTH, low)] if low == 0 else [(x, -y) for x, y in upper[::-1]]
    ends = [occ.addPoint(x, y, 0) for x, y in [*lower, *upper]]
    lines = []
    for k, end in enumerate(ends):
        (xa, ya), (xb, _) = (np.array([*lower, *upper][i]) for i in (k - 1, k))
        if {xa, xb} == {STEP_AT, STEP_AT + FILLET}:
            centre = occ.addPoint(STEP_AT + FILLET, np.sign(ya) * TALL, 0)
            lines.append(occ.addCircleArc(ends[k - 1], centre, end))
        else:
            lines.append(occ.addLine(ends[k - 1], end))
    return int(occ.addPlaneSurface([occ.addCurveLoop(lines)]))


def flat_bar(occ: ModuleType) -> None:
    """A flat bar that steps down from 40 to 30 mm with fillets of 5 mm."""
    occ.extrude([(2, _outline(occ, -TALL))], 0, 0, FLAT)


def shaft(occ: ModuleType) -> None:
    """A shaft that steps down from 40 to 30 mm with a fillet of 5 mm."""
    occ.revolve([(2, _outline(occ, 0.0))], 0, 0, 0, 1, 0, 0, 2 * np.pi)


def bored_bar(occ: ModuleType) -> None:
    """A flat bar 40 mm wide with a bore of 8 mm in its middle."""
    without(occ, box(occ, (0, LENGTH), (-TALL, TALL), (0, FLAT)), [disc(occ, (STEP_AT, 0, HOLE), (-1, 9))])


def rod(occ: ModuleType, edges: float = 0.0) -> None:
    """A rod of two eyes and a waist, its outer edges chamfered or sharp."""
    body = strap(occ, (0, 0, 16), (90, 0, 11), (0, 12))
    if edges:
        body = chamfered(occ, body, edges, lambda _, along: abs(along[2]) < 0.5)
    without(occ, body, [disc(occ, (0, 0, 8), (-1, 13)), disc(occ, (90, 0, 5), (-1, 13))])


def chamfered_rod(occ: ModuleType) -> None:
    """The rod with chamfers of 0.4 mm."""
    rod(occ, 0.4)


@cache
def meshed(draw: Callable[[ModuleType], None], element: str | None, **mesh: float | str) -> Link:
    """The link of a drawing."""
    raw = {"material": "steel", "shape": {"kind": "cad", "file": "part.step"}, "mesh": mesh}
    link = link_from(raw | ({"element": element} if element else {}))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "part.step"
        with empty_model() as occ:
            import gmsh

            draw(occ)
            occ.synchronize()
            with gmsh_options(gmsh, {"General.Terminal": 0.0}):
                gmsh.write(str(path))
        assert isinstance(link.shape, Cad)
        made = made_mesh(CadKeys("part.step", "solid"), "part", link, link.shape, path)
    return solid_link("part", made, STEEL, np.eye(3))


def pulled(link: Link) -> np.ndarray:
    """(n, 3) state of a part whose end at the greatest x is pulled by one newton, the other held along x."""
    X = link.X
    far = link.basis.mesh.facets_satisfying(lambda x: np.isclose(x[0], X[:, 0].max()))
    end = skfem.FacetBasis(link.basis.mesh, link.basis.elem, facets=far, intorder=4)
    force = np.zeros((link.n, 3))
    force[:, 0] = skfem.LinearForm(lambda v, _: 1.0 * v).assemble(end) / float(np.sum(end.dx))
    near = np.isclose(X[:, 0], X[:, 0].min())
    about = np.where(near, np.hypot(*(X[:, 1:] - X[near][:, 1:].mean(axis=0)).T), np.inf)
    one, other = np.arange(link.n) == about.argmin(), np.zeros(link.n, bool)
    other[np.flatnonzero(near)[np.abs(X[near][:, 1] - X[one][0, 1]).argmax()]] = True
    return deflection(link, free_map(link, held((near, "x"), (one, "yz"), (other, "z"))), force)


def principal(link: Link, g: np.ndarray) -> np.ndarray:
    """(n,) greatest principal stress at the nodes [Pa]."""
    found = nodal_stress(stress_recovery(link), g)
    tensor = np.zeros((len(found), 3, 3))
    for k, (i, j) in enumerate(COMPONENTS):
        tensor[:, i, j] = tensor[:, j, i] = found[:, k]
    return np.asarray(np.linalg.eigvalsh(tensor)[:, 2])


def factor(link: Link, area: float) -> float:
    """Highest stress away from the ends over that of one newton on an area [mm²]."""
    x = link.X[:, 0]
    away = np.abs(x - x.mean()) < 0.3 * np.ptp(x)
    return float(principal(link, pulled(link))[away].max() * area * 1e-6)


def bent(link: Link) -> float:
    """Greatest principal stress [Pa] in the waist of the rod, away from its edges; one newton across on the far bore."""
    x, y, z = 1e3 * link.X.T
    mesh = link.basis.mesh
    bore = mesh.facets_satisfying(lambda X: np.abs(np.hypot(X[0] - 0.09, X[1]) - 0.005) < 6e-4, True)
    eye = skfem.FacetBasis(mesh, link.basis.elem, facets=bore, intorder=4)
    force = np.zeros((link.n, 3))
    force[:, 1] = skfem.LinearForm(lambda v, _: 1.0 * v).assemble(eye) / float(np.sum(eye.dx))
    fixed = held((np.abs(np.hypot(x, y) - 8) < 0.01, "xyz"))
    stress = principal(link, deflection(link, free_map(link, fixed), force))
    return float(stress[(np.abs(x - 45) < 15) & (np.abs(z - 6) < 4)].max())


def _words(link: Link) -> str:
    return f"{link.method.split(';')[0]}, {link.unknowns:,} unknowns"


def _rows(draw: Callable[[ModuleType], None], area: float, exact: float) -> list[Row]:
    """The factor by tetrahedra, which are finer where a face is curved, by swept hexahedra of one size, and by the sizes
    that an accuracy of 2 % chooses, finer at fillets."""
    made = (
        (0.03, meshed(draw, "tet10", unknowns=40_000)),
        (0.12, meshed(draw, None, unknowns=40_000)),
        (0.03, meshed(draw, None, fillet_angle=np.radians(FINEST_FILLET))),
    )
    return [Row("Kt, of the net section [-]", exact, factor(link, area), cap, _words(link)) for cap, link in made]


@case(
    "Flat bar with a bore in tension",
    "Howland: On the stresses in the neighbourhood of a circular hole in a strip under tension, Phil. Trans. A 229 "
    "(1930), d/W = 0.2, fitted in Pilkey: Peterson's Stress Concentration Factors (1997), chart 4.1",
    long=True,
)
def bore() -> list[Row]:
    """40 mm wide, 4 mm thick, bore of 8 mm. Swept hexahedra of one size are too coarse at a bore."""
    slim = 1 - HOLE / TALL
    gross = 0.284 + 2 / slim - 0.6 * slim + 1.32 * slim**2
    return _rows(bored_bar, 2 * (TALL - HOLE) * FLAT, gross * slim)


@case(
    "Flat bar with shoulder fillets in tension",
    "a plane model of quadratic triangles of 0.2 mm in the fillet, without any code of kedfem; row one: Pilkey: "
    "Peterson's Stress Concentration Factors (1997), chart 3.1: D/d = 4/3, r/d = 1/6",
    long=True,
)
def shoulder() -> list[Row]:
    """40 to 30 mm, fillets of 5 mm, 4 mm thick."""
    exact = section(turned=False)
    return [
        Row("Kt by the chart's fit, of the net section [-]", exact, fit(3.1), 0.03, "no mesh: the handbook's number"),
        *_rows(flat_bar, 2 * SLIM * FLAT, exact),
    ]


#: Peterson's fits in h/r up to 2, Pilkey (1997): constant, with sqrt(h/r), with h/r, of each power of 2h/D.
FITS = {
    3.1: ((1.006, 1.008, -0.044), (-0.115, -0.584, 0.315), (0.245, -1.006, -0.257), (-0.135, 0.582, -0.017)),
    3.4: ((0.926, 1.157, -0.099), (0.012, -3.036, 0.961), (-0.302, 3.977, -1.744), (0.365, -2.098, 0.878)),
}


def fit(chart: float) -> float:
    """Kt of the stepped bar by a chart's fit."""
    h = TALL - SLIM
    terms = np.array(FITS[chart]) @ [1.0, np.sqrt(h / FILLET), h / FILLET]
    return float(terms @ (h / TALL) ** np.arange(4))


@case(
    "Shaft with a shoulder fillet in tension",
    "an axisymmetric model of quadratic triangles of 0.2 mm in the fillet, without any code of kedfem; row one: Pilkey: "
    "Peterson's Stress Concentration Factors (1997), chart 3.4, whose fit lies below it",
    long=True,
)
def stepped_shaft() -> list[Row]:
    """40 to 30 mm, fillet of 5 mm. The chart's fit is some 9 % below elasticity here, so that it is no reference."""
    exact = section(turned=True)
    return [
        Row("Kt by the chart's fit, of the net section [-]", exact, fit(3.4), 0.12, "no mesh: the handbook's number"),
        *_rows(shaft, np.pi * SLIM**2, exact),
    ]


CROSS = 6.0  # diameter of the bore through a shaft of 2 SLIM [mm]


def bored_shaft(occ: ModuleType) -> None:
    """A shaft of 30 mm with a bore across its middle."""
    bore = occ.addCylinder(LENGTH / 2, -2 * SLIM, 0, 0, 4 * SLIM, 0, CROSS / 2)
    occ.cut([(3, occ.addCylinder(0, 0, 0, LENGTH, 0, 0, SLIM))], [(3, bore)])


@case(
    "Shaft with a cross bore in tension",
    "Pilkey: Peterson's Stress Concentration Factors (1997), chart 4.66 for tubes, at an inner diameter of 0: "
    "Ktg = 3 + 0.427 d/D + 11.357 (d/D)²",
    long=True,
)
def cross_bore() -> list[Row]:
    """30 mm, a bore of 6 mm, which nothing sweeps: tetrahedra of the usual size, and by the sizes for 2 %."""
    share = CROSS / (2 * SLIM)
    exact = 3 + 0.427 * share + 11.357 * share**2
    made = ((0.08, meshed(bored_shaft, None)), (0.03, meshed(bored_shaft, None, fillet_angle=np.radians(FINEST_FILLET))))
    name = "Kt, of the gross section [-]"
    return [Row(name, exact, factor(link, np.pi * SLIM**2), cap, _words(link)) for cap, link in made]


@case(
    "One rod: sharp edges, chamfers left out, chamfers",
    "the rod with its chamfers in 10-node tetrahedra of 80,000 unknowns",
    long=True,
)
def three_rods() -> list[Row]:
    """Eyes 90 mm apart, chamfers of 0.4 mm: frequencies of the free rod, stress in the waist where it is bent."""
    ways = {
        "sharp edges": meshed(rod, None),
        "chamfers left out": meshed(chamfered_rod, None, defeature_size="0.5 mm"),
        "chamfers": meshed(chamfered_rod, "tet10"),
    }
    finest = meshed(chamfered_rod, "tet10", unknowns=80_000)
    exact, stress = free(finest), bent(finest)
    return [
        row
        for name, link in ways.items()
        for row in (
            *(
                Row(f"{name}: mode {k + 1} [Hz]", float(exact[k]), float(found), 5e-3, _words(link))
                for k, found in enumerate(free(link))
            ),
            Row(f"{name}: stress in the waist [Pa/N]", stress, bent(link), 0.02, _words(link)),
        )
    ]


def free(link: Link) -> np.ndarray:
    """The first six elastic frequencies [Hz], nothing held."""
    return frequencies(link, free_map(link, held()), 12, 5000.0)[6:]


@cache
def section(turned: bool, fine: float = 0.2) -> float:
    """Kt of shaft or flat bar from the half section: greatest stress on the fillet over that of the slim end."""
    mesh = _half_section(fine)
    basis = skfem.Basis(mesh, skfem.ElementVector(skfem.ElementTriP2()), intorder=6)
    lam, mu = (0.3 / (1.3 * 0.4) if turned else 0.3 / (1 - 0.3**2), 1 / 2.6)  # E = 1; plane stress of the flat bar

    @skfem.BilinearForm
    def energy(u, v, w):
        (H, G), r = (grad(u), grad(v)), w.x[1] if turned else 1.0
        around, tried = (turned * each[1] / r for each in (u, v))
        trace = (H[0, 0] + H[1, 1] + around) * (G[0, 0] + G[1, 1] + tried)
        double = H[0, 0] * G[0, 0] + H[1, 1] * G[1, 1] + around * tried
        return (lam * trace + 2 * mu * double + mu * (H[0, 1] + H[1, 0]) * (G[0, 1] + G[1, 0])) * r

    end = skfem.FacetBasis(
        mesh, basis.elem, facets=mesh.facets_satisfying(lambda x: np.isclose(x[0], LENGTH)), intorder=6
    )
    force = skfem.LinearForm(lambda v, w: v[0] * (w.x[1] if turned else 1.0)).assemble(end)
    fixed = np.concatenate([basis.get_dofs(lambda x, i=i: np.isclose(x[i], 0)).all([f"u^{i + 1}"]) for i in (0, 1)])
    K = sp.csr_matrix(energy.assemble(basis))
    u = skfem.solve(*skfem.condense(K, force, D=np.unique(fixed)))

    def off(x):
        return np.array([x[0] - STEP_AT - FILLET, x[1] - TALL])

    arc = mesh.facets_satisfying(lambda x: np.abs(np.hypot(*off(x)) - FILLET) < 0.02 * FILLET, boundaries_only=True)
    field = skfem.FacetBasis(mesh, basis.elem, facets=arc, intorder=3)
    U, x = field.interpolate(u), field.global_coordinates()
    H, (nx, ny) = U.grad, off(x) / np.hypot(*off(x))
    along = ny**2 * H[0, 0] + nx**2 * H[1, 1] - nx * ny * (H[0, 1] + H[1, 0])
    return float((lam * (H[0, 0] + H[1, 1] + turned * U[1] / x[1]) + 2 * mu * along).max())


def _half_section(fine: float) -> skfem.MeshTri:
    """Triangles of the shaft's half section, this fine [mm] in the fillet."""
    import gmsh

    with empty_model() as occ:
        _outline(occ, 0.0)
        occ.synchronize()
        arcs = [tag for _, tag in gmsh.model.getEntities(1) if gmsh.model.getType(1, tag) == "Circle"]
        field = gmsh.model.mesh.field
        field.add("Distance", 1)
        field.setNumbers(1, "CurvesList", arcs)
        field.setNumber(1, "Sampling", 400)
        field.add("Threshold", 2)
        limits = {"InField": 1, "SizeMin": fine, "SizeMax": 2, "DistMin": 1.5 * fine, "DistMax": 25}
        for key, value in limits.items():
            field.setNumber(2, key, value)
        field.setAsBackgroundMesh(2)
        plain = {f"Mesh.MeshSize{key}": 0.0 for key in ("ExtendFromBoundary", "FromPoints", "FromCurvature")}
        with gmsh_options(gmsh, plain):
            gmsh.model.mesh.generate(2)
        tags, points, _ = gmsh.model.mesh.getNodes()
        corners = gmsh.model.mesh.getElements(2)[2][0].reshape(-1, 3)
    numbers = np.searchsorted(np.sort(tags), corners)
    points = points.reshape(-1, 3)[np.argsort(tags), :2]
    used, cells = np.unique(numbers, return_inverse=True)
    return skfem.MeshTri(np.ascontiguousarray(points[used].T), np.ascontiguousarray(cells.reshape(-1, 3).T))
