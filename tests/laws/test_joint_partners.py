"""Every kind of joint with every kind of partner, along x, y, z and askew: one answer, or refused, with the reason."""

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from kedfem.errors import KedfemError
from kedfem.scene.moving import SHARED
from tests.laws.test_joint_rows import ROUNDING, assert_the_same, moved
from tests.moving import ran
from tests.partners import IN_PLANE, IN_SPACE, PLANAR, SPATIAL, Z, chain

Cell = tuple[str, tuple[str, str], bool]
#: a seat at the very end of a bar; a slider with two slides
FOUND: list[Cell] = [("prismatic", ("solid", "ground"), True), ("prismatic", ("bare", "planar beam"), False)]
DRIVEN = ("revolute", "prismatic")
#: a drive between a nearly rigid link and another: moving the scene's points by 1e-15 of themselves changes 2e-4
DRIVEN_RIGID = 1e-3


def refusal(kind: str, partners: tuple[str, str], driven: bool) -> str | None:
    """What the message says where the two do not go together; None if they do."""
    bare = partners.count("bare")
    if bare == 2 or (bare and partners[1] == "ground" and kind != "prismatic"):
        return r"links\.[\w ]+\.shape: is required for a rigid link that is not a slider"
    if bare and partners[1] != "ground" and (driven or kind not in SHARED):
        return rf"joints\.J\.links: must join links with a shape by a {kind} joint .* a rigid slider"
    if (
        kind in {"weld", "prismatic"}
        and "plane" in partners
        and not {"plane", "ground", "bare"}.issuperset(partners)
    ):
        return r"joints\.J\.kind: must be revolute or spherical between a plane link and another"
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


def check(cell: Cell, plane: bool, turns: tuple[str, ...]) -> None:
    kind, partners, driven = cell
    wanted = refusal(*cell)
    made = {name: partial(chain, kind, partners, driven, plane, TURNS[plane][name]) for name in turns}
    if wanted is not None:
        for scene in made.values():
            with pytest.raises(KedfemError, match=wanted):
                ran(scene())
        return
    axes: list[np.ndarray] = []
    chain(kind, partners, driven, plane, lambda axis: axes.append(axis) or np.eye(3))  # type: ignore[func-returns-value]
    R = {name: TURNS[plane][name](axes[0]) for name in turns}
    here = ran(made[turns[0]]())
    stiff = bool({"rigid", "bare"} & set(partners))
    digits = DRIVEN_RIGID if stiff and driven else ROUNDING["rigid" if stiff else "beams"]
    for name in turns[1:]:
        assert_the_same(kind, here, ran(made[name]()), R[name] @ R[turns[0]].T, digits)


@pytest.mark.parametrize("cell", cheap(plane=False), ids=named)
def test_joints_in_space_are_the_same_along_z_and_askew(cell: Cell) -> None:
    check(cell, plane=False, turns=("z", "askew"))


@pytest.mark.parametrize("cell", [*cheap(plane=True), *FOUND], ids=named)
def test_joints_in_the_plane_are_the_same_along_y_and_askew(cell: Cell) -> None:
    check(cell, plane=True, turns=("y", "askew"))
