"""Beams in space as links of a scene: which they are, joints of any axis, against planar beams and solids, how drawn."""

from copy import deepcopy
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.analysis import analyse
from kedfem.dynamics.history import Snapshot
from kedfem.dynamics.model import Model
from kedfem.errors import SceneError
from kedfem.links.beams.beam_axis import smooth_axis, straight_axis
from kedfem.links.beams.section import box, i_profile, rectangle, tube
from kedfem.links.beams.spatial_beam import spatial_beam_link
from kedfem.links.build import bare_link, link_axes
from kedfem.links.point_rows import point_rows, stress_rows
from kedfem.links.recovery import nodal_stress, stress_recovery
from kedfem.scene import Material, scene_from, spatial_beams
from tests.linkages import joint, moved_scene, rssr
from tests.runs import quick
from tests.verification.linear import deflection, free_map

from .test_bad_models import arm, body, fault
from .test_dynamics import four_bar, run, worst_difference

STEEL = Material(density=7850, youngs_modulus=210e9, poisson_ratio=0.3)
TURNED = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix()


def rssr_of_beams(R: np.ndarray | None = None, **analysis: Any) -> dict[str, Any]:
    """A crank that turns about z drives a rocker about x over a ball and a universal joint; everything turned by R."""
    R = np.eye(3) if R is None else R
    joints = {name: joint(*fields) for name, fields in moved_scene(rssr(1.0), R, np.zeros(3)).items()}
    at = {name: np.array(fields["at"]) for name, fields in joints.items()}
    pin = 0.02 * np.array(joints["C1"]["axis"])
    bend = (at["C1"] + at["D"]) / 2 + R @ [0.03, 0.02, 0.0]
    sections: dict[str, dict[str, Any]] = {
        "crank": {"width": 0.02, "thickness": 0.012},
        "coupler": {"section": {"kind": "round", "diameter": 0.01}},
        "cross": {"section": {"kind": "rectangle", "width": 0.01, "thickness": 0.015}},
        "rocker": {"section": {"kind": "tube", "diameter": 0.02, "wall": 0.002}},
    }
    lines = {
        "crank": [at["A"], at["B"]],
        "coupler": [at["B"], at["C1"]],
        "cross": [at["C1"] - pin, at["C1"], at["C1"] + pin],
        "rocker": [at["C1"], bend, at["D"]],
    }
    up = (R @ [0.1, 0.2, 1.0]).tolist()
    return {
        "links": {
            name: {
                "model": "beam",
                "material": "aluminium",
                "mesh": {"elements": 2},
                "shape": {"kind": "polyline", "points": [p.tolist() for p in line], "up": up, **sections[name]},
            }
            for name, line in lines.items()
        },
        "joints": joints,
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 60}},
        "bodies": {"wheel": {"kind": "flywheel", "link": "rocker", "at": "joints.D", "inertia": 1e-3}},
        "gravity": (R @ [1.0, -9.0, 3.0]).tolist(),
        "damping": {"alpha": 0.5, "beta": 1e-5},
        "analysis": {"revolutions": 1, "steps_per_revolution": 180, **analysis},
    }


def test_a_turned_spatial_linkage_of_beams_moves_the_same() -> None:
    """Geometric invariance of the whole analysis, [KED, eqs. (5)(6)(12)]."""
    _, _, here = run(rssr_of_beams())
    _, _, there = run(rssr_of_beams(TURNED))
    peak = max(np.abs(s.u).max() for x in here for s in x.states)
    for x, y in zip(here, there, strict=True):
        for s, r in zip(x.states, y.states, strict=True):
            # the rigid motion is solved to 1e-12, and stiff sections multiply its rounding
            assert_allclose(r.u @ TURNED, s.u, rtol=0, atol=1e-7 * peak)


