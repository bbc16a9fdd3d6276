"""Output: ParaView reads what was meant, and pictures show something."""

import sys
import xml.etree.ElementTree as ET
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import meshio
import numpy as np
import pytest

from kedfem.dynamics.shapeless import width_across
from kedfem.errors import OutputError
from kedfem.links.recovery import stress_recovery
from kedfem.output.abscissa import abscissa
from kedfem.output.animation import AnimationWriter, read_collection, remove_animation
from kedfem.output.bars import SECTION, THINNEST, bars, heights, shape_functions
from kedfem.output.fields import DISPLACEMENT, LARGEST, SMALLEST, STRESS, VON_MISES, JointField, LinkField
from kedfem.output.frames import link_fields
from kedfem.output.picture import write_picture
from kedfem.output.plots import write_plots
from kedfem.output.plots.drawing import drawn_over, envelope
from kedfem.output.plots.files import shown
from kedfem.output.plots.groups import pictures
from kedfem.output.views import hidden, hiding, labels, sight, view
from kedfem.output.vtu import write_frame
from kedfem.output.words import prefixed
from kedfem.results import Channel, Results
from kedfem.tables.run import largest_of
from tests.moving import ran
from tests.spatial_joints import G, P, Q, pushed

# Parametric coordinates (halves) of the nodes in VTK's order, after its documentation of the triquadratic
# hexahedron: corners, edges of the bottom, of the top, upright edges, faces −x +x −y +y −z +z, centre.
HEX27 = np.array([
    (0, 0, 0), (2, 0, 0), (2, 2, 0), (0, 2, 0), (0, 0, 2), (2, 0, 2), (2, 2, 2), (0, 2, 2),
    (1, 0, 0), (2, 1, 0), (1, 2, 0), (0, 1, 0), (1, 0, 2), (2, 1, 2), (1, 2, 2), (0, 1, 2),
    (0, 0, 1), (2, 0, 1), (2, 2, 1), (0, 2, 1),
    (0, 1, 1), (2, 1, 1), (1, 0, 1), (1, 2, 1), (1, 1, 0), (1, 1, 2), (1, 1, 1),
])  # fmt: skip


def filled(name: str, cell_type: str, cells: np.ndarray, points: np.ndarray) -> LinkField:
    """A link with numbers that show node and component."""
    node = np.arange(len(points), dtype=float)
    stress = 1e6 * (node[:, None] + np.arange(6) / 10)
    principal = 1e6 * np.c_[node - 1, node + 2]
    return LinkField(name, cell_type, cells, points, 1e-3 * (points + 1), stress, 1e6 * (node + 1), principal)


def warped() -> LinkField:
    """One 27-node cell: (x, y, z) = (2r, 3s + r², 4t + 2rs + r²), whose det J is 24 everywhere."""
    r, s, t = HEX27.T / 2
    return filled("warped", "hexahedron27", np.arange(27)[None], np.c_[2 * r, 3 * s + r**2, 4 * t + 2 * r * s + r**2])


def brick() -> LinkField:
    return filled("brick", "hexahedron", np.arange(8)[None], HEX27[:8] / 2 + [0.0, 6.0, 0.0])


def bent() -> LinkField:
    """One 20-node cell of the warped one's form: all its terms are serendipity ones."""
    link = warped()
    return filled("bent", "hexahedron20", link.cells[:, :20], link.points[:20] + np.array([0.0, 12.0, 0.0]))


def arch() -> LinkField:
    x = np.array([0.0, 4.0, 2.0, 8.0, 6.0])
    points = np.c_[x, x * (8 - x) / 8 - 3, 0 * x]
    return filled("arch & co", "line3", np.array([[0, 1, 2], [1, 3, 4]]), points)


def rod() -> LinkField:
    return filled("rod", "line", np.array([[0, 1]]), np.array([[0.0, -4.0, 0.0], [8.0, -4.0, 0.0]]))


def links() -> list[LinkField]:
    return [warped(), brick(), bent(), arch(), rod()]


def drawn(folder: Path, fields: list[LinkField]) -> Path:
    write_frame(folder / "frame.vtu", 0.0, fields)
    return folder / "frame.vtu"


def frame_times(pvd: Path) -> list[tuple[float, str]]:
    return [(float(d.get("timestep", "")), d.get("file", "")) for d in ET.parse(pvd).iter("DataSet")]


