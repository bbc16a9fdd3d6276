"""Links that are given a little apart: the least motions that close them, what moves with them, what is refused."""

from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.optimize import minimize
from scipy.spatial.distance import pdist
from scipy.spatial.transform import Rotation

from kedfem.accuracy.histories import histories
from kedfem.accuracy.prepared import meshed
from kedfem.analysis import analyse
from kedfem.errors import MotionError, SceneError
from kedfem.links.beams.beam import directions
from kedfem.mesh import link_mesh
from kedfem.mesh.methods import file_axes
from kedfem.motion.assembly import assembled
from kedfem.motion.closed import RigidDisplacement, closed_scene
from kedfem.motion.linkage import linkage
from kedfem.scene import Cad, Polyline, RigidBody, Scene, inertia_tensor, scene_from
from tests.runs import quick

from ..linkages import RSSR_PIVOT, JointTable, Z, four_bar, joint, motion_at, rssr, slider_crank
from .test_cli import Command, run_kedfem

__all__ = ["run_kedfem"]  # a fixture

Array = np.ndarray
LENGTHS = (0.3, 0.9, 0.7, 0.9)
TOO_LONG = 1e-4
X = np.array([0.01, 0.0, 0.0])
MISFIT = np.array([1e-4, -2e-4, 1.5e-4])


def line(*points: Any, **keys: Any) -> dict[str, Any]:
    """A beam through points."""
    shape = {"kind": "polyline", "points": [list(p) for p in points], "width": 0.02, "thickness": 0.01}
    return {"model": "beam", "material": "steel", "shape": {**shape, **keys}}


def raw_scene(joints: JointTable, links: dict[str, Any], **sections: Any) -> dict[str, Any]:
    drive = {"joint": "A", "motion": {"kind": "constant_speed", "speed": 20.0}}
    return {
        "links": links,
        "joints": {name: joint(*fields) for name, fields in joints.items()},
        "drive": drive,
        "analysis": {"revolutions": 0.1, "steps_per_revolution": 360},
        "output": {"animation": False, "plots": False, "picture": False},
        **sections,
    }


def bars(joints: JointTable, ends: dict[str, tuple[Any, Any]] | None = None) -> dict[str, Any]:
    """Beams between the joints of a four-bar, or other ends."""
    P = {name: np.asarray(fields[3], float) for name, fields in joints.items()}
    drawn = {"crank": (P["A"], P["B"]), "coupler": (P["B"], P["C"]), "rocker": (P["C"], P["D"])}
    return {name: line(*pair) for name, pair in {**drawn, **(ends or {})}.items()}


def apart_four_bar(too_long: float = TOO_LONG, **sections: Any) -> dict[str, Any]:
    """A four-bar whose coupler is drawn too long for the rocker."""
    joints = four_bar(*LENGTHS, 1.0)
    B, C = (np.asarray(joints[name][3]) for name in "BC")
    end = C + too_long * (C - B) / np.linalg.norm(C - B)
    raw = raw_scene(joints, bars(joints, {"coupler": (B, end)}), **sections)
    raw["joints"]["C"]["at"] = {"rocker": list(C), "coupler": list(end)}
    return raw


def apart_rssr(**keys: Any) -> dict[str, Any]:
    """Crank, coupler, cross and rocker in space; the coupler's ball is drawn beside the crank's."""
    joints = rssr(1.2)
    P, Q = np.asarray(joints["B"][3]), np.asarray(joints["C1"][3])
    links = {
        "crank": line((0, 0, 0), P), "coupler": line(P + MISFIT, 0.5 * (P + Q) + [0, 0, 0.02], Q, **keys),
        "cross": line(Q, Q + X), "rocker": line(Q, RSSR_PIVOT),
    }  # fmt: skip
    raw = raw_scene(joints, links)
    raw["joints"]["B"]["at"] = {"crank": list(P), "coupler": list(P + MISFIT)}
    return raw


def points_of(scene: Scene, link: str) -> Array:
    shape = scene.links[link].shape
    assert isinstance(shape, Polyline)
    return np.array(shape.points)