@pytest.mark.parametrize("rho_inf", [1.0, 0.8])
def test_condensed_is_monolithic_on_a_spatial_linkage_of_beams(rho_inf: float) -> None:
    model, _, fast = run(rssr_of_beams(rho_inf=rho_inf))
    assert {link.kind for link in model.links} == {"spatial_beam"}
    _, _, slow = run(rssr_of_beams(rho_inf=rho_inf, solver="monolithic"))
    assert worst_difference(fast, slow) < 1e-8
    forces, got = ([s.port_forces for s in x[-1].states] for x in (slow, fast))
    size = max(np.abs(f).max() for f in forces)
    for f, g in zip(forces, got, strict=True):
        assert_allclose(g, f, rtol=0, atol=1e-6 * size)


# -- planar beams, solids -----------------------------------------------------------------------------------


def in_space(raw: dict[str, Any]) -> dict[str, Any]:
    raw = deepcopy(raw)
    for link in raw["links"].values():
        link["beam"] = "spatial"
    return raw


def nodal(model: Model, snapshot: Snapshot) -> list[np.ndarray]:
    """Displacements of the nodes in the plane, per link."""
    return [s.u[link.one != 0, :2] for s, link in zip(snapshot.states, model.links, strict=True)]


def apart(raw: dict[str, Any], other: dict[str, Any]) -> float:
    """Largest difference of the nodes' displacements in the plane, of the peak."""
    (one, _, a), (two, _, b) = run(raw), run(other)
    pairs = [(p, q) for x, y in zip(a, b, strict=True) for p, q in zip(nodal(one, x), nodal(two, y), strict=True)]
    return max(float(np.abs(p - q).max()) for p, q in pairs) / max(float(np.abs(p).max()) for p, _ in pairs)


def test_a_planar_linkage_of_spatial_beams_moves_as_that_of_planar_beams() -> None:
    """The same theory; the residual is a turned section's own inertia, δ being of fixed direction (below)."""
    raw = four_bar("beam", steps_per_revolution=360)
    raw["bodies"] = {}
    assert apart(raw, in_space(raw)) < 1e-4  # 8.5e-5
    raw["links"]["rocker"]["shape"] = {
        "kind": "polyline", "points": ["C", [0.8, 0.3], "D"], "width": 0.03, "thickness": 0.01,
    }  # fmt: skip
    assert apart(raw, in_space(raw)) < 3e-4


def test_planar_and_spatial_beams_differ_by_a_flywheels_centrifugal_couple_only() -> None:
    """δ of a planar beam is a turn ψ; of a spatial one displacements, on which a wheel that turns at ω acts with J ω² δ.

    So does every attached body on a solid. It fades as the square of the speed.
    """
    differences = []
    for speed in ("60 rpm", "120 rpm"):
        raw = four_bar("beam", steps_per_revolution=360, initial="quasi-static")
        raw["drive"]["motion"]["speed"] = speed
        differences.append(apart(raw, in_space(raw)))
    assert differences[0] < 1e-4
    assert 3 < differences[1] / differences[0] < 5


def test_nothing_in_a_plane_moves_out_of_it() -> None:
    model, _, snapshots = run(in_space(four_bar("beam")))
    peak = max(np.abs(s.u).max() for x in snapshots for s in x.states)
    for x in snapshots:
        for s, link in zip(x.states, model.links, strict=True):
            assert np.abs(s.u[link.one != 0, 2]).max() < 1e-8 * peak


def middles(raw: dict[str, Any]) -> tuple[set[str], np.ndarray]:
    """Displacement of every link's middle over time (t, l, 2), and the kinds of links."""
    model, _, snapshots = run(raw)
    rows = [point_rows(link, "middle", link.nodes.mean(axis=0)).value for link in model.links]
    moved = [[row @ s.u for row, s in zip(rows, x.states, strict=True)] for x in snapshots]
    return {link.kind for link in model.links}, np.array([[u[:2] for u in x] for x in moved])


