"""The page about a run: it shows what the run wrote and what is missing, and fetches nothing."""

import contextlib
import json
import re
import shutil
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import pyvista
from numpy.testing import assert_allclose
from scipy.spatial import KDTree
from scipy.spatial.transform import Rotation

from kedfem.accuracy.error_budget import percent
from kedfem.analysis import analyse
from kedfem.cli.results import written_page
from kedfem.errors import OutputError, SceneError
from kedfem.frequencies import Wanted, frequencies
from kedfem.kinematics import kinematics
from kedfem.output.bars import bars, heights
from kedfem.output.fields import VON_MISES
from kedfem.output.views import view
from kedfem.output.words import with_prefix
from kedfem.report import animated as over_frames
from kedfem.report import surfaces, write_report
from kedfem.report.animated import Animated, animated
from kedfem.report.curves import cursor_places, curve_groups
from kedfem.report.facts import loads_tables, notes_table, steady_table
from kedfem.report.page import instant_in_words
from kedfem.report.surfaces import placement
from kedfem.report.viewer import first_view
from kedfem.results import Results, read_results
from kedfem.results.channels import TRAVEL
from kedfem.results.frequencies import SUMMARY
from kedfem.scene import read_scene, scene_from
from tests.browser import Browser, needs_browser
from tests.frames import frames
from tests.rooms.test_output import drawn, warped
from tests.scenes import arm, bar, cycloidal, four_bar

SCALE = 50.0
FRAMES = {"frames_per_revolution": 5, "deformation_scale": SCALE}
TIMES = {"end_time": 0.1, "step": 2e-3, "accuracy": "quick", "initial": "quasi-static"}


def output(**more: Any) -> dict[str, Any]:
    return {"animation": FRAMES, "plots": False, "picture": False, **more}


def swung(**more: Any) -> dict[str, Any]:
    """A solid arm that a drive swings, with a probe."""
    probes = {"tip": {"link": "arm", "at": [0.5, 0], "quantity": "displacement"}}
    link = bar(0.5, 0.02, 0.02, mesh={"elements": [4, 1, 1]})
    return arm(link, cycloidal(1.0, 0.1), analysis=TIMES, output=output(probes=probes, **more))


def beams() -> dict[str, Any]:
    link = {
        "material": "steel", "model": "beam", "mesh": {"elements": 2},
        "shape": {"kind": "bar", "width": 0.02, "thickness": 0.01},
    }  # fmt: skip
    return four_bar((0.12, 0.35, 0.3, 0.38), link, cycloidal(1.0, 0.1), analysis=TIMES, output=output())


def run(raw: Mapping[str, Any], folder: Path) -> Path:
    return analyse(scene_from(raw, folder)).folder