def motions_of(before: Scene, after: Scene) -> dict[str, tuple[Array, Array]]:
    """How each link was moved, x → R x + p, found from the points on it and nothing else (Kabsch's algorithm)."""
    out = {}
    for name in before.links:
        X, Y = points_of(before, name), points_of(after, name)
        joints = [key for key, each in before.joints.items() if name in each.links]
        X = np.concatenate([X, [before.joints[key].on(name) for key in joints]])
        Y = np.concatenate([Y, [after.joints[key].at for key in joints]])
        axes = [key for key in joints if before.joints[key].kind == "revolute"]
        X = np.concatenate([X, [X[0] + np.asarray(before.joints[key].axis) for key in axes]])
        Y = np.concatenate([Y, [Y[0] + np.asarray(after.joints[key].axis) for key in axes]])
        x, y = X.mean(axis=0), Y.mean(axis=0)
        R = Rotation.align_vectors(Y - y, X - x)[0].as_matrix()
        out[name] = (R, y - R @ x)
        assert_allclose(X @ R.T + out[name][1], Y, rtol=0, atol=1e-11)  # they went as a rigid body
    return out


def size_of(scene: Scene) -> float:
    """The greatest distance of two joints, which no rotation of the scene changes."""
    return float(pdist([each.at for each in scene.joints.values()]).max())


def centres_of(scene: Scene) -> dict[str, Array]:
    return {
        name: np.mean([each.on(name) for each in scene.joints.values() if name in each.links], axis=0)
        for name in scene.links
    }


def least(scene: Scene, planar: bool) -> Array:
    """Displacements of links' centres in units of size and rotation vectors (n, 6) of the least norm, by SLSQP."""
    size, centres, names = size_of(scene), centres_of(scene), list(scene.links)
    free = [0, 1, 5] if planar else list(range(6))
    unit = 1e-4  # of the unknowns: SLSQP wants them of order one

    def placed(x: Array) -> Array:
        full = np.zeros((len(names), 6))
        full[:, free] = unit * x.reshape(len(names), -1)
        return full

    def gaps(x: Array) -> Array:
        full, out = placed(x), []
        for each in scene.joints.values():
            points, axes = [], []
            for link in each.links:
                k = names.index(link) if link != "ground" else None
                R = np.eye(3) if k is None else Rotation.from_rotvec(full[k, 3:]).as_matrix()
                c, d = (np.zeros(3), np.zeros(3)) if k is None else (centres[link], size * full[k, :3])
                points.append(c + d + R @ (np.asarray(each.on(link)) - c))
                axes.append(np.zeros(3) if each.axis is None else R @ np.asarray(each.axis))
            out += list(((points[0] - points[1]) / size)[: 2 if planar else 3])
            if each.kind == "revolute" and not planar:
                out += list(np.linalg.svd(np.array([each.axis]))[2][1:] @ (axes[0] - axes[1]))
        return np.array(out) / unit

    def slopes(x: Array) -> Array:
        step = 1e-2 * np.eye(len(x))
        return np.stack([(gaps(x + each) - gaps(x - each)) / 2e-2 for each in step], axis=1)

    found = minimize(
        lambda x: float(x @ x), np.zeros(len(names) * len(free)), jac=lambda x: 2 * x, method="SLSQP",
        constraints={"type": "eq", "fun": gaps, "jac": slopes}, options={"ftol": 1e-12, "maxiter": 40},
    )  # fmt: skip
    assert np.abs(gaps(found.x)).max() < 1e-7
    return placed(found.x)


# -- closing ------------------------------------------------------------------------------------------------


def test_scenes_whose_joints_meet_are_left_as_they_are() -> None:
    joints = four_bar(*LENGTHS, 1.0)
    raw = raw_scene(joints, bars(joints))
    scene = scene_from(raw)
    assert assembled(scene)[0] is scene
    raw["joints"]["B"]["at"] = {"crank": raw["joints"]["B"]["at"], "coupler": raw["joints"]["B"]["at"]}
    twice = scene_from(raw)
    closed, assembly = assembled(twice)
    assert closed is twice
    assert not assembly.misfits
    assert linkage(twice).size == linkage(scene).size


def test_a_scene_that_is_drawn_apart_is_assembled_before_it_moves() -> None:
    with pytest.raises(ValueError, match="must be assembled first"):
        linkage(scene_from(apart_four_bar()))