@pytest.mark.parametrize("beams", [("crank", "rocker"), ("coupler",)])
@pytest.mark.parametrize("kind", ["planar", "spatial"])
def test_beams_and_solids_in_one_linkage(beams: tuple[str, ...], kind: str) -> None:
    """Bars of solids and of beams against beams alone, slow: 0.1 % of the peak, of the solids' end faces."""
    analysis = {"steps_per_revolution": 60, "initial": "quasi-static"}
    alone, mixed = four_bar("beam", **analysis), four_bar("bar", **analysis)
    for name in beams:
        mixed["links"][name] = {**alone["links"][name], "beam": kind}
    for raw in (alone, mixed):
        raw["drive"]["motion"]["speed"] = "60 rpm"
        raw["damping"] = {"alpha": 5, "beta": 1e-4}
        for link in raw["links"].values():
            link["mesh"] = {"elements": 4 if link.get("model") else [12, 2, 2]}
    _, wanted = middles(alone)
    kinds, got = middles(mixed)
    assert kinds == {"solid", "beam" if kind == "planar" else "spatial_beam"}
    assert np.abs(got - wanted).max() < 2e-3 * np.abs(wanted).max()


def simple(**changes: Any) -> dict[str, Any]:
    """One beam on a hinge, with changes at the top level or in its link or joint."""
    raw = arm("beam")
    for key, change in changes.items():
        table = {"link": raw["links"]["arm"], "joint": raw["joints"]["A"]}.get(key, raw)
        table.update(change)
    return raw


@pytest.mark.parametrize(
    "changes",
    [
        {"link": {"beam": "spatial"}},
        {"joint": {"axis": [0, 1, 0]}},
        {"top": {"gravity": [0, 0, -9.81]}},
        {"top": {"loads": {"p": {"kind": "force", "link": "arm", "at": [0.5, 0], "vector": [0, 0, 1]}}}},
        {"top": {"output": {"probes": {"p": {"link": "arm", "at": [0.5, 0, 0.01], "quantity": "stress"}}}}},
        {"link": {"shape": {"kind": "bar", "between": [[0, 0], [0.5, 0, 0.1]], "width": 1, "thickness": 1}}},
    ],
)  # fmt: skip
def test_a_beam_moves_in_space_if_anything_takes_it_there(changes: dict[str, Any]) -> None:
    assert not spatial_beams(scene_from(simple()))
    assert spatial_beams(scene_from(simple(**changes))) == {"arm"}


def test_a_beam_welded_to_a_spatial_beam_or_a_solid_is_spatial() -> None:
    raw = simple()
    raw["links"]["tip"] = deepcopy(raw["links"]["arm"])
    raw["links"]["tip"]["shape"]["between"] = [[0.5, 0], [0.5, 0.3]]
    raw["joints"]["W"] = {"kind": "weld", "links": ["arm", "tip"], "at": [0.5, 0]}
    assert spatial_beams(scene_from(raw)) == set()
    raw["links"]["tip"]["beam"] = "spatial"
    assert spatial_beams(scene_from(raw)) == {"arm", "tip"}
    raw["links"]["tip"] |= {"model": "solid", "mesh": {"elements": [4, 1, 1]}}
    del raw["links"]["tip"]["beam"]
    assert spatial_beams(scene_from(raw)) == {"arm"}
    model, _, _ = run(raw)  # and the weld finds its coupling surfaces: the solid's end face, the beam's end
    assert [link.kind for link in model.links] == ["spatial_beam", "solid"]


# -- faults that the model reveals --------------------------------------------------------------------------


BENT = [[0.0, 0.0, 0.0], [0.3, 0.1, 0.05], [0.1, 0.4, 0.0]]
SHAPES: dict[str, dict[str, Any]] = {
    "bent": {"kind": "polyline", "points": BENT, "width": 0.02, "thickness": 0.01},
    "closed": {"kind": "polyline", "points": [*BENT, BENT[0]], "width": 0.02, "thickness": 0.01},
    "smooth": {"kind": "polyline", "points": BENT, "smooth": True, "width": 0.02, "thickness": 0.01},
    "file": {"kind": "mesh", "file": "a.vtu", "towards": BENT[1]},
}