@pytest.fixture(scope="module")
def solid(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Results of the arm, with the page that the run itself wrote."""
    return run(swung(report=True) | {"title": "An <arm> & its $drive$"}, tmp_path_factory.mktemp("solid"))


@pytest.fixture(scope="module")
def lines(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return run(beams(), tmp_path_factory.mktemp("lines"))


def page(folder: Path) -> str:
    return (folder / "report.html").read_text(encoding="utf-8")


AXES = {"x": [1, 0, 0], "y": [0, 1, 0], "z": [0, 0, 1], "oblique": [0.6, -0.5, 0.8]}


@pytest.mark.parametrize("axis", AXES.values(), ids=AXES)
@pytest.mark.parametrize("angle", [0.0, 1.0, np.pi, 5.0])
def test_rigid_motions_are_found_again(axis: list[float], angle: float) -> None:
    X = np.random.default_rng(1).normal(size=(30, 3))
    R = Rotation.from_rotvec(angle * np.array(axis) / np.linalg.norm(axis)).as_matrix()
    p = np.array([0.3, -2.0, 1.1])
    found = placement(X, p + X @ R.T)
    assert_allclose(found.R, R, atol=1e-12)
    assert_allclose(found.p, p, atol=1e-12)


@pytest.mark.parametrize("angle", [0.0, 0.5, np.pi / 2, 3.0, -2.0])
def test_points_on_a_line_stay_in_their_plane(angle: float) -> None:
    X = np.array([[0.1, 0.2, 0.5], [0.2, 0.2, 0.5], [0.6, 0.2, 0.5]])
    R = Rotation.from_rotvec([0, 0, angle]).as_matrix()
    found = placement(X, X @ R.T + [1.0, 2.0, 0.0], flat=True)
    assert_allclose(found.R, R, atol=1e-12)
    assert_allclose(found.p, [1.0, 2.0, 0.0], atol=1e-12)


def frames_of(folder: Path) -> list[Any]:
    return frames(folder)


def shown(folder: Path) -> Animated:
    found = animated(folder, SCALE)
    assert found is not None
    return found


def test_solids_are_drawn_where_frames_have_them(solid: Path) -> None:
    """Every point and its stress, in each frame; the links' axes move as the drive does; then undeformed."""
    found, written = shown(solid), frames_of(solid)
    (surface,) = found.surfaces
    drawn, *placed = surface.world()
    assert len(placed) == len(written) == 6
    for points, stress, grid in zip(placed, surface.stress[1:], written, strict=True):
        distance, near = KDTree(grid.points).query(points)
        assert distance.max() < 1e-7  # frames are in single precision
        assert_allclose(stress, grid.point_data[VON_MISES][near], rtol=1e-6)
    envelope = pyvista.read(solid / "envelope.vtu")
    distance, near = KDTree(envelope.points).query(drawn)
    assert distance.max() < 1e-12
    assert_allclose(surface.stress[0], envelope.point_data["highest von Mises stress [Pa]"][near], rtol=1e-12)
    results = read_results(solid / "results.h5")
    angles = [np.arctan2(each.R[1, 0], each.R[0, 0]) for each in surface.placements]
    assert_allclose(angles, np.interp(found.times, results.time, results.angle), atol=1e-9)
    outline = pyvista.PolyData(drawn, np.insert(surface.triangles, 0, 3, axis=1).ravel()).clean()
    assert outline.volume == pytest.approx(0.5 * 0.02 * 0.02, rel=1e-9)


def test_beams_are_drawn_with_their_sections_where_frames_have_them(lines: Path) -> None:
    found, written = shown(lines), frames_of(lines)
    assert {each.name for each in found.surfaces} == {"crank", "coupler", "rocker"}
    for k, grid in enumerate(written):
        grid.point_data["MPa"] = grid.point_data[VON_MISES]
        for surface in found.surfaces:
            cells = np.flatnonzero(grid.cell_data["link"] == int(grid.field_data[f"link {surface.name}"][0]))
            part = grid.extract_cells(cells)
            tree = KDTree(bars(part, heights(part)).points)
            assert tree.query(list(surface.world())[k + 1])[0].max() < 2e-6 * part.length  # corners are merged


def test_large_models_are_thinned_and_say_so(solid: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(surfaces, "NODES", 60)
    monkeypatch.setattr(over_frames, "FRAMES", 3)
    found = shown(solid)
    assert [text.partition(" of ")[0] for text in found.thinned[1:]] == ["3"]
    assert "nodes on the links' surfaces are drawn" in found.thinned[0]
    assert len(found.surfaces[0].points[0]) <= 80
    low, high = over_frames.bounds(found.surfaces, np.eye(3))
    assert_allclose(high - low, over_frames.bounds(found.surfaces[:1], np.eye(3))[1] - low, rtol=1e-12)


def test_the_page_tells_the_run(solid: Path) -> None:
    """Title, highest stress, probe, mass in closed form, the scene; escaped, and without anything to fetch."""
    text, results = page(solid), read_results(solid / "results.h5")
    assert "<h1>An &lt;arm&gt; &amp; its $drive$</h1>" in text
    assert f"<b>{with_prefix(results.peaks['arm'].stress, 'Pa')}</b>" in text
    assert f"{7850 * 0.5 * 0.02**2:.4g} kg" in text  # ρ V
    assert results.warnings == read_results(solid / "results.h5").warnings
    outside = re.sub(r'srcdoc="[^"]*"', "", text)
    links = re.findall(r"""(?:src|href)\s*=\s*["']?([^"'\s>]+)""", outside)
    assert all(each.startswith(("#", "data:")) for each in links)
    assert not re.search(r"https?://(?!www\.w3\.org|purl\.org|creativecommons\.org)", outside)
    assert "In this page" not in text
    said = json.loads(re.search(r"const frames = (\[.*?\]), cursor", text)[1])  # type: ignore[index]
    assert len(said) == 7
    assert said[5].startswith("t = 100 ms, drive angle 57.3°")
    assert "highest stress" in said[6]


@pytest.mark.parametrize("axis", AXES.values(), ids=AXES)
def test_mass_properties_are_those_of_a_box(axis: list[float], tmp_path: Path) -> None:
    """m = ρ a b c, its centre, and J = R diag(…) Rᵀ along x, y, z and oblique."""
    from kedfem.accuracy.prepared import meshed
    from kedfem.results.modelled import link_facts

    e = np.array(axis) / np.linalg.norm(axis)
    link = {
        "material": "steel", "mesh": {"elements": [2, 1, 1]},
        "shape": {"kind": "bar", "between": [[0, 0, 0], list(0.4 * e)], "width": 0.03, "thickness": 0.02},
    }  # fmt: skip
    across = np.cross(e, [0.3, 0.9, -0.2])
    raw = arm(link, cycloidal(1.0, 0.1), analysis=TIMES, output=output())
    raw["joints"] = {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0, 0], "axis": list(across)}}
    ready = meshed(scene_from(raw, tmp_path))
    found = link_facts(ready.scene, ready.linkage, ready.model)["arm"]
    m, (a, b, c) = 7850 * 0.4 * 0.03 * 0.02, (0.4, 0.03, 0.02)
    assert found["mass [kg]"] == pytest.approx(m, rel=1e-9)
    assert_allclose(found["centre of mass [m]"], 0.2 * e, atol=1e-9)
    xx, yy, zz, xy, yz, zx = found["inertia [kg m^2]"]
    J = np.array([[xx, xy, zx], [xy, yy, yz], [zx, yz, zz]])
    own = sorted(m / 12 * np.array([b**2 + c**2, a**2 + c**2, a**2 + b**2]))
    assert_allclose(np.linalg.eigvalsh(J), own, rtol=1e-8)
    assert_allclose(J @ e, own[0] * e, atol=1e-8 * own[2])


