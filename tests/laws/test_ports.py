"""Averaged and rigid couplings: what holds of both in every direction, and what a stiff one adds."""

from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.joints.attachments import interface_matrix
from kedfem.dynamics.joints.ports import port_values, port_vectors
from kedfem.dynamics.model import Model
from kedfem.links.plane import plane_link
from kedfem.links.record import Link, mass_times
from kedfem.links.reduced import reduced, rigid, rigid_body_functions, rigid_modes
from kedfem.links.solid import solid_link
from kedfem.links.surfaces.coupling_surfaces import CouplingSurface, face_surface, joint_surface
from kedfem.links.surfaces.rigid_coupling import STIFF, surface_gram, with_rigid_coupling
from kedfem.mesh import QuadMesh, SolidMesh, link_mesh
from kedfem.motion.linkage import linkage
from kedfem.scene import scene_from

from ..rooms.test_dynamics import PLATE, four_bar, run
from .strategies import LAW, MATERIAL, Motion, motions, ring, rings, rotated, seeds

Z = np.array([0.0, 0.0, 1.0])
REST = Motion(np.eye(3), np.zeros(3), np.zeros(3), np.zeros(3))


def solid(mesh: SolidMesh) -> Link:
    return solid_link("any", mesh, MATERIAL, np.eye(3))


def bore(link: Link, motion: Motion = REST) -> CouplingSurface:
    return joint_surface(link, "joints.A", motion.p, motion.R @ Z)


def dense(K: Any) -> np.ndarray:
    return np.asarray(K.toarray() if sp.issparse(K) else K)


def out_of_round(link: Link, surface: CouplingSurface, u: np.ndarray) -> float:
    """Root mean square over a coupling surface of what no rigid motion of it is, by least squares in Gauss points'
    weights."""
    nodes, G = surface_gram(link, surface.facets)
    B = rigid_modes(link).reshape(link.n, link.d, -1)[nodes].reshape(link.d * len(nodes), -1)
    L = np.linalg.cholesky(np.kron(G.toarray(), np.eye(link.d))).T
    left = np.linalg.lstsq(L @ B, L @ u[nodes].ravel(), rcond=None)
    return float(np.linalg.norm(L @ (u[nodes].ravel() - B @ left[0])) / np.sqrt(G.sum()))


# -- of one link --------------------------------------------------------------------------------------------


@LAW
@given(rings(), motions)
def test_a_rigid_coupling_leaves_rigid_motions_free_and_k0_symmetric(mesh: SolidMesh, motion: Motion) -> None:
    """K0 · (rigid modes) = 0, [KED, eqs. (13)(14)]."""
    link = solid(rotated(mesh, motion))
    stiff = with_rigid_coupling(link, bore(link, motion))
    K = dense(stiff.K0)
    assert_allclose(K, K.T, rtol=0, atol=1e-15 * np.abs(K).max())
    forces = stiff.K0 @ rigid_modes(stiff)
    assert_allclose(forces, 0, atol=1e-13 * np.abs(K).max() * np.abs(rigid_modes(stiff)).max() * len(K))
    assert len(np.flatnonzero(np.linalg.eigvalsh(K) < 1e-9 * np.abs(link.K0).max())) == 6


@LAW
@given(rings(), motions)
def test_a_rigid_coupling_is_the_same_in_every_direction(mesh: SolidMesh, motion: Motion) -> None:
    """K0 of the turned link is T K0 Tᵀ, [KED, eq. (14)]."""
    here, there = solid(mesh), solid(rotated(mesh, motion))
    K = dense(with_rigid_coupling(here, bore(here)).K0).reshape(here.n, 3, here.n, 3)
    turned = np.einsum("ki,aibj,lj->akbl", motion.R, K, motion.R).reshape(3 * here.n, -1)
    got = dense(with_rigid_coupling(there, bore(there, motion)).K0)
    assert_allclose(got, turned, rtol=0, atol=1e-10 * np.abs(K).max())