@pytest.mark.parametrize("kind", SHAPES)
def test_link_axes_turn_with_the_shape(kind: str, tmp_path: Path) -> None:
    """z as near to `up` as x allows, which is along the chord, of a closed line along its first segment."""
    (tmp_path / "a.vtu").write_text("")
    up = np.array([0.2, -0.1, 1.0])
    x = np.subtract(BENT[1 if kind in {"closed", "file"} else 2], BENT[0])
    x /= np.linalg.norm(x)
    z = up - (up @ x) * x
    z /= np.linalg.norm(z)
    axes = np.stack([x, np.cross(z, x), z], axis=1)
    for R in (np.eye(3), *Rotation.random(4, rng=3).as_matrix()):
        shape = SHAPES[kind] | {("z" if kind == "file" else "up"): (R @ up).tolist()}
        shape |= {key: (np.array(shape[key]) @ R.T).tolist() for key in ("points", "towards") if key in shape}
        beam = {} if kind == "file" else {"model": "beam", "beam": "spatial"}
        raw = {"links": {"a": {"material": "steel", "shape": shape, **beam}}, "analysis": {"end_time": 1, "step": 0.1}}
        scene = scene_from(raw, tmp_path)
        assert_allclose(link_axes(scene.links["a"]), R @ axes, atol=1e-12)
        if beam:
            assert_allclose(bare_link(scene, "a", frozenset("a")).axes, R @ axes, atol=1e-12)


def test_a_hinge_along_a_beam_needs_an_end_or_a_corner() -> None:
    raw = simple(joint={"axis": "x", "at": [0.25, 0]})
    assert fault(raw) == (
        "joints.A: must sit at an end or a corner of beam 'arm', or need its section only, got a joint that needs the "
        "direction of its axis too: give the beam a point there"
    )
    raw["joints"]["A"]["axis"] = "y"
    model, _, _ = run(raw)
    assert len(model.joints[0].keep) == 9  # driven: u, and the changes along y and across


def test_a_joint_off_the_axis_of_a_beam() -> None:
    assert fault(simple(joint={"axis": "y", "at": [0, 0, 0.01]})) == (
        "joints.A: must sit on a node of link 'arm' at (0, 0, 0.01), got none there (nearest node (0, 0, 0), 10 mm "
        "away); the parts do not meet: they are given 10 mm apart; move the joint onto the beam, or give "
        "the beam a point there"
    )


@pytest.mark.parametrize("at", [[0.5, 0], [0.25, 0]])
def test_a_rigid_body_beside_the_axis_of_a_spatial_beam(at: list[float]) -> None:
    raw = simple(link={"beam": "spatial"})
    raw["bodies"] = {"tool": body() | {"at": at, "centre": [0.5, 0.1]}}
    model, _, _ = run(raw)
    link = model.links[0]
    assert_allclose(link.one @ link.mX, [7850 * 0.02**2 * 0.5**2 / 2 + 0.5, 0.1, 0], rtol=1e-12)


@pytest.mark.parametrize("quantity", ["stress", "displacement"])
def test_a_probe_outside_a_spatial_beam(quantity: str) -> None:
    raw = simple(link={"beam": "spatial"})
    raw["output"] = {"probes": {"tip": {"link": "arm", "at": [0.5, 0.0, 0.05], "quantity": quantity}}}
    outside = "output.probes.tip.at: must lie in link 'arm', got (0.5, 0, 0.05), 0.04 m outside it"
    assert fault(raw) == f"{outside}: take a point of its material, its axis is nearest at (0.5, 0, 0)"


# -- axes, stresses, drawing --------------------------------------------------------------------------------


def test_directions_follow_a_smooth_curve_without_turning_about_it() -> None:
    """On a helix parallel directions turn against the curve's normal by its torsion; orthonormal everywhere."""
    angle = np.linspace(0, 2 * np.pi, 41)
    points = np.stack([np.cos(angle), np.sin(angle), 0.3 * angle], axis=1)
    axis = smooth_axis(points, 4, 3, None)
    frames = axis.frame[:, 1:]
    assert_allclose(frames @ frames.transpose(0, 2, 1), np.broadcast_to(np.eye(3), frames.shape), atol=1e-12)
    normal = -axis.frame[:, 0] * [1, 1, 0]
    binormal = np.cross(frames[:, 0], normal)
    against = np.unwrap(
        np.arctan2(np.einsum("sk,sk->s", frames[:, 1], binormal), np.einsum("sk,sk->s", frames[:, 1], normal))
    )
    assert against[0] - against[-1] == pytest.approx(2 * np.pi * 0.3 / np.hypot(1, 0.3), rel=1e-3)