def test_the_cursor_is_at_the_drive(solid: Path) -> None:
    """Over the angle of a cycloid, τ − sin 2πτ/2π, in frames a fifth of the run apart."""
    results = read_results(solid / "results.h5")
    tau = np.linspace(0, 1, 6)
    places = tau - np.sin(2 * np.pi * tau) / (2 * np.pi)
    assert_allclose(cursor_places(results, shown(solid).times), places, atol=1e-9)
    every = [curve for group in curve_groups(results).values() for curve in group]
    assert list(curve_groups(results))[:2] == ["Probes", "Drive"]
    for left, right, top, bottom in (curve.box for curve in every if curve.box):
        assert 0 < left < right < 1
        assert 0 < top < bottom < 1


def test_rounding_in_load_tables_is_told_as_such() -> None:
    """As on the terminal: beside 2 kN a force of 1e-8 N is none, a moment is measured by moments."""
    row = {"peak [N]": 2e3, "axial [N]": 1e-8, "moment [N m]": 1e-8}
    (table,) = loads_tables({"A": row}, {})
    assert table.rows == [("A", "2 kN", "≈ 0", "10 nN m")]


def test_notes_of_load_tables_are_about_columns_that_are_there() -> None:
    """Without the links' orientation there are neither bearing loads nor power; their notes stood there all the same."""
    for known in (np.nan, 2e3):
        rows = (
            {"A": {"peak [N]": 2e3, "equivalent, ball bearing [N]": known}},
            {"A": {"mean [N]": 1e3, "mean power [W]": known}},
        )
        told = loads_tables(*rows)
        assert [bool(table.note) for table in told] == [np.isfinite(known)] * 2
        assert [len(table.rows[0]) for table in told] == [3 if np.isfinite(known) else 2] * 2