@LAW
@given(rings(), seeds)
def test_a_stiff_bore_keeps_its_shape_and_makes_the_link_stiffer(mesh: SolidMesh, seed: int) -> None:
    """Compliance fᵀ K0⁺ f falls with every load; of the bore's deformation under it 1/STIFF or so is left."""
    link = solid(mesh)
    surface = bore(link)
    stiff = with_rigid_coupling(link, surface)
    force = np.random.default_rng(seed).uniform(-1, 1, 3 * link.n)
    on_bore = surface_gram(link, surface.facets)[0]
    force.reshape(-1, 3)[on_bore] = 0.0
    B = rigid_modes(link)
    held = np.linalg.qr(B)[0]
    rows = np.setdiff1d(np.arange(link.n), on_bore)[:, None] * 3 + np.arange(3)
    R = B[rows.ravel()]
    force[rows.ravel()] -= R @ np.linalg.solve(R.T @ R, B.T @ force)  # in equilibrium
    answers = []
    for each in (link, stiff):
        K = dense(each.K0)
        size = np.abs(dense(link.K0)).max()
        answers.append(np.linalg.solve(K + size * held @ held.T, force))
    assert force @ answers[1] < force @ answers[0]
    assert np.linalg.eigvalsh(dense(stiff.K0) - dense(link.K0)).min() > -1e-12 * np.abs(stiff.K0).max()
    averaged, kept = (out_of_round(link, surface, u.reshape(-1, 3)) for u in answers)
    assert kept < 3 / STIFF * averaged


@pytest.mark.parametrize("nodes", [8, 10, 20, 27])
def test_a_stiff_reduced_link_is_the_stiff_link_reduced(nodes: int) -> None:
    link = solid(ring(nodes))
    random = np.random.default_rng(0).standard_normal((link.n, 9))
    Q = np.column_stack([rigid_body_functions(link), random])
    one = with_rigid_coupling(reduced(link, Q), bore(reduced(link, Q)))
    other = reduced(with_rigid_coupling(link, bore(link)), Q)
    for K in (one, other):  # functions may differ by a turn among them, the eigenvalues may not
        assert K.full is not None
    assert_allclose(np.linalg.eigvalsh(one.K0), np.linalg.eigvalsh(other.K0), rtol=0, atol=1e-9 * np.abs(other.K0).max())


def test_a_rigid_coupling_of_a_plane_link_leaves_three_motions_free() -> None:
    angle = np.arange(16) * np.pi / 8
    points = np.concatenate([r * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle]) for r in (0.1, 0.2, 0.3)])
    quads = [
        [(2 * k + i) % 16 + 16 * j for j, i in ((0, 0), (2, 0), (2, 2), (0, 2), (1, 0), (2, 1), (1, 2), (0, 1), (1, 1))]
        for k in range(8)
    ]  # fmt: skip
    link = plane_link("any", QuadMesh(points, np.array(quads), 0.02), MATERIAL, np.eye(3))
    stiff = with_rigid_coupling(link, bore(link))
    K = dense(stiff.K0)
    assert (np.linalg.eigvalsh(K) < 1e-9 * np.abs(link.K0).max()).sum() == 3
    u = np.zeros((link.n, 2))
    u[:, 0] = link.X[:, 0]  # the bore made an ellipse
    averaged, kept = (u.ravel() @ each.K0 @ u.ravel() for each in (link, stiff))
    # κ times its mean square, ½ r² cos² and what a rigid motion takes of it: none
    area = 2 * np.pi * 0.1 * 0.02
    assert kept - averaged == pytest.approx(STIFF * link.E / 0.1 * area * 0.1**2 / 2, rel=0.02)