def test_meshio_reads_what_was_written(tmp_path: Path) -> None:
    written = links()
    write_frame(tmp_path / "frame.vtu", 0.125, written)
    mesh = meshio.read(tmp_path / "frame.vtu")
    assert mesh.points.dtype == mesh.point_data[STRESS].dtype == np.float32
    np.testing.assert_array_equal(mesh.points, np.float32(np.concatenate([link.points for link in written])))
    for name in (DISPLACEMENT, STRESS, VON_MISES, LARGEST, SMALLEST):
        expected = np.concatenate([link.arrays()[name] for link in written])
        np.testing.assert_array_equal(mesh.point_data[name], np.float32(expected))
    first = 0
    for index, (link, block) in enumerate(zip(written, mesh.cells, strict=True)):
        assert block.type == link.cell_type
        np.testing.assert_array_equal(block.data, link.cells + first)
        np.testing.assert_array_equal(mesh.cell_data["link"][index], index)
        first += len(link.points)
    assert mesh.field_data["TimeValue"] == [0.125]
    assert mesh.field_data["link arch & co"] == [3]


def test_vtk_reads_what_was_written(tmp_path: Path) -> None:
    import pyvista

    written = links()
    write_frame(tmp_path / "frame.vtu", 0.125, written)
    grid = pyvista.read(tmp_path / "frame.vtu")
    assert grid.celltypes.tolist() == [29, 12, 25, 21, 21, 3]  # VTK: hexahedra of 27, 8 and 20 nodes, lines
    stress = np.float32(np.concatenate([link.stress for link in written]))
    np.testing.assert_array_equal(grid.point_data[STRESS], stress)
    np.testing.assert_array_equal(grid.cell_data["link"], [0, 1, 2, 3, 3, 4])
    names = [grid.GetPointData().GetArray(STRESS).GetComponentName(i) for i in range(6)]
    assert names == ["XX", "YY", "ZZ", "XY", "YZ", "XZ"]  # ParaView's names of our xx, yy, zz, xy, yz, zx
    assert grid.field_data["TimeValue"] == [0.125]


@pytest.mark.parametrize("link", [warped(), bent()], ids=["27", "20"])
def test_vtk_takes_quadratic_hexahedra_in_our_order(tmp_path: Path, link: LinkField) -> None:
    """The volume by VTK's own shape functions is the exact one, and so is det J at every Gauss point."""
    import pyvista

    cell = pyvista.read(AnimationWriter(tmp_path, "run").add(0.0, [link])[0]).GetCell(0)
    count = link.cells.shape[1]
    points = np.array([cell.GetPoints().GetPoint(i) for i in range(count)])
    nodes, weights = np.polynomial.legendre.leggauss(3)  # exact for det J, of degree 5 in each coordinate
    volume = 0.0
    for i, j, k in np.ndindex(3, 3, 3):
        gradients = [0.0] * (3 * count)
        cell.InterpolateDerivs((0.5 + nodes[[i, j, k]] / 2).tolist(), gradients)
        det_J = np.linalg.det(np.reshape(gradients, (3, count)) @ points)
        assert det_J == pytest.approx(24.0, rel=1e-12)  # 2 · 3 · 4, see warped()
        volume += det_J * weights[i] * weights[j] * weights[k] / 8
    assert volume == pytest.approx(24.0, rel=1e-12)
    np.testing.assert_allclose(np.reshape(cell.GetParametricCoords(), (count, 3)), HEX27[:count] / 2)


def test_the_list_names_whole_frames_in_order_after_each(tmp_path: Path) -> None:
    animation = AnimationWriter(tmp_path, "run")
    for count, time in enumerate([0.0, 0.1, 0.30000000000000004], start=1):
        animation.add(time, [rod()])
        listed = frame_times(tmp_path / "run.pvd")
        assert len(listed) == count
        assert listed[-1] == (time, f"run/rod_{count - 1:04d}.vtu")
        files = {str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if p.is_file()}
        assert files == {"run.pvd", *(name for _, name in listed)}


def test_vtk_reads_the_list(tmp_path: Path) -> None:
    import pyvista

    animation = AnimationWriter(tmp_path, "run")
    for time in (0.0, 0.5):
        animation.add(time, [rod()])
    reader = pyvista.get_reader(tmp_path / "run.pvd")
    assert reader.time_values == [0.0, 0.5]
    assert reader.read()[0].n_cells == 1


