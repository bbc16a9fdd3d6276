"""Load cases of one link: closed forms, statics, and the same stresses by CalculiX where that is installed."""

import csv
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

import h5py
import meshio
import numpy as np
import pytest
from jaxtyping import Float
from numpy.testing import assert_allclose

from kedfem.analysis import analyse
from kedfem.errors import OutputError, SceneError
from kedfem.links.recovery import von_mises
from kedfem.load_cases import LoadCases, load_cases
from kedfem.mesh.elements.shape_functions import HEX8, HEX20, TET10, shape_gradients
from kedfem.results import read_results
from kedfem.scene import scene_from
from kedfem.tables import case_tables
from tests.scenes import arm, bar, constant_speed, cycloidal, four_bar

OMEGA, LENGTH, SIDE = 100.0, 0.5, 0.02
MASS = 7850.0 * LENGTH * SIDE**2
INSTANTS = (0.002, 0.00437)  # the time steps are 1e-4 s
E_STEEL, NU = 210e9, 0.3
NODES: dict[int, Any] = {8: HEX8, 10: TET10, 20: HEX20}
QUIET = {"plots": False, "animation": False, "picture": False}

solved_elsewhere = pytest.mark.skipif(
    shutil.which("ccx") is None, reason="needs CalculiX (ccx; on Debian and Ubuntu the package calculix-ccx)"
)


