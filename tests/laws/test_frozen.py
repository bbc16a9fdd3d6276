"""Natural frequencies of frozen linkages: closed forms, and eigenvalues of the monolithic system."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.linalg
import scipy.sparse as sp
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.accuracy.prepared import moving
from kedfem.dynamics.matrices.dense import SMALL
from kedfem.dynamics.modes.frozen import Frozen, Modes
from kedfem.dynamics.modes.lanczos import lanczos
from kedfem.dynamics.stepping.scheme import generalised_alpha
from kedfem.dynamics.system.build import system_of
from kedfem.dynamics.system.monolithic.monolithic import Monolithic
from kedfem.dynamics.system.monolithic.monolithic_tangent import rotated_stiffness
from kedfem.dynamics.system.record import Driven, Held, Spring, System
from kedfem.errors import SceneError
from kedfem.frequencies import Wanted, frequencies
from kedfem.motion.rigid import RigidMotion, rigid_motion
from kedfem.scene import inertia_tensor, path_parameter, scene_from
from tests.cells import Cell, scene_of
from tests.laws.test_limits import AXES
from tests.moving import turned
from tests.rooms.test_resolution import FIRST, arm

TIME = np.array([1e-3])
CELLS = [
    Cell(joint, frames, driven, links, law)
    for joint, frames, driven, links, law in (
        ("revolute", "rigid-body", True, "planar beams", "loads"),
        ("prismatic", "co-rotational", False, "planar beams", "loads"),
        ("slot", "rigid-body", True, "planar beams", "loads"),
        ("slot", "co-rotational", False, "planar beams", "loads"),
        ("slot", "rigid-body", True, "planar beams", "drive on the joint"),
        ("slot", "rigid-body", True, "planar beams", "spring on the joint"),
        ("slot", "co-rotational", False, "beams in space", "spring on the joint"),
        ("revolute", "co-rotational", False, "beams in space", "loads"),
        ("screw", "co-rotational", False, "beams in space", "loads"),
        ("universal", "co-rotational", True, "rigid", "loads"),
        ("spherical", "rigid-body", True, "reduced", "loads"),
        ("weld", "rigid-body", True, "on the ground", "loads"),
        ("revolute", "rigid-body", True, "plane and beam", "loads"),
        ("revolute", "rigid-body", True, "beams in space", "bushing against rotations"),
        ("revolute", "co-rotational", False, "beams in space", "spring between points"),
        ("cylindrical", "co-rotational", False, "rigid", "spring on the joint"),
        ("revolute", "rigid-body", True, "beams in space", "shaft"),
        ("revolute", "rigid-body", True, "beams in space", "gear"),
        ("revolute", "rigid-body", True, "beams in space", "point mass"),
    )
]
#: turns of the whole scene: none, x onto y, x onto z, oblique
TURNS = [np.zeros(3), np.array([0, 0, np.pi / 2]), np.array([0, -np.pi / 2, 0]), np.array([0.7, -0.4, 1.1])]


def frozen(raw: dict[str, Any], count: int = 4, driven: bool = True) -> tuple[System, RigidMotion, Modes, int]:
    """A scene's system, its motion at one time, its modes there, and how many motions the linkage has."""
    scene = scene_from(raw)
    linkage, path = moving(scene)
    loose = scene if driven else scene.model_copy(update={"drive": None, "drives": {}})
    system, mobility = system_of(loose, linkage, path), linkage.mobility + (not driven)
    motion = rigid_motion(linkage, path, TIME, path_parameter(scene, TIME))
    return system, motion, Frozen(system, count, mobility).at(motion), mobility


def monolithic_matrices(system: System, motion: RigidMotion) -> tuple[np.ndarray, np.ndarray]:
    """K and M on the null space of all constraints, assembled by the oracle."""
    oracle = Monolithic(system, generalised_alpha(1e-3, 1.0))
    every = zip(system.model.links, system.model.bodies, strict=True)
    K = [rotated_stiffness(sp.csr_array(link.K0), motion.R[0, n][: link.d, : link.d]).toarray() for link, n in every]
    C = oracle.coordinates(np.zeros(oracle.k), np.zeros(sum(len(x.terms) for x in system.constraints)), motion)[1]
    laws = [x.law for x in system.constraints]
    kappa = np.array([x.stiffness if isinstance(x, Spring) else 0.0 for x in laws])
    hard = C[[isinstance(x, Held | Driven) for x in laws]]
    A = scipy.linalg.block_diag(*K, C.T @ (kappa[:, None] * C))
    M = scipy.linalg.block_diag(oracle.M.toarray(), np.zeros((oracle.k, oracle.k)))
    G = np.block([[oracle.W.toarray(), -oracle.B.toarray()], [np.zeros((len(hard), oracle.N)), hard]])
    G /= np.maximum(np.linalg.norm(G, axis=1), 1e-300)[:, None]
    Z = scipy.linalg.null_space(G, rcond=1e-10)
    return Z.T @ A @ Z, Z.T @ M @ Z