def test_each_link_is_a_block_with_its_name_and_the_drive_is_known(tmp_path: Path) -> None:
    """Names that files cannot have, or that differ in capitals alone, keep files of their own."""
    import pyvista

    named = [replace(rod(), name=name) for name in ("a/b", "a&b", "A_B")]
    joints = JointField(("J", "K"), np.eye(3)[:2], {"force [N]": np.eye(3)[1:]})
    animation = AnimationWriter(tmp_path, "run", "drive angle [rad]")
    for k in range(2):
        animation.add(0.1 * k, [*named, joints], 0.5 * k)
    found = [
        (x.get("timestep"), x.get("part"), x.get("name"), x.get("file"))
        for x in ET.parse(tmp_path / "run.pvd").iter("DataSet")
    ]
    files = ["run/a_b_0001.vtu", "run/a_b1_0001.vtu", "run/A_B2_0001.vtu", "run/joints_0001.vtu"]
    assert found[4:] == [
        ("0.1", str(k), name, file)
        for k, (name, file) in enumerate(zip(["a/b", "a&b", "A_B", "joints"], files, strict=True))
    ]
    for k, path in enumerate(files):
        grid = pyvista.read(tmp_path / path)
        assert grid.field_data["drive angle [rad]"] == [0.5]
        assert set(grid.cell_data["link"]) == {k}
    assert grid.field_data["joint K"] == [1]
    np.testing.assert_array_equal(grid.point_data["force [N]"], np.eye(3)[1:])
    assert read_collection(tmp_path / "run.pvd")[1] == (0.1, [(tmp_path / x).resolve() for x in files])


def test_frames_of_an_earlier_run_go_and_nothing_else(tmp_path: Path) -> None:
    old = AnimationWriter(tmp_path, "run")
    for time in range(3):
        old.add(time, [rod()])
    others = ["run_2/rod_0000.vtu", "run/rod_0001.vtu.bak", "run/mesh.vtu", "run.h5"]
    for name in others:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).touch()
    (tmp_path / "run" / "rod_0003.0123abcd.part.vtu").touch()  # as a killed run leaves

    def files() -> set[str]:
        return {str(p.relative_to(tmp_path)) for p in tmp_path.rglob("*") if p.is_file()}

    new = AnimationWriter(tmp_path, "run")
    assert len(frame_times(tmp_path / "run.pvd")) == 3  # nothing is lost before the first frame
    new.add(7.0, [arch()])
    assert frame_times(tmp_path / "run.pvd") == [(7.0, "run/arch___co_0000.vtu")]
    assert files() == {"run/arch___co_0000.vtu", "run.pvd", *others}
    remove_animation(tmp_path, "run")
    assert files() == set(others)


def test_a_failing_frame_leaves_the_list_as_it_was(tmp_path: Path) -> None:
    animation = AnimationWriter(tmp_path, "run")
    animation.add(0.0, [rod()])
    (tmp_path / "run" / "rod_0001.vtu").mkdir()
    with pytest.raises(OutputError, match=r"rod_0001\.vtu: must be a file that can be written, got Is a directory"):
        animation.add(1.0, [rod()])
    assert frame_times(tmp_path / "run.pvd") == [(0.0, "run/rod_0000.vtu")]
    with pytest.raises(OutputError, match=r"free of the frames of an earlier run, got rod_0001\.vtu that cannot be"):
        remove_animation(tmp_path, "run")


def test_a_list_that_cannot_grow_stays_as_it_was(tmp_path: Path) -> None:
    import resource

    animation = AnimationWriter(tmp_path, "run")
    while not (listed := tmp_path / "run.pvd").is_file() or listed.stat().st_size < 6000:
        animation.add(float(animation.count), [rod()])
    before, limits = listed.read_bytes(), resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (len(before) + 20, limits[1]))  # holds a frame, not the whole row
    try:
        with pytest.raises(OutputError, match=r"run\.pvd: must be a file that can be written"):
            animation.add(1e3, [rod()])
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert listed.read_bytes() == before


def test_a_list_that_others_changed_is_written_anew(tmp_path: Path) -> None:
    animation = AnimationWriter(tmp_path, "run")
    for time in range(3):
        animation.add(time, [rod()])
    (tmp_path / "run.pvd").write_text("")
    animation.add(3.0, [rod()])
    assert [time for time, _ in frame_times(tmp_path / "run.pvd")] == [0.0, 1.0, 2.0, 3.0]
    (tmp_path / "run.pvd").unlink()
    animation.add(4.0, [rod()])
    assert len(frame_times(tmp_path / "run.pvd")) == 5


@pytest.mark.parametrize("kind", ["animation", "plots", "picture"])
def test_a_file_in_the_way_of_the_folder(tmp_path: Path, kind: str) -> None:
    (vtu,) = AnimationWriter(tmp_path, "run").add(0.0, [rod()])
    (tmp_path / "taken").touch()
    folder = tmp_path / "taken"
    writers = {
        "animation": lambda: AnimationWriter(folder, "run").add(0.0, [rod()]),
        "plots": lambda: write_plots(results(), folder),
        "picture": lambda: write_picture(vtu, folder / "picture.png", ""),
    }
    with pytest.raises(OutputError, match=r"^output\.folder: must be a writable folder, got .*taken"):
        writers[kind]()


