"""Every kind of joint with every kind of partner, along x, y, z and askew: one answer, or refused, with the reason."""

from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.errors import KedfemError
from kedfem.scene import scene_from, spatial_beams
from tests.cells import as_a_run
from tests.laws.test_joint_rows import ROUNDING, assert_the_same, moved
from tests.moving import channels, ran
from tests.partners import IN_PLANE, IN_SPACE, PLANAR, SPATIAL, Z, axis_of, chain
from tests.systems import against_oracle, begun, stiffened

Cell = tuple[str, tuple[str, str], bool]
#: a coupling surface at the very end of a bar; a slider with two slides
FOUND: list[Cell] = [("prismatic", ("solid", "ground"), True), ("prismatic", ("bare", "planar beam"), False)]
DRIVEN = ("revolute", "prismatic")
#: A rigid link is a stiff one, by the square of a ratio of 1000, and rounding grows with that: points moved by 1e-15 of
#: themselves change deflections beside a driven hinge in space by 1e-7, 6e-5, 1e-2 at ratios of 100, 1000, 10,000. So
#: does another processor. What turned chains with stiff links differ by, the most of several processors: with a drive
#: 1.5e-4 in space and 6e-6 in a plane, without one 8e-5 in space (a ball; 6e-5 a slide, 2e-5 a cylindrical joint)
DRIVEN_RIGID = {"space": 1e-3, "plane": 1e-4}
RIGID_IN_SPACE = 4e-4
#: where both links are rigid the others bend little, and what the strain of the stiff link differs by from direction to
#: direction, 2.5e-8 rad at a ratio of 100 and 2.5e-10 at 1000, is up to 4e-4 of that
BOTH_RIGID = 1e-3


def refusal(kind: str, partners: tuple[str, str], driven: bool, plane: bool) -> str | None:
    """What the message says where the two do not go together; None if they do."""
    raw = chain(kind, partners, driven, plane)
    for name, link in raw["links"].items():
        on = {key: joint for key, joint in raw["joints"].items() if name in joint["links"]}
        guided = any(joint["kind"] == "prismatic" for joint in on.values())
        drive_joint = on.get(raw["drive"]["joint"], {"kind": "", "links": ()})
        moved = drive_joint["kind"] == "revolute" and "ground" in drive_joint["links"]
        if link.keys() == {"model", "mass"} and not guided and not moved:
            return r"links\.[\w ]+\.shape: is required for a rigid link that is neither a slider"
    return None


def cells(plane: bool) -> Iterator[Cell]:
    kinds, partners = (IN_PLANE, PLANAR) if plane else (IN_SPACE, SPATIAL)
    for kind in kinds:
        for driven in (False, True) if kind in DRIVEN else (False,):
            for one in partners:
                yield from ((kind, (one, other), driven) for other in ("ground", *partners))


def cheap(plane: bool) -> list[Cell]:
    """Each kind of joint with every second kind of partner, on the ground and beside a beam by turns."""
    partners = PLANAR if plane else SPATIAL
    kept = []
    for kind, (one, other), driven in cells(plane):
        turn = (sum(map(ord, kind)) + partners.index(one) + driven) % 4
        if (turn == 0 and other == "ground") or (turn == 2 and other == partners[0]):
            kept.append((kind, (one, other), driven))
    return kept


def named(cell: Cell) -> str:
    kind, partners, driven = cell
    return f"{'driven ' * driven}{kind}, {' and '.join(partners)}"


def along(axis: np.ndarray, place: int) -> np.ndarray:
    """A rotation that brings an axis along x, y or z exactly: x, y and z change places."""
    x = axis / np.linalg.norm(axis)
    y = np.cross(Z if abs(x[2]) < 0.9 else np.eye(3)[0], x)
    y /= np.linalg.norm(y)
    return np.roll(np.array([x, y, np.cross(x, y)]), place, axis=0)


def in_plane(axis: np.ndarray, angle: float) -> np.ndarray:
    """A rotation about z that brings an axis in the plane at an angle to x; one along z is left there."""
    start = np.arctan2(axis[1], axis[0]) if np.hypot(*axis[:2]) > 0 else 0.0
    return np.asarray(Rotation.from_euler("z", angle - start).as_matrix())


TURNS: dict[bool, dict[str, Callable[[np.ndarray], np.ndarray]]] = {
    False: {
        "x": partial(along, place=0), "y": partial(along, place=1), "z": partial(along, place=2),
        "askew": lambda axis: moved(5)[0] @ along(axis, 0),
    },
    True: {
        "x": partial(in_plane, angle=0.0), "y": partial(in_plane, angle=np.pi / 2),
        "askew": partial(in_plane, angle=0.7),
    },
}  # fmt: skip