def monolithic_eigenvalues(system: System, motion: RigidMotion, s: float, loose: System | None = None) -> np.ndarray:
    """ω² [1/s²] of these matrices.

    s : of the size of the first, so that rounding of zero ones, 1e-16/s of θ = 1/(ω² + s), is small beside others
    loose : the system from whose one motion without strain vibrations are separated
    """
    A, M = monolithic_matrices(system, motion)
    if loose is not None:
        still = scipy.linalg.eigh(M, monolithic_matrices(loose, motion)[0] + s * M)[1][:, -1:]
        beside = scipy.linalg.null_space(still.T @ M)
        A, M = beside.T @ A @ beside, beside.T @ M @ beside
    theta = scipy.linalg.eigh(M, A + s * M, eigvals_only=True)[::-1]
    return 1 / theta[theta > 1e-13 * theta[0]] - s


def difference(system: System, motion: RigidMotion, found: Modes, loose: System | None = None) -> float:
    first = found.still if loose is None else 0
    wanted = monolithic_eigenvalues(system, motion, found.omega[found.still] ** 2, loose)[first:][
        : len(found.frequencies)
    ]
    return float(np.abs(found.omega[found.still :] ** 2 / wanted - 1).max())


@pytest.mark.parametrize("cell", CELLS, ids=str)
def test_frequencies_are_eigenvalues_of_the_monolithic_system(cell: Cell) -> None:
    system, motion, found, mobility = frozen(scene_of(cell))
    springs = any(isinstance(x.law, Spring) for x in system.constraints)
    assert found.still <= mobility if springs else found.still == mobility
    # beams in space have hubs 1e6 times as stiff as they are heavy: of either route rounding leaves 1e-7
    assert difference(system, motion, found) < (1e-8 if cell.plane else 2e-6)


@pytest.mark.parametrize("width", [0.02, 0.005, 5e-4])
@pytest.mark.parametrize("ball", [True, False], ids=["between balls", "on a hinge about its axis"])
def test_a_rod_that_rotates_about_itself_has_no_vibration_there(ball: bool, width: float) -> None:
    """However thin: its inertia about its axis is nothing beside the stiffness across. Pinned: ω L² √(ρA/EI) = π²,
    clamped at one end 1.8751², but for shear and rotary inertia, which are less than 0.5 % at 1 : 19."""
    P, Q = np.array([0.1, 0.0, 0.0]), np.array([0.4, 0.1, 0.2])
    axis = (Q - P) / np.linalg.norm(Q - P)
    shape = {"kind": "bar", "between": [P.tolist(), Q.tolist()], "width": width, "thickness": width, "up": "y"}
    hinge = {"kind": "revolute", "links": ["ground", "rod"], "at": P.tolist(), "axis": axis.tolist()}
    balls = {
        name: {"kind": "spherical", "links": ["ground", "rod"], "at": x.tolist()} for name, x in (("P", P), ("Q", Q))
    }
    _, _, found, _ = frozen({
        "links": {"rod": {"model": "beam", "material": "steel", "shape": shape, "mesh": {"elements": 6}}},
        "joints": balls if ball else {"hinge": hinge},
        "analysis": {"end_time": 1.0, "step": 0.1, "accuracy": "quick"},
    })  # fmt: skip
    assert found.still == 1
    pinned = width * np.sqrt(210e9 / (12 * 7850.0)) / ((Q - P) @ (Q - P))  # steel, as docs/scene.md has it
    first = (np.pi**2 if ball else 1.8751040687**2) * pinned / (2 * np.pi)
    assert_allclose(found.frequencies[:2], first, rtol=5e-3)


@pytest.mark.parametrize("turn", TURNS, ids=["reference", "y", "z", "oblique"])
def test_frequencies_do_not_depend_on_the_axes_of_the_world(turn: np.ndarray) -> None:
    raw = scene_of(Cell("revolute", "rigid-body", True, "beams in space"))
    del raw["loads"]
    wanted = frozen(raw)[2].omega
    found = frozen(turned(raw, Rotation.from_rotvec(turn).as_matrix(), (0.3, -0.2, 0.5)))[2].omega
    assert_allclose(found, wanted, rtol=1e-6)  # ω²: as above


