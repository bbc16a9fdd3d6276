"""Mesh files that name others, Abaqus' includes and XDMF's data: read beside them, and a change of any is a change."""

from pathlib import Path

import meshio
import pytest
from numpy.testing import assert_array_equal

from kedfem.accuracy.prepared import key
from kedfem.errors import MeshError, SceneError
from kedfem.mesh.files.read import mesh_from_file
from kedfem.resume import origin
from kedfem.scene import read_scene

from .test_mesh_files import box

SCENE = """
links.arm = { material = "steel", shape = { file = "FILE" } }
joints.A = { kind = "revolute", links = ["ground", "arm"], at = [0, 0.5, 0.5] }
drive = { joint = "A", motion = { kind = "constant_speed", speed = "60 rpm" } }
analysis = { revolutions = 1 }
"""


def scaled(path: Path, scale: float) -> meshio.Mesh:
    found = meshio.read(path)
    found.points *= scale
    return found


def written(folder: Path, form: str, scale: float) -> Path:
    """A box whose numbers are in a file beside the one that names it."""
    source = scaled(box(folder / "source.vtk", order=1), scale)
    if form == "inp":
        (folder / "parts").mkdir(exist_ok=True)
        source.write(folder / "parts" / "points.inp")
        (folder / "mesh.inp").write_text("*HEADING\na box\n*include , input=parts/more.inp\n")
        (folder / "parts" / "more.inp").write_text('*INCLUDE, INPUT="points.inp"\n')
        return folder / "mesh.inp"
    source.write(folder / "mesh.xdmf", data_format=form)
    if form == "Binary":
        text = (folder / "mesh.xdmf").read_text()
        (folder / "mesh.xdmf").write_text(text.replace(f"{folder}/", ""))
    return folder / "mesh.xdmf"


@pytest.mark.parametrize("form", ["inp", "HDF", "Binary"])
def test_what_a_mesh_file_names_belongs_to_it(form: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """To the mesh that is kept between runs, to plans and modes, to runs that are resumed; from any folder."""
    monkeypatch.setenv("KEDFEM_CACHE", str(tmp_path / "cache"))
    monkeypatch.chdir(tmp_path)
    folder = tmp_path / "scene"
    folder.mkdir()
    found = []
    for scale in (1.0, 2.0):
        file = written(folder, form, scale)
        (folder / "scene.toml").write_text(SCENE.replace("FILE", file.name))
        scene = read_scene(folder / "scene.toml", within=True)
        mesh = mesh_from_file("mesh", file, 1.0)
        found.append((mesh.points, key(scene), origin(scene)))
    (points, first, before), (larger, second, after) = found
    assert_array_equal(larger, 2 * points)
    assert first != second
    assert {name for name in before if before[name] != after[name]} == {f"contents of {file.name}"}


@pytest.mark.parametrize("form", ["inp", "HDF", "Binary"])
def test_what_a_mesh_file_names_outside_is_refused_within(form: str, tmp_path: Path) -> None:
    folder = tmp_path / "scene"
    folder.mkdir()
    file = written(folder, form, 1.0)
    name = {"inp": "parts/more.inp", "HDF": "mesh.h5", "Binary": "mesh0.bin"}[form]
    file.write_text(file.read_text().replace(name, f"../{Path(name).name}"))
    (folder / "scene.toml").write_text(SCENE.replace("FILE", file.name))
    with pytest.raises(
        SceneError, match=rf"shape\.file: must be within .*'{file.name}', which names .*{Path(name).name}"
    ):
        read_scene(folder / "scene.toml", within=True)


def test_abaqus_includes_stand_for_their_text(tmp_path: Path) -> None:
    """Nodes in one file, elements and surfaces in others, as by hand; meshio alone knows no nodes of other files."""
    whole = box(tmp_path / "whole.inp").read_text()
    head, rest = whole.split("*ELEMENT", 1)
    nodes = head[head.index("*NODE") :]
    (tmp_path / "nodes.inp").write_text(nodes)
    (tmp_path / "rest.inp").write_text(f"*ELEMENT{rest}")
    (tmp_path / "parts.inp").write_text("*INCLUDE, INPUT=nodes.inp\n*Include, Input=rest.inp\n")
    one, parts = (mesh_from_file("mesh", tmp_path / name, 1.0) for name in ("whole.inp", "parts.inp"))
    assert_array_equal(parts.points, one.points)
    assert_array_equal(parts.cells, one.cells)
    assert [face.name for face in parts.faces] == [face.name for face in one.faces] != []


def test_includes_that_are_missing_or_circular_are_refused(tmp_path: Path) -> None:
    (tmp_path / "a.inp").write_text("*INCLUDE, INPUT=b.inp\n")
    with pytest.raises(MeshError, match=r"^mesh: .*a\.inp: \*INCLUDE in a\.inp must name another file, got nothing at"):
        mesh_from_file("mesh", tmp_path / "a.inp", 1.0)
    (tmp_path / "b.inp").write_text("*INCLUDE, INPUT=a.inp\n")
    with pytest.raises(MeshError, match=r"\*INCLUDE in b\.inp must name another file, got one that is being read at"):
        mesh_from_file("mesh", tmp_path / "a.inp", 1.0)