def limit(cell: Cell, plane: bool) -> float:
    """What turned answers may differ by, of the largest."""
    kind, partners, driven = cell
    stiff = {"rigid", "bare"} & set(partners)
    if plane and {"rigid", "bare", "ground"}.issuperset(partners) and (driven or kind == "weld"):
        return BOTH_RIGID
    if stiff and driven:
        return DRIVEN_RIGID["plane" if plane else "space"]
    if stiff and not plane:
        return RIGID_IN_SPACE
    return ROUNDING["rigid" if stiff else "beams"]


def check(cell: Cell, plane: bool, turns: tuple[str, ...]) -> None:
    kind, partners, driven = cell
    wanted = refusal(*cell, plane)
    made = {name: partial(chain, kind, partners, driven, plane, TURNS[plane][name]) for name in turns}
    if wanted is not None:
        for scene in made.values():
            with pytest.raises(KedfemError, match=wanted):
                ran(scene())
        return
    axis = axis_of(kind, partners, driven, plane)
    R = {name: TURNS[plane][name](axis) for name in turns}
    digits = limit(cell, plane)
    runs = {name: ran(scene()) for name, scene in made.items()}
    for name in turns[1:]:
        turn = R[name] @ R[turns[0]].T
        assert_the_same(kind, runs[turns[0]], runs[name], turn, digits)


@pytest.mark.parametrize("cell", cheap(plane=False), ids=named)
def test_joints_in_space_are_the_same_along_z_and_askew(cell: Cell) -> None:
    check(cell, plane=False, turns=("z", "askew"))


@pytest.mark.parametrize("cell", [*cheap(plane=True), *FOUND], ids=named)
def test_joints_in_the_plane_are_the_same_along_y_and_askew(cell: Cell) -> None:
    check(cell, plane=True, turns=("y", "askew"))


@pytest.mark.long
@pytest.mark.parametrize("cell", list(cells(plane=False)), ids=named)
def test_every_cell_in_space_is_the_same_along_x_y_z_and_askew(cell: Cell) -> None:
    check(cell, plane=False, turns=("x", "y", "z", "askew"))


@pytest.mark.long
@pytest.mark.parametrize("cell", list(cells(plane=True)), ids=named)
def test_every_cell_in_the_plane_is_the_same_along_x_y_and_askew(cell: Cell) -> None:
    check(cell, plane=True, turns=("x", "y", "askew"))


def test_a_planar_beam_and_a_rigid_bar_are_welded_either_way_round() -> None:
    """The beam is one in space then; said to be planar it is refused, and not beside a bar that the drive carries."""
    raw = chain("weld", ("planar beam", "rigid"), plane=True)
    assert "crank" in spatial_beams(scene_from(raw))
    raw["links"]["crank"]["beam"] = "planar"
    with pytest.raises(KedfemError, match=r"must be a hinge .*'crank', got a weld to a rigid link"):
        scene_from(raw)
    carried = chain("weld", ("rigid", "planar beam"), plane=True)
    carried["links"]["link 1"]["beam"] = "planar"
    assert not spatial_beams(scene_from(carried))


@pytest.mark.parametrize("kind", ["revolute", "prismatic", "weld"])
def test_dampers_of_bushings_are_felt_where_beams_in_space_start_as_where_planar_ones_do(kind: str) -> None:
    """Once left out of the starts of full beams in space: of a weld's force 5.2 N remained instead of 0.33 N."""
    raw = chain(kind, ("planar beam", "planar beam"), plane=True)
    raw["joints"]["J"]["bushing"] = {"stiffness": 1e6, "damping": 300.0}
    planar = channels(*ran(raw))["joints/J/force"]
    for link in raw["links"].values():
        link["beam"] = "spatial"
    spatial = channels(*ran(raw))["joints/J/force"]
    assert_allclose(spatial[:1, :2], planar[:1, :2], rtol=0, atol=1e-7 * np.abs(planar[0]).max())
    assert_allclose(spatial[:, :2], planar[:, :2], rtol=0, atol=1e-2 * np.abs(planar).max())  # sections lean a little


ARM = {"width": 0.02, "thickness": 0.01}  # m