def results(n: int = 721, revolutions: float = 2.0) -> Results:
    """Made-up curves of a four-bar."""
    angle = np.linspace(0, 2 * np.pi * revolutions, n)
    wave = np.sin(angle) + 0.2 * np.sin(23 * angle)
    columns = ("xx", "yy", "zz", "xy", "yz", "zx", "von_mises")
    stress = np.c_[4e7 * wave, 1e6 * wave, 0 * wave, 2e6 * wave, 0 * wave, 0 * wave, 4e7 * abs(wave)]
    channels = [(Channel("probes/mid/stress", columns, "Pa", "link", r"costs $\frac, not $6"), stress)]
    for joint in "AB":
        name = f"joints/{joint}/force"
        force = np.c_[200 * wave, 100 * wave, 0 * wave]
        channels.append((Channel(name, ("x", "y", "z"), "N", "world", f"force at {joint}"), force))
    torque = Channel("drive/torque", ("torque",), "N m", "", "drive torque")
    channels.append((torque, 12 * wave[:, None]))
    return Results(angle / 60, angle, {c.name: (c, values) for c, values in channels}, "complete", "{}")


def pixels(path: Path) -> np.ndarray:
    from PIL import Image

    with Image.open(path) as image:
        return np.asarray(image.convert("RGB"), float)


def assert_shows_something(path: Path) -> None:
    """White paper with ink on it, but with none at the rim, where it would be cut off."""
    picture = pixels(path)
    ink = picture.min(axis=2) < 250
    assert 0.002 < ink.mean() < 0.6
    assert picture.std() > 5
    for rim in (ink[0], ink[-1], ink[:, 0], ink[:, -1]):
        assert not rim.any()


def test_every_channel_has_a_plot(tmp_path: Path) -> None:
    page, *written = write_plots(results(), tmp_path / "plots", each=True)
    assert_shows_something(page)
    assert page.name == "overview.png"
    assert [path.name for path in written] == [
        "probes-mid-stress.png",
        "joint_forces.png",
        "joints-A-force.png",
        "joints-B-force.png",
        "drive-torque.png",
    ]
    for path in written:
        assert pixels(path).shape == (744, 1320, 3)  # 11 by 6.2 inches at 120 dots
        assert_shows_something(path)


@pytest.mark.parametrize(
    "made",
    [
        results(n=100_000, revolutions=30),
        results(n=1),
        replace(results(), angle=np.sin(results().angle)),
        replace(results(), angle=np.zeros(721)),
        replace(results(), angle=-results().angle, status="interrupted"),
    ],
    ids=["long", "one row", "to and fro", "standing", "backwards"],
)
def test_unusual_runs_are_plotted(tmp_path: Path, made: Results) -> None:
    few = {name: made.channels[name] for name in ("probes/mid/stress", "joints/A/force")}
    for path in write_plots(replace(made, channels=few), tmp_path, each=True):
        assert_shows_something(path)


def test_many_curves_go_onto_several_pages(tmp_path: Path) -> None:
    """Thirty probes on three pages; of twelve joints' forces the nine largest are in one panel, and none on its own."""
    made, force = results(), Channel("joints/A/force", ("x", "y", "z"), "N", "world", "force")
    t = made.time[:, None] * np.ones(3)
    probes = {f"probes/{k}/stress": made.channels["probes/mid/stress"] for k in range(30)}
    joints = {f"joints/{k}/force": (replace(force, name=f"joints/{k}/force"), (k + 1.0) * t) for k in range(12)}
    written = write_plots(replace(made, channels=probes | joints), tmp_path)
    assert [path.name for path in written] == ["overview.png", "overview-2.png", "overview-3.png"]
    for path in written:
        assert_shows_something(path)
    pages = {x.name: x for x in pictures(replace(made, channels=probes | joints))}
    title, panel = shown(pages["joint_forces"])
    assert title.endswith("the largest 9 of 12")
    assert list(panel.curves) == [str(k) for k in range(3, 12)]


def test_results_that_are_not_finite_are_plotted(tmp_path: Path) -> None:
    made = results()
    values = made.channels["drive/torque"][1].copy()
    values[400:] = np.nan
    values[399] = np.inf
    one = {"drive/torque": (made.channels["drive/torque"][0], values)}
    for path in write_plots(replace(made, channels=one), tmp_path, each=True):
        assert_shows_something(path)


