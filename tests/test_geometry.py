"""The parts of geometry/: each STEP file is what its module draws; random parts and bad files are what they say."""

from importlib import import_module
from pathlib import Path
from types import ModuleType

import gmsh
import numpy as np
import pytest
from geometry import PARTS, crank_train, engine
from geometry.make import HERE, drawn, empty_model, write_part
from numpy.testing import assert_allclose

from tests import bad_cad
from tests.random_parts import FAMILIES, random_part


def solids(occ: ModuleType) -> list[int]:
    occ.synchronize()
    return [tag for _, tag in gmsh.model.getEntities(3)]


def names() -> list[str]:
    return [gmsh.model.getEntityName(*solid).split("/")[-1] for solid in gmsh.model.getEntities(3)]


def loose() -> list[tuple[int, int]]:
    """Faces, edges and points that bound nothing."""
    lower = [entity for dim in (0, 1, 2) for entity in gmsh.model.getEntities(dim)]
    return [entity for entity in lower if not len(gmsh.model.getAdjacencies(*entity)[0])]


def in_file(path: Path) -> tuple[float, tuple[float, ...]]:
    """Volume and bounding box of the one solid of a STEP file, which has the file's name."""
    with empty_model() as occ:
        occ.importShapes(str(path))
        (tag,) = solids(occ)
        assert names() == [path.stem]
        assert not loose()
        return occ.getMass(3, tag), occ.getBoundingBox(3, tag)


@pytest.mark.parametrize("name", PARTS)
def test_a_part_drawn_anew_is_the_one_of_its_step_file(name: str, tmp_path: Path) -> None:
    volume, box = in_file(HERE / f"{name}.step")
    write_part(name, tmp_path)
    new_volume, new_box = in_file(tmp_path / f"{name}.step")
    # STEP keeps 15 digits
    assert_allclose(new_volume, volume, rtol=1e-9)
    assert_allclose(new_box, box, rtol=0, atol=1e-9 * max(map(abs, box)))
    with empty_model() as occ:
        tag = drawn(name, occ)
        assert not loose()
        # edges of free-form fillets keep a gap of 1e-7 of what they bound, closed otherwise after reading
        assert_allclose(occ.getMass(3, tag), volume, rtol=1e-6)


def test_a_step_file_comes_out_the_same_every_time(tmp_path: Path) -> None:
    for name in ("crank", "clevis"):  # twice in one process: OpenCASCADE counts what it has written
        write_part(name, tmp_path)
        assert (tmp_path / f"{name}.step").read_text("utf-8") == (HERE / f"{name}.step").read_text("utf-8")
    for whole in (engine, crank_train):
        whole.write(tmp_path)
        name = f"{whole.NAME}.step"
        assert (tmp_path / name).read_text("utf-8") == (HERE / name).read_text("utf-8")


def test_headers_name_the_part_and_nobody() -> None:
    for name in (*PARTS, engine.NAME, crank_train.NAME):
        text = (HERE / f"{name}.step").read_text("utf-8")
        assert f"FILE_NAME('{name}.step','2026-01-01T00:00:00',('kedfem')" in text
        assert "Open CASCADE" not in text


@pytest.mark.parametrize(
    ("name", "parts"), [(engine.NAME, list(engine.SOLIDS)), (crank_train.NAME, list(crank_train.SOLIDS))]
)
def test_an_assembly_has_named_solids_that_touch_but_do_not_overlap(name: str, parts: list[str]) -> None:
    with empty_model() as occ:
        occ.importShapes(str(HERE / f"{name}.step"))
        tags = dict(zip(names(), solids(occ), strict=True)) if solids(occ) else {}
        assert sorted(tags) == sorted(parts)
        whole = sum(occ.getMass(3, tag) for tag in tags.values())
        first, *others = [(3, tag) for tag in tags.values()]
        pieces, _ = occ.fragment([first], others)
        volumes = [occ.getMass(*piece) for piece in pieces if piece[0] == 3]
        assert len(volumes) == len(parts)
        assert_allclose(sum(volumes), whole, rtol=1e-9)


def test_the_engine_is_a_slider_crank() -> None:
    crank_pin, slider_pin = np.array(engine.CRANK_PIN), np.array(engine.SLIDER_PIN)
    assert_allclose(np.hypot(*crank_pin), import_module("geometry.crank").RADIUS, rtol=1e-14)
    rod = import_module("geometry.connecting_rod").LENGTH
    assert_allclose(np.hypot(*(slider_pin - crank_pin)), rod, rtol=1e-14)


def test_volumes_of_the_readme_are_those_of_the_files() -> None:
    lines = (HERE / "README.md").read_text("utf-8").splitlines()
    told = {cells[1].strip(" `"): cells for cells in (line.split("|") for line in lines) if len(cells) > 5}
    for name in PARTS:
        with empty_model() as occ:
            occ.importShapes(str(HERE / f"{name}.step"))
            (tag,) = solids(occ)
            assert float(told[name][-2].replace(" ", "")) == round(occ.getMass(3, tag)), name


@pytest.mark.parametrize("seed", range(10))
def test_a_random_part_is_one_solid(seed: int) -> None:
    with empty_model() as occ:
        kind, tag = random_part(occ, np.random.default_rng(seed))
        assert kind in FAMILIES
        assert solids(occ) == [tag]
        assert occ.getMass(3, tag) > 0
        assert not loose()


@pytest.mark.parametrize("write", bad_cad.GOOD[:3], ids=lambda write: write.__name__)
def test_the_sound_part_is_the_same_in_every_unit(write: object, tmp_path: Path) -> None:
    assert callable(write)
    with empty_model() as occ:
        occ.importShapes(str(write(tmp_path)))
        (tag,) = solids(occ)
        exact = 10 * (60 * 20 - 2 * np.pi * 4**2)  # a plate less two bores
        assert_allclose(occ.getMass(3, tag), exact, rtol=1e-9)


#: what gmsh makes of the files that it does read: the number of solids
READ = {
    bad_cad.header_only: 0,
    bad_cad.shells: 0,
    bad_cad.open_shell: 0,
    bad_cad.wires: 0,
    bad_cad.two_solids: 2,
    bad_cad.same_names: 2,
    bad_cad.overlapping: 2,
    bad_cad.self_crossing: 1,
    bad_cad.thin_sheet: 1,
    bad_cad.thin_fin: 1,
    bad_cad.no_bore: 1,
    bad_cad.thousandfold: 1,
}


@pytest.mark.parametrize("write", bad_cad.BAD, ids=lambda write: write.__name__)
def test_a_bad_file_is_bad_as_it_says(write: object, tmp_path: Path) -> None:
    assert callable(write)
    path = write(tmp_path)
    with empty_model() as occ:
        if write in READ:
            occ.importShapes(str(path))
            assert len(solids(occ)) == READ[write]
        else:
            with pytest.raises(Exception, match="Could not read"):
                occ.importShapes(str(path))