def test_a_smooth_axis_passes_through_its_points_and_meets_a_circle() -> None:
    angle = np.linspace(0, np.pi / 2, 9)
    points = np.stack([np.sin(angle), 1 - np.cos(angle), 0 * angle], axis=1)
    axis = smooth_axis(points, 2, 3, None)
    assert_allclose(axis.frame[::4, 0], points, atol=1e-14)
    assert_allclose(np.linalg.norm(axis.frame[:, 0] - [0, 1, 0], axis=1), 1, atol=5e-5)  # h⁴ of the spline
    assert_allclose(axis.frame[:, 3], np.broadcast_to([0, 0, 1], (33, 3)), atol=1e-12)


def test_corners_keep_the_directions_of_each_segment() -> None:
    points = np.array([[0.0, 0, 0], [1, 0, 0], [1, 1, 0], [1, 1, 1]])
    axis = straight_axis(points, 2, 3, None)
    assert len(axis.node) == 15
    assert axis.node.max() == 12
    link = spatial_beam_link("l", axis, rectangle(0.1, 0.05), STEEL)
    assert link.triples is not None
    assert_allclose((link.triples @ link.X).reshape(-1, 3, 3), axis.frame[:, [0, 2, 3]], atol=1e-14)
    assert_allclose(axis.frame[[0, 5, 10], 2], [[0, 1, 0], [-1, 0, 0], [0, -1, 0]], atol=1e-14)


def clamped(section: Any, force: np.ndarray, moment: float = 0.0) -> tuple[Any, np.ndarray]:
    """A cantilever of 1 m along x under a force and a torque at its end: the link and its state."""
    link = spatial_beam_link("c", straight_axis(np.array([[0.0, 0, 0], [1, 0, 0]]), 2, 3, None), section, STEEL)
    f = np.zeros((link.n, 3))
    f[-4] = force
    f[-2], f[-1] = [0, 0, moment / 2], [0, -moment / 2, 0]  # θ = ½ (p·z − q·y)
    return link, deflection(link, free_map(link, np.arange(12)), f)


HOLLOW = {  # a point in the material, and one where there is none
    "tube": (tube(0.04, 0.03, 0.6), (0.017, 0.006), (0.005, -0.008)),
    "box": (box(0.04, 0.03, 0.004, (0.4, 0.4)), (0.017, 0.002), (0.012, -0.008)),
    "i": (i_profile(0.04, 0.03, 0.003, 0.004, (0.4, 0.4)), (0.012, 0.001), (0.012, -0.008)),
}


@pytest.mark.parametrize("kind", HOLLOW)
def test_stress_is_where_there_is_material(kind: str) -> None:
    """On the axis too, where a tube has that of tension; a little beside the material that of the outer fibre."""
    section, within, hollow = HOLLOW[kind]
    link, g = clamped(section, np.array([1e4, 300.0, 200.0]), 50.0)
    for y, z in ((0.0, 0.0), within):
        stress_rows(link, "p", np.array([0.3, y, z]))
    with pytest.raises(SceneError, match=r"p: must lie in link 'c', .* its material is nearest at \(0\.3, "):
        stress_rows(link, "p", np.array([0.3, *hollow]))
    outer, beside = (point_rows(link, "p", np.array([0.3, y, 0.0])).stress @ g.ravel() for y in (0.02, 0.0209))
    assert_allclose(beside, outer, rtol=1e-12)


