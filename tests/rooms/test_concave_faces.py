"""Fillets and free bores of parts that are filled with tetrahedra: as fine as asked for, the rest as usual."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest

from kedfem.mesh import SolidMesh, tetrahedral
from kedfem.mesh.cad.model import solid_model
from kedfem.mesh.cad.solids import Sizing, Solid
from kedfem.mesh.tetrahedral import tetrahedral_mesh
from kedfem.scene import Cad
from tests.verification.concentrations import CROSS, LENGTH, bored_shaft, shaft

from .cad_files import KEYS, written

Draw = Callable[[ModuleType], None]
ASKED = np.radians(15)


@contextmanager
def read(draw: Draw, folder: Path) -> Iterator[tuple[ModuleType, Solid]]:
    """A drawing that has been through STEP."""
    written(folder, "part", draw, ("step",))
    with solid_model(KEYS, folder / "part.step", "part", Cad(file="part.step")) as found:
        yield found


def meshed(draw: Draw, folder: Path, asked: Sizing) -> SolidMesh:
    with read(draw, folder) as (gmsh, solid):
        return tetrahedral_mesh(gmsh, solid, asked)


def turns(mesh: SolidMesh) -> np.ndarray:
    """By how much edges on the cross bore turn about it [rad]."""
    (face,) = (face for face in mesh.faces if face.inward)
    X = mesh.points[face.sides] - face.centre
    square = X - (X @ face.direction)[..., None] * face.direction
    chords = np.linalg.norm(square - np.roll(square, 1, axis=1), axis=2)
    return np.asarray(2 * np.arcsin(np.minimum(chords / (2 * face.radius), 1.0)))


def far(mesh: SolidMesh) -> int:
    """How many nodes are far from the cross bore."""
    return int((np.abs(mesh.points[:, 0] - LENGTH / 2e3) > 4e-3 * CROSS).sum())


def test_a_bore_is_as_fine_as_asked_for_and_the_rest_as_usual(tmp_path: Path) -> None:
    usual, fine = (meshed(bored_shaft, tmp_path, Sizing(concave_angle=x)) for x in (np.pi / 4, ASKED))
    assert np.median(turns(usual)) > 1.3 * ASKED
    assert np.median(turns(fine)) < 1.1 * ASKED
    assert far(fine) == pytest.approx(far(usual), rel=0.35)


def test_a_bore_with_a_joint_is_as_usual(tmp_path: Path) -> None:
    usual = meshed(bored_shaft, tmp_path, Sizing())
    held = meshed(bored_shaft, tmp_path, Sizing(concave_angle=ASKED, kept_points=((LENGTH / 2e3, 0.004, 0.0),)))
    assert len(held.points) == len(usual.points)


def test_where_finer_ones_are_too_many_the_mesh_is_the_usual_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tetrahedral, "MOST_UNKNOWNS", 1000)
    usual, mesh = (meshed(bored_shaft, tmp_path, Sizing(concave_angle=x)) for x in (np.pi / 4, ASKED))
    assert len(mesh.points) == len(usual.points)
    assert "fillets and free bores no finer" in mesh.method


def test_too_many_elements_along_a_bore_are_made_fewer_and_it_says_so(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual = meshed(bored_shaft, tmp_path, Sizing())
    most = 3 * len(usual.points) + 20_000
    monkeypatch.setattr(tetrahedral, "MOST_UNKNOWNS", most)
    mesh = meshed(bored_shaft, tmp_path, Sizing(concave_angle=np.radians(10)))
    assert 3 * len(usual.points) < 3 * len(mesh.points) <= most
    assert "fillets and free bores by " in mesh.method


def rounded(occ: ModuleType) -> None:
    """A shaft whose end has a round: its surface bends towards the inside in both ways."""
    body = occ.addCylinder(0, 0, 0, 50, 0, 0, 15)
    occ.synchronize()
    occ.fillet([body], [1], [5.0])


@pytest.mark.parametrize(("draw", "hollow"), [(shaft, True), (rounded, False)])
def test_a_fillet_around_a_shaft_is_hollow_and_a_round_is_not(draw: Draw, hollow: bool, tmp_path: Path) -> None:
    with read(draw, tmp_path) as (_, solid):
        found = {face.kind: face.concave for face in solid.faces}
    assert found == {"plane": False, "cylinder": False, "other": hollow}