def test_a_four_bar_with_too_long_a_coupler_is_closed_in_its_plane() -> None:
    scene = scene_from(apart_four_bar())
    closed, assembly = assembled(scene)
    size = size_of(scene)
    ends = {"crank": "AB", "coupler": "BC", "rocker": "CD"}
    for name, pair in ends.items():
        before, after = points_of(scene, name), points_of(closed, name)
        assert_allclose(after, [closed.joints[key].at for key in pair], rtol=0, atol=1e-12 * size)
        assert_allclose(np.linalg.norm(after[1] - after[0]), np.linalg.norm(before[1] - before[0]), rtol=1e-14)
        assert (after[:, 2] == 0.0).all()
    assert all(not each.points and each.axis == Z for each in closed.joints.values())
    for key in "AD":
        assert closed.joints[key].at == scene.joints[key].at
    assert_allclose(assembly.misfits["C"], TOO_LONG, rtol=1e-9)
    assert assembly.worst[0] == "C"
    went = np.linalg.norm(np.subtract(closed.joints["B"].at, scene.joints["B"].at))
    assert_allclose(assembly.moved["crank"], [went, went / LENGTHS[0]], rtol=1e-6)


@pytest.mark.parametrize("too_long", [1e-4, 5e-3])
def test_links_of_a_four_bar_move_as_little_as_can_be(too_long: float) -> None:
    scene = scene_from(apart_four_bar(too_long))
    moves, best = motions_of(scene, assembled(scene)[0]), least(scene, planar=True)
    for k, (name, centre) in enumerate(centres_of(scene).items()):
        R, p = moves[name]
        d = (R @ centre + p - centre) / size_of(scene)
        assert_allclose([*d, *Rotation.from_matrix(R).as_rotvec()], best[k], rtol=0, atol=1e-6 * too_long)


def test_links_in_space_move_as_little_as_can_be() -> None:
    scene = scene_from(apart_rssr())
    closed, assembly = assembled(scene)
    moves, best = motions_of(scene, closed), least(scene, planar=False)
    for k, (name, centre) in enumerate(centres_of(scene).items()):
        R, p = moves[name]
        d = (R @ centre + p - centre) / size_of(scene)
        assert_allclose([*d, *Rotation.from_matrix(R).as_rotvec()], best[k], rtol=0, atol=1e-9)
    assert_allclose(assembly.misfits["B"], np.linalg.norm(MISFIT), rtol=1e-9)
    assert_allclose(points_of(closed, "crank")[1], points_of(closed, "coupler")[0], rtol=0, atol=1e-12)
    assert_allclose(points_of(closed, "rocker")[0], points_of(closed, "coupler")[-1], rtol=0, atol=1e-12)
    motion_at(closed, np.linspace(0.0, 0.02, 3))


def test_it_moves_as_the_four_bar_that_is_drawn_with_these_lengths() -> None:
    closed, _ = assembled(scene_from(apart_four_bar()))
    a, b, c, d = LENGTHS
    angle = float(np.arctan2(*closed.joints["B"].at[1::-1]))
    joints = four_bar(a, b + TOO_LONG, c, d, angle)
    drawn = scene_from(raw_scene(joints, bars(joints)))
    t = np.linspace(0.0, 0.3, 40)
    one, other = motion_at(closed, t), motion_at(drawn, t)
    for key in ("p", "R", "omega"):
        assert_allclose(getattr(one, key), getattr(other, key), rtol=0, atol=1e-9)
    first, second = (histories(meshed(scene)).channels["drive/torque"][1] for scene in (closed, drawn))
    assert np.abs(second).max() > 0.0
    assert_allclose(first, second, rtol=0, atol=1e-6 * np.abs(second).max())


