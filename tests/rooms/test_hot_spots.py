"""The highest stresses of each link as tables: places apart, with time and drive, as the envelope has them."""

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.analysis import Run, analyse
from kedfem.output.derived import yield_warning
from kedfem.report import write_report
from kedfem.report.facts import peak_rows
from kedfem.results import Peak, read_results
from kedfem.results.stresses import peaks
from kedfem.results.stresses.peaks import APART, MOST
from kedfem.scene import scene_from
from tests.reliability.fuzz import short
from tests.scenes import example

FAR = 5 * APART  # coarse meshes have no points within the usual distance
SCENES = ["four_bar_beams", "four_bar_corotational", "spinning_bar"]


@pytest.fixture(scope="module", params=SCENES)
def run(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Run:
    raw = short(example(request.param))
    raw["output"] |= {"csv": True}
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(peaks, "APART", FAR)
        return analyse(scene_from(raw, tmp_path_factory.mktemp(request.param)))


def lines(path: Path) -> list[dict[str, str]]:
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def numbers(rows: list[dict[str, str]], *names: str) -> np.ndarray:
    return np.array([[float(row[name] or "nan") for name in names] for row in rows])


PLACE = ("reference x [m]", "reference y [m]", "reference z [m]")


def test_the_first_of_each_link_is_its_peak(run: Run) -> None:
    top = {row["link"]: row for row in reversed(lines(run.folder / "peaks.csv"))}
    assert set(top) == set(run.peaks)
    for link, peak in run.peaks.items():
        names = ("von Mises stress [Pa]", *PLACE, "time [s]", "drive angle [rad]")
        found = numbers([top[link]], *names)[0]
        assert_allclose(found, [peak.stress, *peak.place, peak.time, peak.angle], rtol=5e-9)
        assert (top[link]["rank"], int(top[link]["node"]), top[link]["near"]) == ("1", peak.node, peak.near)


def test_the_others_are_the_highest_at_places_apart(run: Run) -> None:
    """Of all points of the envelope none is higher than the last that is reported, but beside one that is reported."""
    every, top = lines(run.folder / "envelope.csv"), lines(run.folder / "peaks.csv")
    for link in run.peaks:
        mine, told = ([row for row in rows if row["link"] == link] for rows in (every, top))
        X, s = numbers(mine, *PLACE), numbers(mine, "highest von Mises stress [Pa]")[:, 0]
        places, stress = numbers(told, *PLACE), numbers(told, "von Mises stress [Pa]")[:, 0]
        apart = FAR * np.linalg.norm(np.ptp(X, axis=0))
        assert 1 < len(told) <= MOST
        assert (np.diff(stress) <= 0).all()
        gaps = np.linalg.norm(places[:, None] - places, axis=2) + np.eye(len(told))
        assert gaps.min() > apart * (1 - 1e-6)
        beside = (np.linalg.norm(X[:, None] - places, axis=2) <= apart * (1 + 1e-6)).any(axis=1)
        assert beside.all() if len(told) < MOST else s[~beside].max() <= stress[-1]


def test_every_point_has_the_time_and_the_drive_of_its_stress(run: Run) -> None:
    """The table, of nine digits, is the file for ParaView, of single precision; the drive is where it is at that time."""
    every = lines(run.folder / "envelope.csv")
    seen = meshio.read(run.folder / "envelope.vtu")
    names = [name for name in every[0] if "stress [" in name]
    assert len(names) == 9
    for name in names:
        assert_allclose(numbers(every, name)[:, 0], seen.point_data[name], rtol=2**-24 + 5e-9)
    assert_allclose(numbers(every, *PLACE), seen.points, rtol=5e-9, atol=1e-15)
    results = run.results
    for kind in ("highest von Mises", "largest principal", "smallest principal"):
        t, angle = numbers(every, f"time of {kind} stress [s]", f"drive angle of {kind} stress [rad]").T
        assert_allclose(angle, np.interp(t, results.time, results.angle), rtol=1e-7, atol=1e-9)
    assert {row["link"] for row in every} >= set(run.peaks)


def test_each_kind_of_stress_has_its_own_time(run: Run) -> None:
    """Fibres of slender links are pulled and pressed: von Mises is highest when one of both is; these are two times."""
    every = [row for row in lines(run.folder / "envelope.csv") if row["highest von Mises stress [Pa]"]]
    kinds = ("highest von Mises", "largest principal", "smallest principal")
    size = np.abs(numbers(every, *(f"{kind} stress [Pa]" for kind in kinds)))
    mises, pull, push = numbers(every, *(f"time of {kind} stress [s]" for kind in kinds)).T
    if "Four-bar" in run.results.scene_json:
        assert_allclose(size[:, 0], size[:, 1:].max(axis=1), rtol=1e-8)
        assert (pull != push).any()  # of planar beams one point has both fibres, in bending at one time
        assert (mises == np.where(size[:, 1] > size[:, 2], pull, push)).all()


def cantilevers(strength: float) -> dict[str, Any]:
    """Two bars of 0.5 m, 20 mm square, welded to the ground, with 100 N across their ends: 6 F L / b³ = 37.5 MPa."""
    steel = {"density": 7850.0, "youngs_modulus": 210e9, "poisson_ratio": 0.3}
    raw: dict[str, Any] = {
        "materials": {"known": {**steel, "yield_strength": strength}, "unknown": steel},
        "analysis": {"kind": "static"}, "links": {}, "joints": {}, "loads": {},
    }  # fmt: skip
    for y, name in enumerate(raw["materials"]):
        bar = {"kind": "bar", "between": [[0, y], [0.5, y]], "width": 0.02, "thickness": 0.02}
        raw["links"][name] = {"model": "beam", "material": name, "shape": bar}
        raw["joints"][name] = {"kind": "weld", "links": ["ground", name], "at": [0, y]}
        raw["loads"][name] = {"kind": "force", "link": name, "at": [0.5, y], "vector": [0, 100]}
    return raw


@pytest.mark.parametrize("strength", [30e6, 50e6])
def test_highest_stresses_are_compared_with_yield_strengths(strength: float, tmp_path: Path) -> None:
    run = analyse(scene_from(cantilevers(strength), tmp_path))
    kept = read_results(run.folder / "results.h5").peaks
    stress = kept["known"].stress
    assert_allclose(stress, 37.5e6, rtol=1e-6)
    assert kept["known"].strength == strength
    assert kept["unknown"].strength == np.inf
    rows = {row[0]: row[2] for row in peak_rows(kept, lambda time, angle: "")}
    assert rows == {"known": f"{100 * 37.5e6 / strength:.3g} %", "unknown": "–"}
    told = [text for text in run.warnings if "yield strength" in text]
    assert len(told) == (strength < 37.5e6)
    assert all("37.5 MPa in link known" in text and "above its yield strength, 30 MPa" in text for text in told)
    write_report(run.folder)
    assert f"{100 * 37.5e6 / strength:.3g} % of the yield strength" in (run.folder / "report.html").read_text()


def test_stress_at_a_singular_place_is_not_compared_with_a_yield_strength() -> None:
    sound = Peak(20e6, "arm", (0.0, 0.0, 0.0), 0, 0, 0.0, 0.0, strength=30e6)
    corner = replace(sound, stress=90e6, near="a sharp corner")
    assert yield_warning({"arm": replace(corner, away=sound)}) == yield_warning({"arm": corner}) == ()
    assert "40 MPa" in yield_warning({"arm": replace(corner, away=replace(sound, stress=40e6))})[0]


def test_without_a_yield_strength_there_is_no_column(run: Run) -> None:
    assert {len(row) for row in peak_rows(run.peaks, lambda time, angle: "")} == {5}