@pytest.fixture(scope="module")
def spun(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of a bar of 8-node hexahedra that spins about one end, with the deflection that this asks for."""
    analysis = {"end_time": 1e-3, "step": 1e-4, "initial": "quasi-static", "accuracy": "quick"}
    link = bar(LENGTH, SIDE, SIDE, element="hex8")
    raw = arm(link, constant_speed(OMEGA), analysis=analysis, output=QUIET)
    return analyse(scene_from(raw, tmp_path_factory.mktemp("spun"))).folder


@pytest.fixture(scope="module")
def cases(spun: Path, tmp_path_factory: pytest.TempPathFactory) -> dict[str, LoadCases]:
    """The spinning bar, and of a four-bar a reduced crank, a coupler with a load and a spring, a rocker of tetrahedra."""
    shape = {"kind": "bar", "width": 0.03, "thickness": 0.012}
    raw = four_bar(
        (0.12, 0.35, 0.3, 0.38), {"material": "steel", "shape": shape, "mesh": {"elements": [4, 2, 1]}},
        cycloidal(1.0, 6e-3), damping={"ratio": 0.02, "frequencies": [50, 2000]},
        loads={"w": {"kind": "force", "link": "coupler", "at": "N", "vector": [0, -300, 40],
                     "factor": {"time": [0, 5e-3], "value": [0, 1]}}},
        springs={"s": {"kind": "spring", "stiffness": 2e3, "damping": 5.0, "between": [
            {"link": "ground", "at": [0.1, 0.4]}, {"link": "coupler", "at": "N"}]}},
        bodies={"m": {"kind": "point_mass", "link": "rocker", "at": "C", "mass": 0.2}},
        analysis={"end_time": 5e-3, "step": 1e-4, "initial": "rest", "accuracy": "quick"}, output=QUIET,
    )  # fmt: skip
    raw["points"]["N"] = {"between": ["B", "C"], "fraction": 0.5}
    raw["links"]["crank"] |= {"reduction": 12}
    raw["links"]["rocker"]["element"] = "tet10"
    linkage = analyse(scene_from(raw, tmp_path_factory.mktemp("linkage"))).folder
    found = {link: load_cases(linkage, link, INSTANTS) for link in ("crank", "coupler", "rocker")}
    return found | {"arm": load_cases(spun, "arm", [5e-4])}


def rows(found: LoadCases) -> dict[str, np.ndarray]:
    """Force and moment of each kind at the first instant."""
    with (found.folder / f"{found.link}.csv").open(encoding="utf-8", newline="") as file:
        _, *lines = csv.reader(file)
    return {line[2]: np.array(line[6:], float) for line in lines if line[0] == lines[0][0]}


def test_a_spinning_bar_bears_its_centrifugal_force(spun: Path, tmp_path: Path) -> None:
    """Inertia m ω² L/2 outwards, as much inwards at the hinge; at each node the acceleration is −ω² x."""
    found = load_cases(spun, "arm", [5e-4], tmp_path)
    told, held = rows(found), MASS * OMEGA**2 * LENGTH / 2
    assert_allclose(told["inertia of the rigid motion"][:3], [held, 0, 0], atol=1e-7 * held)
    assert_allclose(told["joint A"][:3], [-held, 0, 0], atol=1e-4 * held)
    frame = meshio.read(tmp_path / "arm_0000.vtu")
    x = frame.points[:, :2]
    # stretched by ω² ρ L²/(3 E) of 1e-7: the elastic motion adds next to nothing
    assert_allclose(frame.point_data["acceleration [m/s^2]"][:, :2], -(OMEGA**2) * x, atol=1e-3 * OMEGA**2 * LENGTH)
    assert_allclose(frame.point_data["all forces [N]"].sum(axis=0), 0.0, atol=1e-4 * held)
    assert found.left[0] < 1e-4
    # σ = ρ ω² (L² − x²)/2 at the middle of a prismatic bar; elements of 2 % of its length
    middle = np.abs(x[:, 0] - LENGTH / 2) < 0.02 * LENGTH
    axial = frame.point_data["stress [Pa]"][middle, 0]
    assert_allclose(axial, 7850 * OMEGA**2 * (LENGTH**2 - x[middle, 0] ** 2) / 2, rtol=0.05)


@pytest.mark.parametrize("link", ["crank", "coupler", "rocker"])
def test_forces_are_in_balance(cases: dict[str, LoadCases], link: str) -> None:
    """d'Alembert: what acts on a link and its inertia add up to nothing; 1e-3 is the step's own error."""
    found = cases[link]
    assert [round(case.time, 9) for case in found.cases] == [0.002, 0.0044]
    assert max(found.left) < 1e-3
    told = " ".join(found.warnings)
    assert ("reduced in the run, and whole in the deck" in told) == (link == "crank")
    assert max(case.differs for case in found.cases) < (0.2 if link == "crank" else 0.01)
    several = [np.linalg.norm(x.sum(axis=0)) for x in found.cases[0].parts.values()]
    assert_allclose(found.cases[0].total.sum(axis=0), 0.0, atol=1e-3 * max(several))
    names = set(found.cases[0].parts)
    assert ("force elements" in names) == (link == "coupler")
    assert len([name for name in names if name.startswith("joint ")]) == 2
    assert case_tables(found)[1].row_count == len(INSTANTS)


@solved_elsewhere
@pytest.mark.parametrize("link", ["coupler", "rocker", "arm"])  # the crank's modes leave out some of its shapes
def test_calculix_finds_the_same_stresses(cases: dict[str, LoadCases], link: str) -> None:
    """All stress components at the solver's own integration points, all over the link, within 1 % of the largest.

    There nothing depends on how stresses are brought to nodes. Displacements are compared without rigid motions.
    """
    found = cases[link]
    mesh = meshio.read(found.folder / f"{link}_0000.vtu")
    steps = solved(found.folder, link)
    assert len(steps) == len(found.cases)
    for case, (u, stress, support) in zip(found.cases, steps, strict=True):
        g, held = rigid_free(mesh.points, case.displacement), rigid_free(mesh.points, u)
        own = at_integration_points(mesh, case.displacement, stress.shape[1])
        assert np.abs(g - held).max() < 5e-3 * np.abs(g).max()
        assert np.abs(stress - own).max() < 0.01 * von_mises(own.reshape(-1, 6)).max()
        bears = [support[node][c] - case.total[node, c] for node in support for c in range(3)]
        largest = max(np.linalg.norm(x.sum(axis=0)) for x in case.parts.values())
        assert np.abs(bears).max() < 1e-3 * largest


def solved(folder: Path, name: str) -> list[tuple[Any, Any, dict[int, Any]]]:
    """Displacements of all nodes, stresses at all points of all elements and forces at supports, by instant."""
    deck = (folder / f"{name}.inp").read_text(encoding="utf-8")
    asked = "*EL PRINT, ELSET=EALL\nS\n*NODE PRINT, NSET=NALL\nU\n*END STEP"
    (folder / "deck.inp").write_text(deck.replace("*END STEP", asked), encoding="utf-8")
    subprocess.run(["ccx", "-i", "deck"], cwd=folder, check=True, capture_output=True, timeout=120)
    tables: dict[str, list[list[list[float]]]] = {"forces": [], "stresses": [], "displacements": []}
    lines: list[list[float]] = []
    for line in (folder / "deck.dat").read_text(encoding="utf-8").splitlines():
        words = line.split()
        if words and words[0] in tables:
            tables[words[0]].append(lines := [])
        elif words:
            lines.append([float(word) for word in words])
    out = []
    for forces, stresses, moved in zip(*tables.values(), strict=True):
        s = np.array(stresses)
        points = int(s[:, 1].max())
        each = s[:, 2:].reshape(-1, points, 6)[..., [0, 1, 2, 3, 5, 4]]  # xx yy zz xy xz yz
        out.append((np.array(moved)[:, 1:], each, {int(x[0]) - 1: x[1:] for x in forces}))
    return out


def rigid_free(X: Float[np.ndarray, "n 3"], u: Float[np.ndarray, "n 3"]) -> Float[np.ndarray, "n 3"]:
    """A displacement less the rigid motion that fits it best."""
    x = X - X.mean(axis=0)
    modes = [np.tile(e, (len(x), 1)).ravel() for e in np.eye(3)] + [np.cross(e, x).ravel() for e in np.eye(3)]
    A = np.column_stack(modes)
    return np.asarray(u - (A @ np.linalg.lstsq(A, u.ravel(), rcond=None)[0]).reshape(u.shape))


def at_integration_points(mesh: Any, g: Float[np.ndarray, "n 3"], points: int) -> Float[np.ndarray, "e q 6"]:
    """Hooke's law at the Gauss points of the elements: 2³ or 3³, of tetrahedra 4."""
    cells = mesh.cells[0].data
    nodes = NODES[cells.shape[1]]
    if cells.shape[1] == 10:
        at = np.full((4, 3), (5 - 5**0.5) / 20) + np.vstack([np.zeros(3), np.eye(3)]) / 5**0.5
    else:
        line = [-(0.6**0.5), 0, 0.6**0.5] if points == 27 else [-(3**-0.5), 3**-0.5]
        at = np.array([[x, y, z] for z in line for y in line for x in line])
    dN = shape_gradients(nodes, at)
    J = np.einsum("qkj,eki->eqij", dN, mesh.points[cells])
    H = np.einsum("qkj,eki->eqij", dN, g[cells]) @ np.linalg.inv(J)
    strain = (H + H.swapaxes(-1, -2)) / 2
    mu = E_STEEL / (2 * (1 + NU))
    lam = 2 * mu * NU / (1 - 2 * NU)
    s = 2 * mu * strain + lam * np.trace(strain, axis1=-2, axis2=-1)[..., None, None] * np.eye(3)
    return np.stack([s[..., i, j] for i, j in ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))], axis=-1)


