"""The highest stresses of each link as tables: places apart, with time and drive, as the envelope has them."""

import csv
from pathlib import Path

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.analysis import Run, analyse
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