def test_stale_plots_go_and_a_users_pictures_stay(tmp_path: Path) -> None:
    from PIL import Image

    write_plots(results(), tmp_path, each=True)
    Image.new("RGB", (4, 4)).save(tmp_path / "photo.png")
    (tmp_path / "broken.png").write_bytes(b"no picture")
    few = {"drive/torque": results().channels["drive/torque"]}
    write_plots(replace(results(), channels=few), tmp_path)
    assert {p.name for p in tmp_path.iterdir()} == {"photo.png", "broken.png", "overview.png"}


def test_results_without_rows_have_no_plots(tmp_path: Path) -> None:
    none = Results(np.zeros(0), np.zeros(0), {}, "interrupted", "{}")
    assert write_plots(none, tmp_path) == []


def test_a_shortened_curve_keeps_its_extremes() -> None:
    rng = np.random.default_rng(3)
    values = rng.normal(size=100_003)
    kept = envelope(values, 1000)
    assert len(kept) <= 2002
    assert (np.diff(kept) > 0).all()
    assert (kept[0], kept[-1]) == (0, 100_002)
    assert {values.argmin(), values.argmax()} <= set(kept.tolist())


def test_what_curves_are_drawn_over() -> None:
    time = np.linspace(0, 1, 101)
    turning = abscissa(time, 2 * np.pi * time)
    assert turning.degrees is None
    assert turning.values[-1] == pytest.approx(360.0)
    ramp = abscissa(time, time / 2 - np.sin(np.pi * time) / (2 * np.pi))  # from rest, but it keeps on
    assert ramp.degrees is None
    for angle in (np.sin(6 * time), np.sin(2 * np.pi * time), np.minimum(time, 0.5)):
        assert abscissa(time, angle).over_time
        assert abscissa(time, angle).degrees is not None
    nothing_driven = abscissa(time, 0 * time)
    assert nothing_driven.over_time
    assert nothing_driven.degrees is None


@pytest.mark.parametrize("names", [["drive/force"], ["drive/rigid_force"], ["drive/A/torque", "drive/B/torque"]])
def test_curves_of_slides_and_of_several_drives_are_over_time(names: list[str]) -> None:
    time = np.linspace(0, 1, 11)
    channels = {name: (Channel(name, ("x",), "N", "", ""), np.ones((11, 1))) for name in names}
    along = drawn_over(Results(time, time, channels, "complete", "{}"))
    assert along.over_time
    assert along.degrees is None
    torque = {"drive/torque": next(iter(channels.values()))}
    assert not drawn_over(Results(time, time, torque, "complete", "{}")).over_time


@pytest.mark.parametrize(
    ("peak", "unit", "expected"),
    [
        (4.2e7, "Pa", (1e6, "MPa")),
        (999.0, "N", (1.0, "N")),
        (1000.0, "N", (1e3, "kN")),
        (3e-5, "m", (1e-6, "µm")),
        (2e4, "N*m", (1e3, "kN m")),
        (5e4, "m/s^2", (1.0, "m/s²")),
        (0.01, "rad", (1.0, "rad")),
        (np.inf, "Pa", (1.0, "Pa")),
    ],
)
def test_prefixes(peak: float, unit: str, expected: tuple[float, str]) -> None:
    divisor, label = prefixed(peak, unit)
    assert divisor == pytest.approx(expected[0])
    assert label == expected[1]