def arm(kinds: tuple[str, str], frames: str) -> dict[str, Any]:
    """Two bars in a row, welded, on a hinge that turns them; a force at the end, gravity."""
    ends = {"one": ([0, 0], [0.2, 0]), "two": ([0.2, 0], [0.4, 0])}
    meshes = {"plane": {"elements": [16, 2]}, "beam": {"elements": 4}}
    return {
        "links": {
            name: {"model": kind, "material": "steel", "shape": {"kind": "bar", "between": ends[name], **ARM},
                   "mesh": meshes[kind]}
            for name, kind in zip(ends, kinds, strict=True)
        },
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "one"], "at": [0, 0, 0]},
            "W": {"kind": "weld", "links": ["one", "two"], "at": [0.2, 0, 0]},
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 5.0}},
        "gravity": [0, -9.81, 0],
        "loads": {"f": {"kind": "force", "link": "two", "at": [0.4, 0, 0], "vector": [0, -100, 0]}},
        "output": {"probes": {"tip": {"link": "two", "at": [0.4, 0, 0], "quantity": "displacement", "frame": "world"}}},
        "analysis": {"kind": "quasi-static", "end_time": 0.02, "step": 0.01, "accuracy": "quick", "frames": frames},
    }  # fmt: skip


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
@pytest.mark.parametrize("kinds", [("plane", "beam"), ("beam", "plane")])
def test_a_plane_link_and_a_planar_beam_are_welded_as_two_beams_are(kinds: tuple[str, str], frames: str) -> None:
    """Shear aside, which is 1e-4 of the deflection: the weld passes force, and moment, without any give of its own."""
    scene = arm(kinds, frames)
    assert not spatial_beams(scene_from(scene))
    mixed, beams = (channels(*ran(each)) for each in (scene, arm(("beam", "beam"), frames)))
    assert_allclose(mixed["probes/tip/displacement"], beams["probes/tip/displacement"], atol=1e-4 * 1.6e-3)
    assert_allclose(mixed["joints/W/moment"], beams["joints/W/moment"], atol=1e-6 * 20)


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
@pytest.mark.parametrize("kinds", [("plane", "solid"), ("solid", "plane")])
def test_a_plane_link_and_a_solid_are_welded_as_two_plane_links_are(kinds: tuple[str, str], frames: str) -> None:
    """Without contraction a plane link is the solid that moves in its plane."""
    assert_alike(without_contraction(kinds, frames), without_contraction(("plane", "plane"), frames), 1e-7)


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
def test_a_plane_link_and_a_rigid_one_are_welded_as_to_a_far_stiffer_plane_link(frames: str) -> None:
    """Ten thousand times as stiff, it bends so little."""
    rigid, stiff = (without_contraction(("plane", kind), frames) for kind in ("rigid", "plane"))
    stiff["materials"]["stiff"] = stiff["materials"]["own"] | {"youngs_modulus": 2.1e15}
    stiff["links"]["two"]["material"] = "stiff"
    assert_alike(rigid, stiff, 1e-4)


@pytest.mark.parametrize("frames", ["rigid-body", "stiffening", "co-rotational", "no drive"])
@pytest.mark.parametrize("partners", [("plane", "rigid"), ("solid", "plane")])
def test_a_weld_of_a_plane_link_and_one_in_space_moves_as_by_the_oracle(partners: tuple[str, str], frames: str) -> None:
    raw = chain("weld", partners, plane=True)
    raw["analysis"] |= {
        "initial": "rest",
        "frames": "co-rotational" if frames in {"co-rotational", "no drive"} else "rigid-body",
    }
    if frames == "stiffening":
        raw["analysis"]["stiffening"] = True
    if frames == "no drive":
        del raw["drive"]
        raw["analysis"]["initial_speeds"] = {"A": 3.0}
    of = as_a_run(begun(raw))
    assert against_oracle(stiffened(of) if frames == "stiffening" else of, 3) < 1e-7


def assert_alike(one: dict[str, Any], other: dict[str, Any], digits: float) -> None:
    """Deflections, forces in the plane and moments across it."""
    got, wanted = (channels(*ran(each)) for each in (one, other))
    for name in ("probes/tip/displacement", "joints/W/moment", "joints/W/force", "drive/torque"):
        part = slice(-1, None) if name.endswith("moment") else slice(2)
        size = float(np.abs(wanted[name]).max())
        assert_allclose(got[name][:, part], wanted[name][:, part], rtol=0, atol=digits * size, err_msg=name)


def without_contraction(kinds: tuple[str, str], frames: str) -> dict[str, Any]:
    """`arm` of a material with ν = 0, solids of one layer across the plane; seen at the weld, far from the force."""
    raw = arm(("plane", "plane"), frames)
    raw["output"]["probes"] = {"tip": {"link": "one", "at": [0.2, 0.01, 0], "quantity": "displacement", "frame": "world"}}
    raw["materials"] = {"own": {"youngs_modulus": 2.1e11, "poisson_ratio": 0.0, "density": 7850.0}}
    more = {"solid": {"mesh": {"elements": [16, 2, 1]}, "element": "hex27"}, "rigid": {"mesh": {"elements": [1, 1, 1]}}}
    for link, kind in zip(raw["links"].values(), kinds, strict=True):
        link |= {"model": kind, "material": "own", **more.get(kind, {})}
    return raw


def test_a_weld_of_two_faces_at_an_angle_is_refused_with_the_reason() -> None:
    raw = chain("weld", ("solid", "solid"))
    raw["links"]["link 1"]["shape"]["between"][1] = [0.2, 0.15, 0.05]
    with pytest.raises(KedfemError, match=r"joints\.J: must weld faces that lie in one plane.* of link 'link 1'"):
        ran(raw)