def test_a_stiff_flat_face_stays_flat() -> None:
    link = solid(ring())
    top = face_surface(link, "joints.A", np.array([0.175, 0.0, 0.1]))
    stiff = with_rigid_coupling(link, top)
    u = np.zeros((link.n, 3))
    u[:, 2] = link.X[:, 0] * link.X[:, 1]  # a saddle
    assert u.ravel() @ stiff.K0 @ u.ravel() > 10 * (u.ravel() @ link.K0 @ u.ravel())
    assert_allclose(stiff.K0 @ rigid_modes(stiff), 0, atol=1e-12 * np.abs(stiff.K0).max() * stiff.n)


def test_rigid_links_stay_as_they_are() -> None:
    link = rigid(solid(ring()))
    assert with_rigid_coupling(link, bore(link)).K0.shape == link.K0.shape


# -- of a mechanism -----------------------------------------------------------------------------------------


def ported(raw: dict[str, Any], port: Any) -> dict[str, Any]:
    for joint in raw["joints"].values():
        joint["coupling"] = port
    return raw


def drawn(R: np.ndarray, folder: Path, port: str, **analysis: Any) -> dict[str, Any]:
    """[KED]'s four-bar of plates as mesh files, the whole scene turned by R."""
    raw = ported(four_bar("plate", **analysis), port)
    upright = scene_from(raw)
    for name, link in upright.links.items():
        mesh = link_mesh(name, link, Path())
        cells = [(mesh.cell_type, mesh.cells)]
        meshio.write(folder / f"{name}.vtu", meshio.Mesh(mesh.points @ R.T, cells))
        raw["links"][name] = {"material": "alloy", "shape": {"kind": "mesh", "file": f"{name}.vtu"}}
    for name, joint in upright.joints.items():
        raw["joints"][name] |= {"at": (R @ joint.at).tolist(), "axis": (R @ Z).tolist()}
    raw["bodies"]["flywheel"]["at"] = raw["joints"]["D"]["at"]
    del raw["points"]
    return raw