def test_an_arm_is_a_cantilever_with_its_drive_held_and_pinned_at_one_end_with_it_free() -> None:
    """(λ L)² of Euler-Bernoulli: clamped-free 1.8751, 4.6941; pinned-free 0, 3.9266."""
    held, free = frozen(arm("beam"))[2], frozen(arm("beam"), driven=False)[2]
    ratio = (np.array([4.69409113, 3.92660231]) / 1.8751040687) ** 2
    assert (held.still, free.still) == (0, 1)
    assert_allclose(held.frequencies[:2], [FIRST, ratio[0] * FIRST], rtol=2e-3)  # shear and rotary inertia
    assert_allclose(free.frequencies[0], ratio[1] * FIRST, rtol=3e-3)


@pytest.mark.parametrize("driven", [True, False])
def test_a_large_solid_with_its_sparse_factor_is_the_monolithic_one(driven: bool) -> None:
    system, motion, found, _ = frozen(arm("solid"), driven=driven)
    assert system.model.links[0].unknowns > SMALL
    assert found.still == (not driven)
    assert difference(system, motion, found) < 1e-7  # rounding of the dense route, λmax/ω² = 1e9 times 1e-16


@pytest.mark.parametrize("crank", ["rigid", "beam"])
def test_a_crank_that_a_free_drive_lets_go_swings_with_its_own_inertia(crank: str) -> None:
    """A rigid crank is carried by its drive, without unknowns; let go it has some."""
    raw = scene_of(Cell("revolute", "rigid-body", True, "planar beams"))
    if crank == "rigid":
        raw["links"]["crank"] |= {"model": "rigid", "mesh": {"elements": [1, 1, 1]}}
    system, motion, found, _ = frozen(raw, driven=False)
    assert found.still == 1
    assert difference(system, motion, found) < 1e-8


def test_modes_are_orthonormal_in_the_mass() -> None:
    system, _, found, _ = frozen(arm("beam"))
    (link,), (x,) = system.model.links, found.shapes
    product = sum(x[:, :, c] @ (m @ x[:, :, c].T) for c, m in enumerate(link.mass))
    assert_allclose(product, np.eye(len(x)), atol=1e-8)


def test_equal_frequencies_are_all_found() -> None:
    values = np.repeat([1.0, 4.0, 9.0, 400.0], [3, 5, 2, 40])
    found, vectors = lanczos(lambda r: r / values[:, None], lambda x: x, 50, 10, 6)
    assert_allclose(1 / found, values[:10], rtol=1e-12)
    assert_allclose(vectors.T @ vectors, np.eye(10), atol=1e-12)


@pytest.mark.parametrize("axis", AXES.values(), ids=list(AXES))
def test_a_mechanism_has_no_more_frequencies_than_motions(axis: np.ndarray, tmp_path: Path) -> None:
    """Two rigid bodies that turn about an axis and slide along it on springs: √(k/J) and √(k/m), whatever is asked for.

    Rounding that was left of the search beyond these was taken for more of it: along x it was told to be unstable.
    """
    m, c, inertia = 1.5, np.array([0.3, 0.1, 0.2]), [0.02, 0.03, 0.025, 0.003, 0.001, -0.002]
    J = float(axis @ (inertia_tensor(inertia) + m * (c @ c * np.eye(3) - np.outer(c, c))) @ axis)
    raw: dict[str, Any] = {"links": {}, "joints": {}, "springs": {}, "analysis": {"end_time": 1.0, "step": 0.1}}
    for name, centre, about, slid in (("one", c, 20.0, 4e4), ("two", -c, 30.0, 5e4)):
        raw["links"][name] = {"model": "rigid", "mass": m, "centre": centre.tolist(), "inertia": inertia}
        raw["joints"][name] = {"kind": "cylindrical", "links": [name, "ground"], "at": [0, 0, 0], "axis": axis.tolist()}
        raw["springs"][f"about {name}"] = {"kind": "torsion", "joint": name, "stiffness": about}
        raw["springs"][f"along {name}"] = {"kind": "spring", "joint": name, "stiffness": slid}
    found = frequencies(scene_from(raw), Wanted(modes=8, positions=1), tmp_path / "out")
    exact = np.sort(np.sqrt([20 / J, 30 / J, 4e4 / m, 5e4 / m])) / (2 * np.pi)
    assert found.still == 0
    assert_allclose(found.values[0], [*exact, *4 * [np.nan]], rtol=1e-7)


def test_more_modes_than_the_iterations_find_are_refused() -> None:
    """Those beyond were told all the same: of 250 of a beam of 1815 unknowns from the 121st on, up to 9 % off."""
    values = np.arange(1.0, 1501.0) ** 2

    def modes(count: int) -> np.ndarray:
        return 1 / lanczos(lambda r: r / values[:, None], lambda x: x, len(values), count, 6)[0]

    with pytest.raises(SceneError, match="--modes: must be so few that iterations with 480 vectors find them") as told:
        modes(400)
    most = int(str(told.value).split("ask for ")[1].split()[0])
    assert most > 60
    assert_allclose(modes(most), values[:most], rtol=1e-12)