def test_a_picture_of_all_kinds_of_links(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    vtu = drawn(tmp_path, links())
    title = "Worst frame: σ = 27 MPa at 60°, " + "with a title that is much longer than the picture is wide " * 5
    write_picture(vtu, tmp_path / "picture.png", title)
    assert_shows_something(tmp_path / "picture.png")
    colours = pixels(tmp_path / "picture.png")
    assert (np.ptp(colours, axis=2) > 60).mean() > 0.01  # stresses are coloured
    assert capfd.readouterr() == ("", "")  # VTK keeps off the terminal
    assert {p.name for p in tmp_path.iterdir()} == {"frame.vtu", "picture.png"}


def test_the_colour_bar_is_that_of_the_links(tmp_path: Path) -> None:
    vtu = drawn(tmp_path, [warped()])  # its edges are drawn last, without colours
    write_picture(vtu, tmp_path / "picture.png", "one link")
    bar = pixels(tmp_path / "picture.png")[:, -200:].reshape(-1, 3)  # right of the links
    for end in ((48, 18, 59), (122, 4, 3)):  # of the colour map "turbo" (Mikhailov 2019)
        assert (np.abs(bar - end).max(axis=1) < 12).sum() > 50


def test_a_picture_without_stress_is_drawn(tmp_path: Path) -> None:
    vtu = drawn(tmp_path, [replace(rod(), von_mises=np.zeros(2))])
    write_picture(vtu, tmp_path / "picture.png", "unloaded")
    assert_shows_something(tmp_path / "picture.png")


@pytest.mark.parametrize(
    ("extents", "normal"),
    [((3, 2, 0.1), 2), ((3, 0.1, 2), 1), ((0.1, 3, 2), 0), ((3, 0.1, 0.1), 2), ((0.1, 3, 0.1), 2), ((0.1, 0.1, 3), 1)],
)
def test_flat_linkages_are_seen_from_their_flat_side(extents: tuple[float, ...], normal: int) -> None:
    direction, up = sight(np.array(extents, float), np.zeros(3))
    assert np.argmax(np.abs(direction)) == normal
    assert np.linalg.norm(direction) == pytest.approx(1.0)
    assert extents[np.argmax(up)] >= min(extents)
    across = np.cross(up, direction)
    assert np.count_nonzero(np.abs(across) > 1e-12) == 1  # one axis lies level in the picture


def test_curved_beams_pass_through_their_nodes() -> None:
    for nodes, places in ((2, [-1.0, 1.0]), (3, [-1.0, 1.0, 0.0])):
        np.testing.assert_allclose(shape_functions(nodes, np.array(places)), np.eye(nodes), atol=1e-15)


def drawn_beam(field: LinkField) -> Any:
    """The surface of one link of lines."""
    import pyvista

    kinds = {"line": 3, "line3": 21}
    cells = np.c_[np.full(len(field.cells), field.cells.shape[1]), field.cells]
    grid = pyvista.UnstructuredGrid(
        cells.ravel(), np.full(len(cells), kinds[field.cell_type]), field.points.astype(float)
    )
    grid.point_data["MPa"] = field.von_mises / 1e6
    grid.cell_data["link"] = np.zeros(len(cells), int)
    if field.section:
        grid.cell_data[SECTION] = np.tile(np.array(field.section, float), (len(cells), 1))
    return bars(grid, heights(grid))


@pytest.mark.parametrize(("round_", "area"), [(False, 0.1), (True, 12 * np.sin(np.pi / 12) / np.pi * 0.1 * np.pi / 4)])
def test_beams_are_drawn_with_their_sections(round_: bool, area: float) -> None:
    """A rod and an arch of two elements: closed, section times length, height across it and thickness along z."""
    straight = drawn_beam(replace(rod(), section=(0.5, 0.2, round_)))
    np.testing.assert_allclose(np.ptp(straight.points, axis=0), [8.0, 0.5, 0.2], rtol=1e-6)
    length = np.sqrt(2) * 2 + np.arcsinh(1) * 2  # of y = x (8 − x)/8 from 0 to 8
    for surface, wanted in ((straight, 8.0), (drawn_beam(replace(arch(), section=(0.5, 0.2, round_))), 2 * length)):
        assert surface.n_open_edges == 0
        assert surface.triangulate().volume == pytest.approx(area * wanted, rel=2e-3)


def test_beams_too_thin_to_be_seen_are_drawn_thicker() -> None:
    surface = drawn_beam(replace(rod(), section=(1e-6, 0.2, False)))
    np.testing.assert_allclose(np.ptp(surface.points[:, 1]), THINNEST * 8.0, rtol=1e-6)


@pytest.mark.parametrize("deformation_scale", [1.0, 500.0])
def test_a_slider_without_a_shape_is_a_block_about_its_pin_along_its_guide(deformation_scale: float) -> None:
    """Grey, and where the end of the rod that carries it is drawn."""
    ready, blocks = ran(pushed(driven=False))
    recoveries = [stress_recovery(link) for link in ready.model.links]
    k, rod = next((k, link) for k, link in enumerate(ready.model.links) if link.name == "rod")
    now = blocks[-1].at(len(blocks[-1]) - 1)
    fields = {field.name: field for field in link_fields(ready.model, recoveries, now, deformation_scale)}
    block, end = fields["ram"], fields[rod.name].points
    section = np.linalg.norm(recoveries[k].at_points(rod.X) - P, axis=1) < 0.011  # about the pin
    np.testing.assert_allclose(block.points.mean(axis=0), end[section].mean(axis=0), atol=1e-9)
    assert np.isnan(block.von_mises).all()
    along = np.ptp(block.points, axis=0)
    np.testing.assert_allclose(along, 0.8 * 0.02 * np.array([1.0, 1.0, 1.5]))  # of the rod's section


@pytest.mark.parametrize("turn", [0.0, 0.6])
def test_a_slider_on_a_solid_is_as_wide_as_that_is_across_its_length(turn: float) -> None:
    """However the link lies in the reference position."""
    c, s = np.cos(turn), np.sin(turn)
    sizes = HEX27 / 2 * [0.2, 0.03, 0.01] @ np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])
    assert width_across(SimpleNamespace(full=None, section=None, X=sizes)) == pytest.approx(0.03)  # type: ignore[arg-type]