def test_slides_may_be_drawn_apart_along_their_axis() -> None:
    joints = slider_crank(0.1, 0.3, 0.8)
    A, B, C = (np.asarray(joints[name][3]) for name in "ABC")
    links: dict[str, Any] = {"crank": line(A, B), "rod": line(B, C), "slider": {"model": "rigid", "mass": 1.0}}
    raw = raw_scene(joints, links)
    raw["joints"]["guide"]["at"] = {"slider": list(C), "ground": [0.1, 0.0]}
    closed, assembly = assembled(scene_from(raw))
    assert assembly.misfits["guide"] < 1e-15
    assert_allclose(closed.joints["guide"].at, C, rtol=0, atol=1e-15)
    raw["joints"]["guide"]["at"]["ground"] = [0.1, 1e-4]
    closed, assembly = assembled(scene_from(raw))
    assert_allclose(assembly.misfits["guide"], 1e-4, rtol=1e-9)
    assert_allclose(closed.joints["guide"].at[1:], [1e-4, 0.0], rtol=0, atol=1e-15)
    assert closed.joints["guide"].axis == (1.0, 0.0, 0.0)


def test_a_flywheel_sits_at_the_point_of_its_own_link() -> None:
    raw = apart_four_bar()
    end = raw["joints"]["C"]["at"]["coupler"]
    raw["bodies"] = {"disc": {"kind": "flywheel", "link": "coupler", "at": end, "inertia": 1e-3}}
    closed, _ = assembled(scene_from(raw))
    assert_allclose(closed.bodies["disc"].at, closed.joints["C"].at, rtol=0, atol=1e-12)
    raw["bodies"]["disc"]["link"] = "rocker"
    with pytest.raises(SceneError, match=r"bodies\.disc\.at: must be the point of a revolute joint of links\.rocker"):
        scene_from(raw)


def test_gears_stay_in_mesh_as_drawn() -> None:
    raw = apart_four_bar(gears={"G": {"joints": ["A", "E"], "ratio": -2.0}})
    raw["joints"]["E"] = joint("revolute", "ground", "wheel", (-0.2, 0, 0), Z)
    raw["links"]["wheel"] = line((-0.2, 0), (-0.2, 0.02))
    scene = scene_from(raw)
    moves = motions_of(scene, assembled(scene)[0])
    one, two = (Rotation.from_matrix(moves[name][0]).as_rotvec()[2] for name in ("crank", "wheel"))
    assert abs(one) > 1e-6
    assert_allclose(two, -2.0 * one, rtol=0, atol=1e-11)


# -- what goes with the links -------------------------------------------------------------------------------


SHIFT = RigidDisplacement(np.array([0.2, 0.1, 0.0]), np.array([1e-3, -2e-3, 0.0]), np.array([0.0, 0.0, 0.02]))
TILT = RigidDisplacement(np.array([0.2, 0.1, 0.0]), np.array([1e-3, -2e-3, 3e-3]), np.array([0.01, -0.02, 0.02]))


def moved(shift: RigidDisplacement, x: Any) -> Array:
    R = Rotation.from_rotvec(shift.theta).as_matrix()
    return (np.asarray(x) - shift.centre) @ R.T + shift.centre + shift.d


def arm(**sections: Any) -> dict[str, Any]:
    """A link on one hinge, of a shape to be given."""
    joints: JointTable = {"A": ("revolute", "ground", "arm", (0, 0, 0), Z)}
    return raw_scene(joints, {"arm": line((0, 0), (0.4, 0))}, **sections)