def test_a_steady_motion_has_its_table() -> None:
    notes: dict[str, str | float] = {
        "steady period [s]": 0.02, "steady revolutions": 1.0, "steady marches": 11.0, "steady residual": 2e-9,
        "steady growth in a period": 1.25, "unknowns": 7.0,
    }  # fmt: skip
    (table,) = steady_table(notes)
    assert [row[1] for row in table.rows] == ["20 ms", "1", "125 %", "2.0e-09", "11"]
    assert [row[0] for row in notes_table(notes).rows] == ["unknowns"]
    notes.pop("steady growth in a period")
    assert steady_table(notes)[0].rows[2][1] == "not determined"
    assert steady_table({"unknowns": 7.0}) == []


def test_a_scene_from_elsewhere_is_refused_if_asked(tmp_path: Path) -> None:
    (tmp_path / "in").mkdir()
    scene = tmp_path / "in" / "scene.toml"
    scene.write_text('include = "../other.toml"', encoding="utf-8")
    with pytest.raises(SceneError, match=r"include: must be within the scene's folder \(--within\)"):
        written_page(scene, None, within=True)
    with pytest.raises(SceneError, match="--within: must be combined with a scene"):
        written_page(tmp_path / "in", None, within=True)


def told(folder: Path) -> str:
    done = write_report(folder)
    assert all(text in page(folder).replace("&#39;", "'") for text in done.warnings)
    return "; ".join(done.warnings)


