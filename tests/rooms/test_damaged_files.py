"""Files damaged at random, and of very many faces: a mesh or a sentence, never a traceback or a library's own words."""

import random
import re
from collections.abc import Callable
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

from .cad_files import FORMATS, lever, written
from .test_mesh_files import box

MESHES = ("msh", "unv", "bdf", "med", "mesh", "vtk", "inp", "vtu", "xdmf")


@pytest.fixture(scope="module")
def sound(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A part and a mesh in all forms."""
    import meshio

    folder = tmp_path_factory.mktemp("sound")
    written(folder, "part", lever)
    for ending in MESHES[:7]:
        box(folder / f"part.{ending}")
    raw = meshio.read(folder / "part.vtk")
    solid = meshio.Mesh(raw.points, [("tetra10", raw.cells_dict["tetra10"])])
    for ending in MESHES[7:]:
        solid.write(folder / f"part.{ending}", **({"data_format": "XML"} if ending == "xdmf" else {}))
    return folder


def flipped(content: bytes, rng: random.Random) -> bytes:
    """Some bytes are others."""
    out = bytearray(content)
    for _ in range(rng.choice((1, 5, 50))):
        out[rng.randrange(len(out))] = rng.randrange(256)
    return bytes(out)


def cut(content: bytes, rng: random.Random) -> bytes:
    """A piece is missing."""
    start = rng.randrange(len(content))
    return content[:start] + content[start + rng.randrange(1, max(2, len(content) // 4)) :]


def renumbered(content: bytes, rng: random.Random) -> bytes:
    """Some numbers are others: negative, huge, not a number, zero."""
    spots = list(re.finditer(rb"\d+(?:\.\d*)?", content))
    for spot in sorted(rng.sample(spots, min(len(spots), rng.choice((1, 4, 20)))), key=lambda x: -x.start()):
        other = rng.choice((b"-1", b"0", b"99999999999", b"1e308", b"nan", b"7"))
        content = content[: spot.start()] + other + content[spot.end() :]
    return content


def shuffled(content: bytes, rng: random.Random) -> bytes:
    """Lines at other places, some twice."""
    lines = content.splitlines(keepends=True)
    for _ in range(rng.choice((1, 5, 20))):
        lines.insert(rng.randrange(len(lines)), lines[rng.randrange(len(lines))])
        lines.pop(rng.randrange(len(lines)))
    return b"".join(lines)


def noise(content: bytes, rng: random.Random) -> bytes:
    """Random bytes, with the beginning and the end of the real file or without."""
    middle = rng.randbytes(rng.randrange(1, 3000))
    return middle if rng.random() < 0.3 else content[:300] + middle + content[-200:]


DAMAGES: tuple[Callable[[bytes, random.Random], bytes], ...] = (flipped, cut, renumbered, shuffled, noise)


def check(sound: Path, folder: Path, ending: str, number: int, capfd: pytest.CaptureFixture[str]) -> bool:
    """One damaged file: whether it was refused."""
    rng = random.Random(f"{ending} {number}")
    content = (sound / f"part.{ending}").read_bytes()
    path = folder / f"part.{ending}"
    path.write_bytes(DAMAGES[number % len(DAMAGES)](content, rng))
    shape = {"kind": "cad" if ending in FORMATS else "mesh", "file": path.name}
    link = link_from(
        {"material": "steel", "shape": shape, "mesh": {"size": 0.02} if ending in FORMATS else {}}
    )
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
    refused = [check(sound, tmp_path, ending, number, capfd) for number in range(5, 30)]
    assert sum(refused) > 4  # the damage is real


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
        P = [
            [occ.addPoint(100 * i / n, 100 * j / n, height[i, j]) for j in range(n + 1)] for i in range(n + 1)
        ]
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