def test_results_of_another_mesh_are_refused(spun: Path, tmp_path: Path) -> None:
    """A stored scene whose files, or a kedfem whose links, are others than in the run has another strain energy."""
    folder = tmp_path / "run"
    shutil.copytree(spun, folder)
    with h5py.File(folder / "results.h5", "r+") as file:
        file["energy/strain"][...] *= 1.05
    with pytest.raises(OutputError, match=r"must be of the scene's present files and this kedfem, got a strain"):
        load_cases(folder, "arm", [5e-4])


def test_what_cannot_be_solved_elsewhere_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """27-node hexahedra: forces and fields, no deck. Planar links and large deflection: nothing."""
    analysis = {"end_time": 1e-3, "step": 5e-4, "accuracy": "quick"}
    link = bar(LENGTH, SIDE, SIDE, element="hex27", mesh={"elements": [2, 1, 1]})
    raw = arm(link, constant_speed(OMEGA), analysis=analysis, output=QUIET)
    folder = analyse(scene_from(raw, tmp_path)).folder
    found = load_cases(folder, "arm")
    assert not (found.folder / "arm.inp").exists()
    assert found.element == ""
    assert any("CalculiX has no 27-node hexahedra" in said for said in found.warnings)
    assert (found.folder / "arm.csv").exists()
    for keys, message in (
        ({"links": {"arm": {**bar(LENGTH, SIDE, SIDE), "model": "beam"}}}, "must be an elastic solid"),
        ({"analysis": {**analysis, "frames": "co-rotational"}}, "analysis.frames: must be rigid-body"),
        ({"analysis": {**analysis, "stiffening": True}}, "analysis.stiffening: must be off"),
    ):  # fmt: skip
        text = scene_from({**raw, **keys}, tmp_path).model_dump_json()
        results = replace(read_results(folder / "results.h5"), scene_json=text)
        monkeypatch.setattr("kedfem.load_cases.read_results", lambda path, results=results: results)
        with pytest.raises(SceneError, match=message):
            load_cases(folder, "arm")


def test_what_has_no_load_case_is_refused(spun: Path, tmp_path: Path) -> None:
    with pytest.raises(SceneError, match=r"--link: must be a link of the scene \('arm'\), got 'leg'"):
        load_cases(spun, "leg", [], tmp_path)
    for t in (-1e-3, 2e-3, float("nan")):
        with pytest.raises(OutputError, match=r"--at: must be from 0 to 0.001 s, the run's time, got"):
            load_cases(spun, "arm", [t], tmp_path)