@pytest.mark.parametrize("mass", [2.0, 1e-6, 1e6])
def test_masses_that_links_carry_are_balls_where_their_links_take_them(mass: float) -> None:
    """As large as balls of steel, r³ = 3 m / 4πρ, but from 1 % to 3 % of all that is drawn; at the tip as it is bent."""
    raw = pushed(driven=False)
    tool = {"kind": "point_mass", "link": "rocker", "at": list(Q), "mass": mass}
    wheel = {"kind": "flywheel", "link": "rocker", "at": list(G), "inertia": 0.01}
    raw["bodies"] = {"tool": tool, "far": {**tool, "at": list(G)}, "wheel": wheel}
    ready, blocks = ran(raw)
    recoveries = [stress_recovery(link) for link in ready.model.links]
    now = blocks[-1].at(len(blocks[-1]) - 1)
    scene = ready.scene
    every = link_fields(ready.model, recoveries, now, 100.0, scene)
    told = [(x, f"{x}, {mass:.4g} kg") for x in ("tool", "far")]
    assert [(x.name, x.label) for x in every[-3:]] == [*told, ("wheel", "wheel, 0.01 kg m²")]
    links = [x for x in every if not x.label]
    size = np.linalg.norm(np.ptp(np.concatenate([x.points for x in links[:2]]), axis=0))
    rocker = next(x for x in links if x.name == "rocker").points
    radius = np.clip(np.cbrt(3 * mass / (4 * np.pi * 7850.0)), 0.01 * size, 0.03 * size)
    for ball in every[-3:-1]:
        np.testing.assert_allclose(np.linalg.norm(ball.points[:26] - ball.points[26], axis=1), radius)
        assert np.linalg.norm(rocker - ball.points[26], axis=1).min() < 0.011  # of the section's corners


def test_a_ball_is_drawn_with_its_name_and_hides_no_stress(tmp_path: Path) -> None:
    import pyvista

    link = filled("brick", "hexahedron", np.arange(8)[None], HEX27[:8] / 2)
    none = np.full((27, 6), np.nan)
    sphere = HEX27 - 1.0
    sphere = 0.5 * sphere / np.maximum(np.linalg.norm(sphere, axis=1, keepdims=True), 1.0)
    ball = LinkField(
        "load", "hexahedron27", np.arange(27)[None], sphere + link.points[7] + [0, 0, 0.6], 0 * sphere, none,
        none[:, 0], none[:, :2], label="load, 3 kg",
    )  # fmt: skip
    vtu = drawn(tmp_path, [link, ball])
    grid = pyvista.read(vtu)
    assert labels(grid) == {1: "load, 3 kg"}
    assert not hidden(grid, np.array([0.0, 0, 1]))
    assert hidden(pyvista.read(drawn(tmp_path, [link, replace(ball, label="")])), np.array([0.0, 0, 1]))
    write_picture(vtu, tmp_path / "with.png", "a load")
    assert_shows_something(tmp_path / "with.png")
    red, green, blue = pixels(tmp_path / "with.png").reshape(-1, 3).T
    assert ((blue > red + 40) & (green < blue) & (green > red)).sum() > 1000  # steel blue


def test_the_highest_stress_is_cut_free_where_no_side_shows_it(tmp_path: Path) -> None:
    """Inside a cell: in the cut the end of the colour map is seen; at a corner below, the picture is drawn from there."""
    import pyvista

    inside = replace(warped(), von_mises=np.where(np.arange(27) == 26, 1e6, 1e5))
    below = replace(warped(), von_mises=np.where(np.arange(27) == 0, 1e6, 1e5))
    found = []
    for link in (inside, below):
        vtu = drawn(tmp_path, [link])
        found.append(view(pyvista.read(vtu), np.zeros(3)))
        write_picture(vtu, tmp_path / "picture.png", "one link")
        red, green, blue = pixels(tmp_path / "picture.png")[:, :-260].reshape(-1, 3).T.astype(int)
        assert ((red > green + 60) & (red > blue + 60)).sum() > 100  # nothing else is above the blue tenth
    np.testing.assert_allclose(found[0].cut, inside.points[26])
    assert found[1].cut is None