@pytest.mark.parametrize("shift", [SHIFT, TILT])
def test_everything_on_a_link_goes_with_it(shift: RigidDisplacement) -> None:
    inertia = (0.02, 0.03, 0.04, 0.001, -0.002, 0.003)
    force = {"kind": "force", "link": "arm", "at": [0.4, 0], "vector": [1.0, 2.0]}
    body = {"kind": "rigid_body", "link": "arm", "at": [0, 0], "mass": 1.0, "inertia": list(inertia), "centre": [0, 0.01]}
    ends = [{"link": "arm", "at": [0.4, 0]}, {"link": "ground", "at": [0.4, 1]}]
    line = {"kind": "line", "link": "arm", "vector": [3.0, 4.0], "end_vector": [5.0, 6.0], "between": [[0, 0], [0.4, 0]]}
    raw = arm(
        loads={
            "world": force,
            "link": {**force, "frame": "link"},
            "line": line,
            "turning line": {**line, "frame": "link"},
        },
        bodies={"wheel": body},
        springs={"spring": {"kind": "spring", "between": ends, "stiffness": 1.0}},
    )
    chord = [[0, 0], [0.4, 0]]
    raw["output"]["probes"] = {
        "tip": {"link": "arm", "at": [0.4, 0], "quantity": "displacement"},
        "sag": {"link": "arm", "at": [0.4, 0], "quantity": "deflection", "chord": chord},
    }
    pluck = {"link": "arm", "at": [0.4, 0], "force": [1.0, 2.0]}
    raw["analysis"] |= {"initial": "quasi-static", "initial_deflection": {"pluck": pluck}}
    scene = closed_scene(scene_from(raw), {"arm": shift})
    R, tip = Rotation.from_rotvec(shift.theta).as_matrix(), moved(shift, [0.4, 0, 0])
    for name in ("world", "link"):
        assert_allclose(scene.loads[name].at, tip, rtol=0, atol=1e-15)  # type: ignore[union-attr]
    for name, T in (("line", np.eye(3)), ("turning line", R)):
        load: Any = scene.loads[name]
        assert_allclose(load.between, [moved(shift, [0, 0, 0]), tip], rtol=0, atol=1e-15)
        assert_allclose([load.vector, load.end_vector], [T @ [3, 4, 0], T @ [5, 6, 0]], rtol=0, atol=1e-14)
    assert scene.loads["world"].vector == (1.0, 2.0, 0.0)  # type: ignore[union-attr]
    assert_allclose(scene.loads["link"].vector, R @ [1, 2, 0], rtol=0, atol=1e-14)  # type: ignore[union-attr]
    wheel = scene.bodies["wheel"]
    assert isinstance(wheel, RigidBody)
    assert_allclose(wheel.centre, moved(shift, [0, 0.01, 0]), rtol=0, atol=1e-15)
    assert_allclose(inertia_tensor(wheel.inertia), R @ inertia_tensor(inertia) @ R.T, rtol=0, atol=1e-16)
    here, there = scene.springs["spring"].between  # type: ignore[union-attr,misc]
    assert_allclose(here.at, tip, rtol=0, atol=1e-15)
    assert there.at == (0.4, 1.0, 0.0)
    assert_allclose(scene.output.probes["tip"].at, tip, rtol=0, atol=1e-15)
    assert_allclose(points_of(scene, "arm")[1], tip, rtol=0, atol=1e-15)
    assert_allclose(scene.output.probes["sag"].chord, [moved(shift, [0, 0, 0]), tip], rtol=0, atol=1e-15)
    assert_allclose(scene.analysis.initial_deflection["pluck"].at, tip, rtol=0, atol=1e-15)
    assert scene.analysis.initial_deflection["pluck"].force == (1.0, 2.0, 0.0)


def test_plates_go_with_their_outline_and_holes() -> None:
    outline = [[-0.02, -0.02], [0.4, -0.02], {"via": [0.42, 0.0], "to": [0.4, 0.02]}, [-0.02, 0.02]]
    plate = {"kind": "extrusion", "outline": outline, "holes": [{"at": [0, 0], "diameter": 0.01}], "thickness": 0.01}
    raw = arm()
    raw["links"]["arm"] = {"material": "steel", "shape": plate, "mesh": {"size": 0.02}}
    before = scene_from(raw)
    after = closed_scene(before, {"arm": SHIFT})
    one, other = (link_mesh("arm", scene.links["arm"], Path()) for scene in (before, after))
    lowest, highest = moved(SHIFT, one.points).min(axis=0), moved(SHIFT, one.points).max(axis=0)
    assert_allclose([other.points.min(axis=0), other.points.max(axis=0)], [lowest, highest], rtol=0, atol=1e-8)
    hole = after.links["arm"].shape.holes[0]  # type: ignore[union-attr]
    assert_allclose(hole.at, moved(SHIFT, [0, 0, 0]), rtol=0, atol=1e-15)


