"""Files damaged at random, and of very many faces: a mesh or a sentence, never a traceback or a library's own words."""

import random
from pathlib import Path
from time import process_time

import numpy as np
import pytest

from kedfem.errors import MeshError
from kedfem.mesh import SolidMesh, link_mesh, mesh_quality
from kedfem.mesh.cad import file
from kedfem.mesh.cad.file import imported
from kedfem.mesh.cad.model import CadKeys, solid_model
from kedfem.mesh.isolated import LONGEST, silent
from kedfem.mesh.session import gmsh_model
from kedfem.scene import Cad, link_from
from tests.reliability.files import MESHES, sound_parts
from tests.reliability.mutations import DAMAGES

from .cad_files import FORMATS


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return sound_parts(tmp_path_factory.mktemp("sound"))


def check(sound: Path, folder: Path, ending: str, number: int, capfd: pytest.CaptureFixture[str]) -> bool:
    """One damaged file: whether it was refused."""
    rng = random.Random(f"{ending} {number}")
    content = (sound / f"part.{ending}").read_bytes()
    path = folder / f"part.{ending}"
    path.write_bytes(DAMAGES[number % len(DAMAGES)](content, rng))
    shape = {"kind": "cad" if ending in FORMATS else "mesh", "file": path.name}
    link = link_from({"material": "steel", "shape": shape, "mesh": {"size": 0.02} if ending in FORMATS else {}})
    capfd.readouterr()
    try:
        mesh = link_mesh("arm", link, folder)
    except MeshError as error:
        said = str(error)
        assert said.startswith("links.arm"), said
        assert "must" in said, said
        assert "Traceback" not in said
        assert len(said.splitlines()) == 1, said
        assert len(said) < 1200, said
        refused = True
    else:
        assert isinstance(mesh, SolidMesh)
        assert np.isfinite(mesh.points).all()
        assert mesh_quality(mesh).least > 0
        refused = False
    assert capfd.readouterr() == ("", "")
    assert [each.name for each in folder.iterdir()] == [path.name]  # nothing half-written
    return refused


@pytest.mark.parametrize("ending", [*FORMATS, *MESHES])
def test_a_damaged_file_gives_a_mesh_or_a_sentence(
    sound: Path, tmp_path: Path, ending: str, capfd: pytest.CaptureFixture[str]
) -> None:
    for number in (1,) if ending in FORMATS else (0, 2):
        check(sound, tmp_path, ending, number, capfd)


def test_a_part_whose_faces_do_not_close_is_read_at_most_six_times(tmp_path: Path) -> None:
    """Once plain, five times sewn: OpenCASCADE hung at the tenth reading of a damaged one."""
    reads = 0

    def counted(*given: object, **more: object) -> None:
        nonlocal reads
        reads += 1
        imported(*given, **more)  # type: ignore[arg-type]

    with gmsh_model() as gmsh, silent():
        gmsh.model.occ.addBox(0, 0, 0, 10, 20, 30)
        gmsh.model.occ.remove([(3, 1)])
        gmsh.model.occ.remove([(2, 1)])
        gmsh.model.occ.synchronize()
        gmsh.write(str(tmp_path / "part.step"))
    with pytest.MonkeyPatch.context() as patch, gmsh_model() as gmsh:
        patch.setattr(file, "imported", counted)
        with pytest.raises(MeshError, match="faces that do not close"):
            file.read_solids(gmsh, file.cad_file("links.arm", tmp_path / "part.step", None))
    assert reads == 6


@pytest.mark.long
@pytest.mark.parametrize("ending", [*FORMATS, *MESHES])
def test_many_damaged_files_give_meshes_or_sentences(
    sound: Path, tmp_path: Path, ending: str, capfd: pytest.CaptureFixture[str]
) -> None:
    """Five of each kind; `python -m tests.reliability.fuzz` tries thousands."""
    refused = [check(sound, tmp_path, ending, number, capfd) for number in range(5, 10)]
    assert sum(refused) > 1  # the damage is real


@pytest.mark.long
def test_a_part_of_ten_thousand_faces_is_refused_before_each_is_looked_at(tmp_path: Path) -> None:
    facets(tmp_path / "scan.brep", 70)
    keys, shape = CadKeys("links.arm.step", "solid"), Cad(file="scan.brep")
    start = process_time()
    wanted = r"links.arm.*: must hold solids of at most 3,000 faces, got one of 9,805 in"
    with pytest.raises(MeshError, match=wanted), solid_model(keys, tmp_path / "scan.brep", "arm", shape):
        pass
    assert process_time() - start < LONGEST / 2  # seconds of processor time: OpenCASCADE reads for most of it


def facets(path: Path, n: int) -> None:
    """A plate whose upper side is n × n pairs of triangles, no two in one plane."""
    rng = np.random.default_rng(1)
    with gmsh_model() as gmsh:
        occ = gmsh.model.occ
        height = 10 + 30 / n * np.pad(rng.random((n - 1, n - 1)), 1)
        P = [[occ.addPoint(100 * i / n, 100 * j / n, height[i, j]) for j in range(n + 1)] for i in range(n + 1)]
        lines: dict[tuple[int, int], int] = {}

        def face(*corners: int) -> int:
            ends = [tuple(sorted(pair)) for pair in zip(corners, (*corners[1:], corners[0]), strict=True)]
            for pair in ends:
                if pair not in lines:
                    lines[pair] = occ.addLine(*pair)
            return int(occ.addPlaneSurface([occ.addCurveLoop([lines[pair] for pair in ends])]))

        cells = [(P[i][j], P[i + 1][j], P[i + 1][j + 1], P[i][j + 1]) for i in range(n) for j in range(n)]
        faces = [face(*three) for a, b, c, d in cells for three in ((a, b, c), (a, c, d))]
        low = [occ.addPoint(x, y, 0) for x, y in ((0, 0), (100, 0), (100, 100), (0, 100))]
        rims = [[P[i][0] for i in range(n + 1)], P[n], [P[n - i][n] for i in range(n + 1)], P[0][::-1]]
        faces += [face(*low), *(face(*rim, low[(k + 1) % 4], low[k]) for k, rim in enumerate(rims))]
        occ.addVolume([occ.addSurfaceLoop(faces)])
        occ.synchronize()
        gmsh.write(str(path))
