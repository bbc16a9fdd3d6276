"""The quality record and the gate's words: where bad elements are, near which face, what to change."""

from dataclasses import replace

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from kedfem.errors import MeshError
from kedfem.mesh import SolidMesh, checked_mesh, mesh_quality
from kedfem.mesh.elements.hexahedra import Face
from kedfem.mesh.elements.shape_functions import HEX8

#: Columns of unit cubes along x, the upper side of each moved along y: scaled Jacobian cos of the angle of shear.
SHEARS = (0.0, 1.0, 3.0, 20.0)


def sheared() -> SolidMesh:
    """Four elements apart from each other, sheared by 0, 1, 3 and 20: 1, 0.71, 0.32 and 0.05."""
    cubes = [(HEX8 + 1) / 2 + [2.0 * i, 0, 0] for i in range(len(SHEARS))]
    for cube, shear in zip(cubes, SHEARS, strict=True):
        cube[4:, 1] += shear
    return SolidMesh(np.concatenate(cubes), np.arange(8 * len(SHEARS)).reshape(-1, 8))


def face(name: str, kind: str, radius: float, sides: list[list[int]]) -> Face:
    return Face(name, kind, np.zeros(3), np.array([0, 0, 1.0]), radius, True, np.array(sides))


def refusal(mesh: SolidMesh, least: float) -> str:
    with pytest.raises(MeshError) as caught:
        checked_mesh("links.arm", mesh, least)
    return str(caught.value)


def test_worst_elements_come_worst_first_with_their_places():
    quality = mesh_quality(sheared())
    assert_array_equal(quality.worst_elements(3), [3, 2, 1])
    assert_array_equal(quality.centres[quality.worst_elements(1)], [[6.5, 10.5, 0.5]])
    assert quality.worst == 3
    assert_array_equal(quality.centre, [6.5, 10.5, 0.5])


def test_histogram_counts_every_element_once():
    points = sheared().points.copy()
    points[:8, 2] *= -1  # the first is mirrored
    edges, counts = mesh_quality(SolidMesh(points, sheared().cells)).histogram(10)
    assert len(edges) == len(counts) + 1 == 12
    assert_array_equal(np.flatnonzero(counts), [0, 1, 4, 8])  # below 0; 0.05; 1/√10; 1/√2
    assert counts.sum() == 4


def test_refusal_counts_the_others_and_names_three():
    message = refusal(sheared(), 0.9)
    assert (
        "got 0.0499 in element 3 at (6500, 10500, 500) mm and 2 more, as at (4500, 2000, 500) mm, (2500, 1000, 500) mm;"
        in message
    )
    assert "more" not in refusal(sheared(), 0.1)


@pytest.mark.parametrize(
    ("kind", "radius", "words"),
    [
        ("cylinder", 0.002, "near bore, a cylinder of radius 2 mm;"),
        ("plane", np.nan, "near bore, a plane;"),
        ("other", np.nan, "near bore;"),
    ],
)
def test_refusal_names_the_nearest_face_and_what_to_suppress(kind, radius, words):
    faces = (face("end", "plane", np.nan, [[0, 1, 2, 3]]), face("bore", kind, radius, [[24, 25, 26, 27]]))
    message = refusal(replace(sheared(), faces=faces), 0.1)
    assert f"at (6500, 10500, 500) mm {words}" in message
    assert "suppress a fillet or small feature there" in message
    assert message.endswith("or lower min_quality")