def test_what_is_missing_is_told(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without animation undeformed; without anything to draw; damaged frames; rows of a run that was stopped; no rows."""
    folder = run(swung(animation=False), tmp_path)
    assert "does not move: the run left no animation" in told(folder)
    for name in ("envelope.vtu", "worst.vtu"):
        (folder / name).unlink()
    assert "not drawn: the run left neither an animation nor highest stresses" in told(folder)
    from kedfem.results import ResultsWriter

    before = read_results(folder / "results.h5")
    channels = [channel for channel, _ in before.channels.values()]
    rows = {name: values[:3] for name, (_, values) in before.channels.items()}
    stopped = ResultsWriter(folder / "results.h5", channels, before.scene_json, None, {})
    with contextlib.suppress(KeyboardInterrupt), stopped as writer:
        writer.append(before.time[:3], before.angle[:3], rows)
        raise KeyboardInterrupt
    assert "known only at the end of a run" in told(folder)
    assert "Not a whole run: interrupted" in page(folder)
    with ResultsWriter(folder / "results.h5", channels, before.scene_json, None, {}):
        pass
    assert "no time step was written" in told(folder)


@pytest.mark.parametrize("part", [0.0, 0.3, 0.7, 0.999])
def test_damaged_frames_are_told_in_words_alone(
    part: float, solid: Path, tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """Cut off, or with other bytes in the middle; the rest of the page is there, VTK says nothing."""
    folder = Path(shutil.copytree(solid, tmp_path / "r"))
    frame = folder / "animation" / "arm_0002.vtu"
    whole = frame.read_bytes()
    cut = int(part * len(whole))
    for content in (whole[:cut], whole[:cut] + b"%&/()" * 20 + whole[cut + 100 :]):
        frame.write_bytes(content)
        done = write_report(folder)
        assert all("arm_0002.vtu: must be a file of kedfem's" in text for text in done.warnings)
        assert done.warnings or len(content) == len(whole)
        assert "Highest stress of each link" in page(folder)
    assert capfd.readouterr() == ("", "")


def test_loads_of_a_scene_that_cannot_be_read_again_are_left_out(solid: Path, tmp_path: Path) -> None:
    import h5py

    from kedfem.results.layout import OF_CHANNELS, seal

    folder = Path(shutil.copytree(solid, tmp_path / "results"))
    with h5py.File(folder / "results.h5", "r+") as file:
        scene = json.loads(file["scene/json"][()])
        del file["scene/json"], file.attrs[OF_CHANNELS]
        file["scene/json"] = json.dumps(scene | {"unknown": 1})
        seal(file)
    assert "loads of joints are left out, as the scene cannot be read again: unknown" in told(folder)
    assert "Highest stress of each link" in page(folder)


def test_rigid_motions_have_a_page_too(tmp_path: Path) -> None:
    done = kinematics(scene_from(beams(), tmp_path), tmp_path / "moved")
    assert told(done.folder) == ""
    found = animated(done.folder, 1.0)
    assert found is not None
    assert {each.name for each in found.surfaces} == {"crank", "coupler", "rocker"}
    assert not any(each.stressed for each in found.surfaces)


@pytest.mark.parametrize("package", ["k3d", "jinja2"])
def test_a_missing_package_is_told_before_the_run(package: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, package, None)
    with pytest.raises(OutputError, match=rf"output.report: needs {package}.*pip install 'kedfem\[report\]'"):
        run(swung(report=True), tmp_path)
    assert not list(tmp_path.iterdir())


@needs_browser
@pytest.mark.long
def test_a_browser_draws_moves_and_prints_it(solid: Path) -> None:
    """Links are drawn, the slider moves them and the cursor, nothing is fetched, no error; on a phone and on paper."""
    with Browser(1280, 800) as browser:
        browser.open(solid / "report.html", "document.body?.dataset.ready === '1'")
        browser.value("document.querySelector('.view').scrollIntoView()")
        slide = "(slider.value = {0}, slider.oninput(), cursorAt())"
        browser.value("window.cursorAt = () => parseFloat(document.querySelector('figure i').style.left)")

        def coloured() -> np.ndarray:
            return np.ptp(browser.pixels()[:500, :1000].astype(int), axis=2) > 60

        first = browser.value(slide.format(0))
        browser.wait(lambda: coloured().sum() > 2000)
        start = coloured()
        last = browser.value(slide.format(5))
        browser.wait(lambda: (coloured() != start).sum() > 2000)
        box = browser.value("Object.assign({}, document.querySelector('figure i').dataset)")
        assert [first, last] == pytest.approx([100 * float(box["left"]), 100 * float(box["right"])])
        browser.value("document.getElementById('highest').click()")
        assert "highest stress" in browser.value("document.getElementById('when').textContent")
        browser.resize(390, 800)
        assert browser.value("document.documentElement.scrollWidth") <= 390
        printed = browser.call("Page.printToPDF")["data"]
        assert len(printed) > 20_000
        kinds = [event["method"] for event in browser.events]
        assert "Runtime.exceptionThrown" not in kinds
        assert "Log.entryAdded" not in kinds
        asked = [
            event["params"]["request"]["url"]
            for event in browser.events
            if event["method"] == "Network.requestWillBeSent"
        ]
        assert all(url.startswith(("file:", "data:", "blob:", "about:")) for url in asked)


FOUR_BAR = """
drive = { joint = "A", motion = { kind = "constant_speed", speed = "600 rpm" } }
analysis = { revolutions = 1, steps_per_revolution = 90, accuracy = "quick" }
output = { plots = false, picture = false, animation = false }
points = { A = [0, 0], B = [0.1, 0], C = [0.35, 0.2], D = [0.4, 0] }

[links.crank]
model = "beam"
material = "steel"
shape = { kind = "bar", between = ["A", "B"], width = 0.02, thickness = 0.01 }

[links.coupler]
model = "beam"
material = "steel"
shape = { kind = "bar", between = ["B", "C"], width = 0.02, thickness = 0.01 }

[links.rocker]
model = "beam"
material = "steel"
shape = { kind = "bar", between = ["C", "D"], width = 0.02, thickness = 0.01 }

[joints]
A = { kind = "revolute", links = ["ground", "crank"], at = "A" }
B = { kind = "revolute", links = ["crank", "coupler"], at = "B" }
C = { kind = "revolute", links = ["coupler", "rocker"], at = "C" }
D = { kind = "revolute", links = ["rocker", "ground"], at = "D" }
"""


@pytest.mark.long
def test_natural_frequencies_are_shown_where_they_are_of_the_same_scene(tmp_path: Path) -> None:
    """Those that are found, with their plots; of another text of the scene a word; damaged ones nothing."""
    path = tmp_path / "scene.toml"
    path.write_text(FOUR_BAR, encoding="utf-8")
    folder = analyse(read_scene(path)).folder
    assert told(folder) == "the mechanism does not move: the run left no animation"
    assert "Natural frequencies" not in page(folder)
    found = frequencies(read_scene(path), Wanted(modes=3, positions=4))
    assert "frequencies" not in told(folder)
    shown = page(folder)
    assert shown.count('alt="Natural frequencies"') == 2
    assert f"Error by the mesh, estimated: {percent(found.errors.max())} at most." in shown
    for end in (found.values.min(axis=0), found.values.max(axis=0)):
        for value in end:
            assert f"<td>{with_prefix(value, 'Hz')}</td>".replace(" ", "\u00a0") in shown
    first = min((x for x in found.crossings if x.mode == 1), key=lambda x: x.harmonic)
    assert f"1: {60 * first.slowest / (2 * np.pi):,.0f}" in shown
    path.write_text(FOUR_BAR.replace("600 rpm", "500 rpm"), encoding="utf-8")
    frequencies(read_scene(path), Wanted(modes=3, positions=4))
    assert "in scene-frequencies are left out, as they are of another text of the scene" in told(folder)
    assert 'alt="Natural frequencies"' not in page(folder)
    for text in ("", "{}", '{"scene": 1}', "[1, 2]", (found.folder / SUMMARY).read_text()[:-9]):
        (found.folder / SUMMARY).write_text(text, encoding="utf-8")
        assert "scene-frequencies" not in told(folder)


@pytest.mark.parametrize(("drives", "told"), [(1, "t = 500 ms, drive travel 20 mm"), (2, "t = 500 ms")])
def test_a_moment_names_the_drives_position_where_there_is_one_drive(drives: int, told: str) -> None:
    """Of several drives results have the position of the first alone."""
    drive = {"joint": "A"}
    scene = {"drive": drive, "drives": {}} if drives == 1 else {"drive": None, "drives": {"A": drive, "B": drive}}
    results = Results(np.zeros(1), np.zeros(1), {}, "complete", "{}", drive=TRAVEL)
    assert instant_in_words(scene, results, 0.5, 0.02) == told


@pytest.mark.parametrize("down", [[0, 0, -9.81], [0, -9.81, 0], [9.81, 0, 0]], ids=["z", "y", "-x"])
def test_the_first_view_is_that_of_the_picture(tmp_path: Path, down: list[float]) -> None:
    """Of a block as thick as high: from not far above, tan⁻¹(0.6 / √1.36) = 27° over the horizon, gravity downwards."""
    vtu = drawn(tmp_path, [warped()]).rename(tmp_path / "worst.vtu")
    gravity = (float(down[0]), float(down[1]), float(down[2]))
    found = animated(tmp_path, 1.0, gravity)
    assert found is not None
    axes = first_view(found, np.ones(3), np.array(gravity))
    picture = view(pyvista.read(vtu), np.array(gravity))
    assert_allclose(axes, [picture.across, picture.up, picture.direction], atol=1e-12)
    up = -np.array(down) / 9.81
    assert np.degrees(np.arcsin(axes[2] @ up)) == pytest.approx(27.2, abs=0.1)
    assert_allclose(axes[0] @ up, 0.0, atol=1e-12)