@pytest.mark.parametrize(
    "keys", [{}, {"z": "y"}, {"origin": [0.1, 0.2], "towards": [0.1, 0.2, 1.0]}, {"towards": [1.0, 0.5, 0.2], "z": "x"}]
)
@pytest.mark.parametrize("shift", [SHIFT, TILT])
def test_parts_from_cad_are_placed_where_their_link_goes(
    shift: RigidDisplacement, keys: dict[str, Any], tmp_path: Path
) -> None:
    (tmp_path / "arm.step").write_text("", "utf-8")
    raw = arm()
    raw["links"]["arm"] = {"material": "steel", "shape": {"kind": "cad", "file": "arm.step", **keys}}
    before = scene_from(raw, tmp_path)
    one, other = (scene.links["arm"].shape for scene in (before, closed_scene(before, {"arm": shift})))
    assert isinstance(one, Cad)
    assert isinstance(other, Cad)
    R = Rotation.from_rotvec(shift.theta).as_matrix()
    assert_allclose(file_axes(other), file_axes(one) @ R.T, rtol=0, atol=1e-14)
    assert_allclose(other.origin, moved(shift, one.origin), rtol=0, atol=1e-15)


def test_meshes_from_files_are_placed_where_their_link_goes(tmp_path: Path) -> None:
    cube = np.array([[x, y, z] for z in (0, 1) for x, y in ((0, 0), (1, 0), (1, 1), (0, 1))], float)
    meshio.Mesh(0.1 * cube, [("hexahedron", np.arange(8)[None])]).write(tmp_path / "cube.vtu")
    raw = arm()
    raw["links"]["arm"] = {"material": "steel", "shape": {"kind": "mesh", "file": "cube.vtu"}, "element": "hex8"}
    before = scene_from(raw, tmp_path)
    one, other = (
        link_mesh("arm", scene.links["arm"], tmp_path) for scene in (before, closed_scene(before, {"arm": TILT}))
    )
    assert_allclose(one.points, 0.1 * cube, rtol=0, atol=0)
    assert_allclose(other.points, moved(TILT, one.points), rtol=0, atol=1e-14)


@pytest.mark.parametrize("keys", [{}, {"up": [0.3, 0.5, 1.0]}])
def test_sections_of_lines_turn_with_them(keys: dict[str, Any]) -> None:
    before = scene_from(apart_rssr(**keys))
    after, _ = assembled(before)
    R = motions_of(before, after)["coupler"][0]
    frames = []
    for scene in (before, after):
        shape = scene.links["coupler"].shape
        assert isinstance(shape, Polyline)
        along = np.subtract(shape.points[1], shape.points[0])
        frames.append(directions(along, None if shape.up is None else np.array(shape.up)))
    assert np.abs(frames[1] - frames[0]).max() > 1e-6
    assert_allclose(frames[1], frames[0] @ R.T, rtol=0, atol=1e-10)


def test_bars_tilt_as_lines_do() -> None:
    def coupler(kind: str) -> Any:
        raw = apart_rssr()
        P, _, Q = raw["links"]["coupler"]["shape"]["points"]
        size = {"width": 0.02, "thickness": 0.01}
        raw["links"]["coupler"]["shape"] = {"kind": kind, "between" if kind == "bar" else "points": [P, Q], **size}
        return assembled(scene_from(raw))[0].links["coupler"].shape

    bar, line = coupler("bar"), coupler("polyline")
    assert bar.between == line.points
    assert bar.up == line.up
    assert bar.up is not None


# -- refused ------------------------------------------------------------------------------------------------


def test_large_misfits_are_refused_with_both_positions_all_at_once() -> None:
    raw = apart_four_bar(0.05)
    raw["joints"]["D"]["at"] = {"rocker": [0.9, 0.0], "ground": [0.9, 0.02]}
    scene = scene_from(raw)
    with pytest.raises(MotionError) as error:
        assembled(scene)
    first, second = str(error.value).splitlines()
    C, end = (raw["joints"]["C"]["at"][name] for name in ("rocker", "coupler"))
    assert first == (
        f"joints.C.at: must be one point for both links, up to 1 % of the linkage's size {size_of(scene):.6g} [m], got "
        f"({end[0]:.6g}, {end[1]:.6g}, 0) on 'coupler' and ({C[0]:.6g}, {C[1]:.6g}, 0) on 'rocker', 0.05 apart"
    )
    assert second.startswith("joints.D.at: must be one point")
    assert second.endswith("got (0.9, 0, 0) on 'rocker' and (0.9, 0.02, 0) on 'ground', 0.02 apart")