@pytest.mark.parametrize("section", [rectangle(0.04, 0.02), tube(0.04, 0.0, 0.9), tube(0.04, 0.03, 0.6)])
def test_stresses_of_bending_torsion_and_tension(section: Any) -> None:
    """σ = N/A + M_y y/I_y + M_z z/I_z exactly; τ of torsion with the stress function's share."""
    N, Fy, Fz, T = 1e4, 300.0, 200.0, 50.0
    link, g = clamped(section, np.array([N, Fy, Fz]), T)
    x, y, z = 0.3, 0.017, 0.006
    at = point_rows(link, "p", np.array([x, y, z]))
    assert_allclose(at.X, [x, y, z], atol=1e-12)
    s = at.stress @ g.ravel()
    normal = N / section.area - (1 - x) * (Fy * y / section.second_moment + Fz * z / section.second_moment_z)
    assert s[0] == pytest.approx(normal, rel=1e-6)
    if section.kind != "rectangle":
        assert_allclose(s[[3, 5]], T / section.torsion_constant * np.array([-z, y]), rtol=1e-6)
    edge = point_rows(link, "p", np.array([x, 0, section.thickness / 2])).stress @ g.ravel()
    most = {"rectangle": 0.930 * 0.02 / (0.229 * 0.04 * 0.02**3), "round": 16 / (np.pi * 0.04**3)}
    if section.kind in most:
        assert abs(edge[3]) == pytest.approx(T * most[section.kind], rel=3e-3)
    turn = (
        point_rows(link, "p", np.array([1.0, 0, 0.01])).value @ g - point_rows(link, "p", np.array([1.0, 0, 0])).value @ g
    )
    assert turn[1] == pytest.approx(-0.01 * T / (link.lame[1] * section.torsion_constant), rel=1e-5)


@pytest.mark.parametrize("section", [rectangle(0.04, 0.02), tube(0.04, 0.0, 0.9), tube(0.04, 0.03, 0.6)])
def test_a_beam_is_drawn_as_the_body_of_its_section(section: Any) -> None:
    """Hexahedra of the right volume (a 16-gon for a circle), with the stresses of its probes."""
    link, g = clamped(section, np.array([0.0, 300, 200]), 50)
    recovery = stress_recovery(link)
    X, stress = recovery.at_points(link.X), nodal_stress(recovery, g)
    corners = X[recovery.cells]
    edges = np.stack([corners[:, k] - corners[:, 0] for k in (1, 3, 4)], axis=1)
    assert (np.linalg.det(edges) > 0).all()
    middle = X.mean(axis=0)
    assert_allclose(middle, [0.5, 0, 0], atol=1e-12)
    widest = np.ptp(X, axis=0)
    assert_allclose(widest, [1, section.height, section.thickness], rtol=1e-12)
    for k in range(0, len(X), 7):
        at = point_rows(link, "p", X[k])
        assert_allclose(at.value @ g, recovery.at_points(g)[k], atol=1e-9 * np.abs(g).max())
        assert_allclose(at.stress @ g.ravel(), stress[k], atol=1e-6 * np.abs(stress).max())


def test_a_spatial_linkage_is_run_recorded_and_drawn(tmp_path: Path) -> None:
    raw = rssr_of_beams(steps_per_revolution=60)
    raw["output"] = {
        "folder": str(tmp_path),
        "animation": {"frames_per_revolution": 4},
        "plots": False,
        "probes": {
            "side": {"link": "rocker", "at": "joints.D", "quantity": "stress"},
            "tip": {"link": "coupler", "at": "joints.B", "quantity": "displacement", "frame": "world"},
        },
    }
    done = analyse(scene_from(quick(raw)))
    assert (tmp_path / "worst.png").is_file()
    assert done.peak is not None
    _, side = done.results.channels["probes/side/stress"]
    assert done.peak.stress > side[:, -1].max() > 0
    frame = meshio.read(done.worst)
    own = {block.type: np.unique(block.data) for block in frame.cells}
    assert own.keys() == {"hexahedron", "hexahedron27"}  # bodies are balls of the latter, without fields
    assert np.isfinite(frame.point_data["von Mises [Pa]"][own["hexahedron"]]).all()