@pytest.mark.parametrize("port", ["distributing", "rigid"])
def test_a_scene_in_another_direction_bends_alike(port: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    R = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()
    analysis = {"revolutions": 5 / 240, "steps_per_revolution": 240}
    found = []
    for turn, name in ((np.eye(3), "upright"), (R, "turned")):
        (tmp_path / name).mkdir()
        monkeypatch.chdir(tmp_path / name)
        model, _, snapshots = run(drawn(turn, tmp_path / name, port, **analysis))
        states = [s for x in snapshots for s in x.states]
        joints = model.joints * len(snapshots)
        forces = [port_vectors(j, s.port_forces) @ s.R.T @ turn for j, s in zip(joints, states, strict=True)]
        found.append(([s.u @ turn for s in states], [force.sum(axis=0) for force in forces]))
    for upright, turned in zip(*found, strict=True):
        peak = max(np.abs(x).max() for x in upright)
        for a, b in zip(turned, upright, strict=True):
            assert_allclose(a, b, rtol=0, atol=1e-6 * peak)  # rounding, docs/ports.md: plates are soft sideways


@pytest.mark.parametrize("port", ["distributing", "rigid"])
@pytest.mark.parametrize("kind", ["plate", "plane"])
def test_joints_are_closed_and_hand_on_force_and_moment_in_full(kind: str, port: str) -> None:
    """Newton's and Euler's laws of each link about its undeformed shape: Σ λ, Σ X × λ balance P − M R0'' − M δ''."""
    raw = ported(four_bar(kind, revolutions=1 / 12, steps_per_revolution=240), port)
    raw["damping"], raw["gravity"] = {"beta": 1e-5}, [0, -9.81, 0]  # inner damping carries no resultant
    model, _, snapshots = run(raw)
    for snapshot in snapshots[1::4]:
        held = np.concatenate([port_values(j, s.u) for j, s in zip(model.joints, snapshot.states, strict=True)])
        B = interface_matrix(model.joints).toarray()
        gap = held - B @ np.linalg.lstsq(B, held, rcond=None)[0]
        assert np.abs(gap).max() < 1e-12 * min(link.size for link in model.links)
        for link, joint, s in zip(model.links, model.joints, snapshot.states, strict=True):
            nodal = (s.F - mass_times(link.mass, s.a)) @ s.R  # link frame
            ports = port_vectors(joint, s.port_forces)
            size = np.abs(s.F).sum() + np.abs(ports).sum()
            assert_allclose(ports.sum(axis=0), -nodal.sum(axis=0), rtol=0, atol=1e-8 * size)
            moments = moment(link.X, nodal) + moment(joint.points, ports)
            assert_allclose(moments, 0, atol=1e-8 * size * link.size)


def moment(x: np.ndarray, force: np.ndarray) -> np.ndarray:
    full = np.zeros((len(force), 3))
    full[:, : force.shape[1]] = force
    about = np.cross(x, full).sum(axis=0)
    return about if force.shape[1] == 3 else about[2:]


@pytest.mark.parametrize("kind", ["plate", "plane"])
def test_condensed_is_monolithic_with_stiff_ports(kind: str) -> None:
    fast = run(ported(four_bar(kind, revolutions=1 / 24, steps_per_revolution=240), "rigid"))
    slow = run(ported(four_bar(kind, revolutions=1 / 24, steps_per_revolution=240, solver="monolithic"), "rigid"))
    peak = max(np.abs(s.u).max() for snapshot in slow[2] for s in snapshot.states)
    for a, b in zip(fast[2], slow[2], strict=True):
        for s, r in zip(a.states, b.states, strict=True):
            assert_allclose(s.u, r.u, rtol=0, atol=1e-6 * peak)


def energies(model: Model) -> list[float]:
    """K0 of each link on a wave through it."""
    waves = [np.sin(40 * link.X[:, : link.d] @ np.ones((link.d, link.d))).ravel() for link in model.links]
    return [float(u @ link.K0 @ u) for u, link in zip(waves, model.links, strict=True)]


def model_of(raw: dict[str, Any]) -> Model:
    scene = scene_from(raw)
    return elastic_model(scene, linkage(scene))


def test_a_port_is_stiff_where_it_is_said_to_be() -> None:
    """By joint or by link; the bore of a joint on the ground too; beams and rigid links take it and stay the same."""
    raw = four_bar("plane")
    plain = np.array(energies(model_of(raw)))
    raw["joints"]["B"]["coupling"] = {"coupler": "rigid"}
    assert ((np.array(energies(model_of(raw))) > 1.01 * plain) == [False, True, False]).all()
    raw["joints"]["B"]["coupling"] = "rigid"
    assert ((np.array(energies(model_of(raw))) > 1.01 * plain) == [True, True, False]).all()
    raw["joints"]["B"]["coupling"], raw["joints"]["D"]["coupling"] = "distributing", "rigid"
    assert ((np.array(energies(model_of(raw))) > 1.01 * plain) == [False, False, True]).all()
    beams = [energies_of_beams(port) for port in ("distributing", "rigid")]
    assert beams[0] == beams[1]


def energies_of_beams(port: str) -> list[float]:
    return [float(link.K0.sum()) for link in model_of(ported(four_bar("beam"), port)).links]


@pytest.mark.parametrize("reduce", [False, True])
def test_segments_and_reduced_links_take_stiff_ports(reduce: bool) -> None:
    """A link in segments has the added stiffness of the same link in one piece, bores being cut by none."""
    raw = ported(four_bar("plane", frames="co-rotational", rho_inf=0.9), "distributing")
    models = []
    for port in ("distributing", "rigid"):
        for link in raw["links"].values():
            link["segments"] = 3
        models.append(model_of(ported(raw, port)))
    changed = [np.abs(dense(a.K0) - dense(b.K0)).max() > 0 for a, b in zip(*(m.links for m in models), strict=True)]
    assert changed == [True, False, True] * 3
    if reduce:
        part = models[1].links[0]
        Q = np.column_stack([rigid_body_functions(part), np.sin(60 * part.X[:, :1])])
        assert reduced(part, Q).K0.shape == (2 * 4, 2 * 4)


def test_frames_that_follow_converge_with_stiff_ports_too() -> None:
    """Stiff coupling surfaces stretch the rounding of positions; it may take more iterations, joints stay closed."""
    runs = []
    for port in ("distributing", "rigid"):
        raw = four_bar("plane", revolutions=1 / 60, steps_per_revolution=600, frames="co-rotational", rho_inf=0.95)
        for link in raw["links"].values():
            link["segments"] = 2
        runs.append(run(ported(raw, port)))
    (_, averaged, soft), (model, stiff, hard) = runs
    assert averaged.iterations < stiff.iterations < 2 * averaged.iterations
    peaks = [max(np.abs(s.u).max() for s in snapshots[-1].states) for snapshots in (soft, hard)]
    assert 0 < 1 - peaks[1] / peaks[0] < 0.01
    held = np.concatenate([port_values(j, s.u) for j, s in zip(model.joints, hard[-1].states, strict=True)])
    B = interface_matrix(model.joints).toarray()
    gap = held - B @ np.linalg.lstsq(B, held, rcond=None)[0]
    assert np.abs(gap).max() < 1e-12 * min(link.size for link in model.links)


def test_two_joints_on_one_bore_make_it_stiff_once() -> None:
    raw = ported(four_bar("plane"), "distributing")
    raw["joints"]["B"]["coupling"] = "rigid"
    once = energies(model_of(raw))
    raw["links"]["fork"] = raw["links"]["coupler"] | {"shape": {**PLATE, "between": ["B", [0.5, 0.9]]}}
    raw["joints"]["fork"] = {"kind": "weld", "links": ["coupler", "fork"], "at": "B", "coupling": {"coupler": "rigid"}}
    assert energies(model_of(raw))[:2] == pytest.approx(once[:2], rel=1e-12)


def test_both_ports_are_the_same_from_afar() -> None:
    """Saint-Venant: the difference of a lug's end under a load far away falls as the lug gets longer."""
    apart = []
    for length in (0.16, 0.32, 0.64):
        raw = ported(four_bar("plane"), "distributing")
        shape = {"kind": "plate_link", "between": [[0, 0], [length, 0]], "width": 0.03, "thickness": 0.01,
                 "bore_diameter": 0.015}  # fmt: skip
        raw["links"] = {"arm": {"material": "alloy", "model": "plane", "shape": shape, "mesh": {"elements_across": 2}}}
        raw["joints"] = {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]}}
        raw["bodies"] = {}
        (link,) = model_of(raw).links
        (stiff,) = model_of(ported(raw, "rigid")).links
        near, far = (joint_surface(link, "joints", np.array([x, 0.0, 0.0]), Z) for x in (0.0, length))
        tips = [tip_deflection(each, near, far) for each in (link, stiff)]
        assert tips[1] < tips[0]
        apart.append(1 - tips[1] / tips[0])
    # in the limit the lug is shorter by a part of its bore, which makes a difference of 3 ΔL / L
    assert apart[1] < apart[0] / 1.5
    assert apart[2] < apart[1] / 1.7


def tip_deflection(link: Link, near: CouplingSurface, far: CouplingSurface) -> float:
    """Of the far bore under a force across, the near one's mean displacement and rotation held."""
    force = np.zeros((link.n, link.d))
    force[:, 1] = far.fit[0]
    turn = near.fit[1:2]
    held = np.concatenate([near.fit[:1, :, None] * [[[1, 0]]], near.fit[:1, :, None] * [[[0, 1]]],
                           turn[..., None] * [[[0, 1]]] - near.fit[2:3, :, None] * [[[1, 0]]]])  # fmt: skip
    C = held.reshape(3, -1)
    K = dense(link.K0)
    A = np.block([[K / link.E, C.T], [C, np.zeros((3, 3))]])
    u = np.linalg.solve(A, np.concatenate([force.ravel() / link.E, np.zeros(3)]))
    return float(force.ravel() @ u[: K.shape[0]])