def test_what_no_motion_closes_is_refused() -> None:
    # a triangle of bars that is a structure, one of them too long to be fixed to the ground at both ends
    joints: JointTable = {
        "A": ("revolute", "ground", "one", (0, 0, 0), Z), "B": ("revolute", "ground", "one", (0.3, 0, 0), Z),
    }  # fmt: skip
    raw = raw_scene(joints, {"one": line((0, 0), (0.3, 0))})
    raw["joints"]["B"]["at"] = {"ground": [0.3, 0], "one": [0.301, 0]}
    with pytest.raises(MotionError, match=r"joints\.B\.at: must be a point to which small motions .* 0\.001 apart"):
        assembled(scene_from(raw))


def test_out_of_its_plane_a_planar_linkage_does_not_close() -> None:
    raw = apart_four_bar()
    raw["joints"]["C"]["at"]["coupler"].pop()
    raw["joints"]["C"]["at"]["coupler"].append(1e-4)
    raw["links"] = {name: {**link, "beam": "spatial"} for name, link in raw["links"].items()}
    with pytest.raises(MotionError, match=r"joints\.C\.at: must be a point to which small motions"):
        assembled(scene_from(raw))


def test_shapes_that_cannot_be_tilted_are_refused_where_they_would_have_to_be() -> None:
    raw = apart_rssr()
    P = raw["links"]["coupler"]["shape"]["points"][0]
    Q = raw["links"]["coupler"]["shape"]["points"][-1]
    bar = {"kind": "bar", "between": [P, Q], "width": 0.02, "thickness": 0.01}
    raw["links"]["coupler"] = {"material": "steel", "shape": bar}
    assert assembled(scene_from(raw))[0].links["coupler"].shape.up is not None
    raw = arm()
    eyes = {"kind": "plate_link", "between": [[0, 0], [0.3, 0]], "width": 0.02, "thickness": 0.01}
    raw["links"]["arm"] = {"material": "steel", "shape": {**eyes, "bore_diameter": 0.01}}
    with pytest.raises(MotionError, match=r"links\.arm\.shape: must be .* got a plate_link tilted by .* deg"):
        closed_scene(scene_from(raw), {"arm": TILT})


# -- told ---------------------------------------------------------------------------------------------------


def test_a_run_warns_that_links_were_moved(tmp_path: Path) -> None:
    done = analyse(scene_from(quick(apart_four_bar()), tmp_path))
    (warning,) = [each for each in done.warnings if each.startswith("joints.C:")]
    assert warning == (
        "joints.C: its links are given 0.0001 m apart; closed by moving links up to 0.000115 m (kedfem check shows which)"
    )


FILE = """
[points]
A = [0, 0]
B = [0, 0.1]
C = [0.3, 0.2]
E = [0.3001, 0.2]
D = [0.3, 0]
[links]
crank = { material = "steel", model = "beam", shape = { kind = "bar", between = ["A", "B"], SIZE } }
coupler = { material = "steel", model = "beam", shape = { kind = "bar", between = ["B", "C"], SIZE } }
rocker = { material = "steel", model = "beam", shape = { kind = "bar", between = ["E", "D"], SIZE } }
[joints]
A = { kind = "revolute", links = ["ground", "crank"], at = "A" }
B = { kind = "revolute", links = ["crank", "coupler"], at = "B" }
C = { kind = "revolute", links = ["coupler", "rocker"], at = { rocker = "E", coupler = "C" } }
D = { kind = "revolute", links = ["rocker", "ground"], at = "D" }
[drive]
joint = "A"
motion = { kind = "constant_speed", speed = "60 rpm" }
[analysis]
revolutions = 0.1
[output]
plots = false
"""


def test_check_and_kinematics_tell_how_links_were_closed(run_kedfem: Command, tmp_path: Path) -> None:
    file = tmp_path / "bar.toml"
    file.write_text(FILE.replace("SIZE", "width = 0.02, thickness = 0.01"), "utf-8")
    status, said, _ = run_kedfem("check", file)
    assert status == 0
    assert "Assembly" in said
    assert "given 100 µm apart" in said
    assert "link rocker" in said
    status, _, said = run_kedfem("kinematics", file)
    assert status == 0
    assert "its links are given 0.0001 m apart" in " ".join(said.split())