def test_links_that_hide_nothing_stay_whole_beside_a_cut(tmp_path: Path) -> None:
    """A slider beside the highest stress, and nearer to the eye than that, was as faint as what hides it."""
    import pyvista

    inside = replace(warped(), von_mises=np.where(np.arange(27) == 26, 1e6, 1e5))
    none = np.full_like(inside.von_mises, np.nan)
    beside = replace(inside, name="slider", points=inside.points + np.array([3.0, 0, 1.0]), von_mises=none)
    vtu = drawn(tmp_path, [inside, beside])
    grid = pyvista.read(vtu)
    shown = view(grid, np.zeros(3))
    assert shown.cut is not None
    assert hiding(grid, shown.direction) == {0}
    write_picture(vtu, tmp_path / "picture.png", "two links")
    red, green, blue = pixels(tmp_path / "picture.png")[:, :-260].reshape(-1, 3).T.astype(int)
    grey = (np.abs(red - green) < 12) & (np.abs(green - blue) < 12)
    assert (grey & (red > 120) & (red < 215)).sum() > 5000


def test_a_missing_frame(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match=r"run_0000\.vtu: must be a frame of the animation, got no such file"):
        write_picture(tmp_path / "run_0000.vtu", tmp_path / "picture.png", "")


def test_a_corrupt_frame(tmp_path: Path) -> None:
    (tmp_path / "run_0000.vtu").write_text("no XML")
    with pytest.raises(OutputError, match=r"run_0000\.vtu: must be a frame that VTK can draw, got \w+Error"):
        write_picture(tmp_path / "run_0000.vtu", tmp_path / "picture.png", "")
    assert not (tmp_path / "picture.png").exists()


@pytest.mark.skipif(sys.platform == "win32", reason="a shell script stands for the crash")
def test_a_machine_where_vtk_crashes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (vtu,) = AnimationWriter(tmp_path, "run").add(0.0, [rod()])
    crash = tmp_path / "crash"
    crash.write_text("#!/bin/sh\nkill -SEGV $$\n")
    crash.chmod(0o700)
    monkeypatch.setattr(sys, "executable", str(crash))
    with pytest.raises(OutputError, match=r"^picture: must be drawn by VTK, .*libEGL.*, got no window \(signal 11\)"):
        write_picture(vtu, tmp_path / "picture.png", "")
    assert not (tmp_path / "picture.png").exists()


def test_what_the_table_calls_nothing_is_not_drawn(tmp_path: Path) -> None:
    """1.5 nN m beside 64 N m; alone it is all that there is, and is drawn."""
    large, small = (Channel(f"joints/{x}/moment", ("z",), "N m", "world", "moment") for x in "AB")
    time = np.linspace(0.0, 1.0, 5)
    kept = {"joints/B/moment": (small, np.full((5, 1), 1.5e-9))}
    both = {"joints/A/moment": (large, np.full((5, 1), 64.0)), **kept}
    for channels, names in ((both, ["joints-A-moment.png"]), (kept, ["joints-B-moment.png"])):
        results = Results(time, time, channels, "complete", "{}")
        assert [path.name for path in write_plots(results, tmp_path, each=True)] == ["overview.png", *names]


def test_gravity_points_down_the_page_unless_it_is_looked_along() -> None:
    grid = SimpleNamespace(
        points=np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0.05]]), length=1.4, celltypes=np.array([3]),
        point_data={VON_MISES: np.zeros(3)}, extract_cells=lambda kept: SimpleNamespace(n_cells=0),
        cell_data={}, field_data={},
    )  # fmt: skip
    for gravity, up in (((0, 0, 0), (0, 1, 0)), ((-9.8, 0, 0), (1, 0, 0)), ((0, 0, -9.8), (0, 1, 0))):
        assert view(grid, np.array(gravity, float)).up @ up > 0.9


def test_the_largest_of_a_vector_is_its_magnitude_where_that_tells_more() -> None:
    """A bearing force of 3 and 4 kN is one of 5 kN, at the row where it is; a travel is told by its component."""
    values = np.array([[0.0, 4.5e3, 0.0], [3e3, -4e3, 0.0]])
    force = Channel("joints/B/force", ("x", "y", "z"), "N", "world", "")
    assert largest_of(force, values) == (1, "magnitude", 5e3)
    assert largest_of(force, values[:1]) == (0, "y", 4.5e3)
    assert largest_of(replace(force, name="probes/tip/travel"), values) == (0, "y", 4.5e3)
    assert largest_of(replace(force, columns=("strain", "x", "y")), values) == (0, "x", 4.5e3)
