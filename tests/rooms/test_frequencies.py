"""`kedfem frequencies`: positions, speeds of crossings, files, refusals."""

from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from rich.console import Console

from kedfem.errors import SceneError
from kedfem.export import state_space
from kedfem.frequencies import Campbell, Wanted, crossed, frequencies
from kedfem.scene import scene_from
from kedfem.tables import frequencies_tables
from tests.rooms.test_resolution import FIRST, arm


def test_an_arm_has_the_same_frequencies_all_around_and_its_critical_speeds(tmp_path: Path) -> None:
    scene = scene_from(arm("beam"), tmp_path)
    found = frequencies(scene, Wanted(modes=2, positions=4, harmonics=3), tmp_path / "out")
    assert found.values.shape == (4, 2)
    assert_allclose(found.values[:, 0], FIRST, rtol=2e-3)  # a cantilever, drive held
    assert_allclose(np.ptp(found.values, axis=0) / found.values[0], 0.0, atol=1e-8)
    assert_allclose(found.angle, np.pi / 2 * np.arange(4), atol=1e-9)
    third = next(x for x in found.crossings if (x.mode, x.harmonic) == (1, 3))
    assert_allclose([third.slowest, third.fastest], 2 * np.pi * found.values[0, 0] / 3, rtol=1e-8)
    table = np.loadtxt(tmp_path / "out" / "frequencies.csv", delimiter=",", skiprows=1)
    assert_allclose(table, np.column_stack([found.time, found.angle, found.values]), rtol=5e-9)  # nine digits
    assert {x.name for x in (tmp_path / "out").iterdir()} == {
        "frequencies.csv", "frequencies.json", "frequencies.png", "campbell.png"
    }  # fmt: skip
    assert [table.row_count for table in frequencies_tables(scene, found)] == [4, 2]
    one = frequencies(scene, Wanted(2, 1), tmp_path / "one")
    assert found.factorisations == one.factorisations  # links are factored once for all positions


def test_tables_fit_into_a_terminal_with_all_their_numbers(tmp_path: Path) -> None:
    scene = scene_from(arm("beam"), tmp_path)
    found = frequencies(scene, Wanted(modes=12, positions=2, harmonics=9), tmp_path / "out")
    screen = Console(width=80, file=StringIO())
    screen.print(*frequencies_tables(scene, found))
    assert isinstance(screen.file, StringIO)
    said = screen.file.getvalue()
    assert "…" not in said
    numbers = {f"{x:.4g}" for x in found.values[0]}
    ranges = [(60 * x.slowest / (2 * np.pi), 60 * x.fastest / (2 * np.pi)) for x in found.crossings]
    assert all(word in said.split() for word in [*numbers, *(f"{a:.0f}–{b:.0f}" for a, b in ranges)])


def test_a_free_drive_leaves_one_motion_without_strain(tmp_path: Path) -> None:
    found = frequencies(scene_from(arm("beam"), tmp_path), Wanted(2, 2, free=True), tmp_path / "out")
    assert found.still == 1


def test_crossings_are_from_the_least_frequency_of_a_mode_to_its_most() -> None:
    over = Campbell(np.zeros(1), np.array([[[10.0], [16.0]]]), varies=False)
    (first, second) = crossed(over, 2)
    assert_allclose([first.slowest, first.fastest], [20 * np.pi, 32 * np.pi])
    assert_allclose([second.slowest, second.fastest], [10 * np.pi, 16 * np.pi])


def test_crossings_are_where_frequencies_that_go_with_the_speed_are() -> None:
    """f² = 25 + a (Ω/2π)² at two positions, a = 0.5 and 2: harmonic k meets it at 5 Hz / √(k² − a)."""
    speeds = 2 * np.pi * np.array([0.0, 2.0, 6.0])
    f = np.sqrt(25 + np.outer((speeds / 2 / np.pi) ** 2, [0.5, 2.0]))
    (second,) = crossed(Campbell(speeds, f[:, :, None], varies=True), 2)  # the first is met beyond, or never
    assert_allclose([second.slowest, second.fastest], 10 * np.pi / np.sqrt([3.5, 2.0]), rtol=1e-12)


@pytest.mark.parametrize(
    ("change", "wanted", "said"),
    [
        ({}, Wanted(modes=0), "--modes: must be at least 1, got 0"),
        ({}, Wanted(positions=0), "--positions: must be at least 1"),
    ],
)
def test_what_cannot_be_is_refused(change: dict[str, Any], wanted: Wanted, said: str, tmp_path: Path) -> None:
    scene = scene_from(arm("beam", **change), tmp_path)
    with pytest.raises(SceneError, match=said):
        frequencies(scene, wanted, tmp_path / "out")


def test_a_free_drive_is_refused_where_there_is_none(tmp_path: Path) -> None:
    raw = arm("beam")
    del raw["drive"]
    raw["analysis"] = {"end_time": 0.1, "step": 1e-3}
    scene = scene_from(raw, tmp_path)
    with pytest.raises(SceneError, match="--free: must be combined with a drive"):
        frequencies(scene, Wanted(free=True), tmp_path / "out")
    found = frequencies(scene, Wanted(2), tmp_path / "out")
    assert (len(found.time), found.still, found.crossings) == (1, 1, ())


ANALYSES = (
    ({"revolutions": 1, "steps_per_revolution": 180}, "time"), ({"end_time": 1.0, "step": 0.01}, "angle"),
    ({"kind": "steady"}, "angle"), ({"kind": "quasi-static"}, "time"), ({"kind": "static", "revolutions": 2}, "angle"),
)  # fmt: skip


@pytest.mark.parametrize(("times", "over"), ANALYSES, ids=str)
def test_a_released_drive_moves_a_slider_that_is_a_mass_alone(times: dict[str, Any], over: str, tmp_path: Path) -> None:
    """It was an internal error where the drive tells the end. With the crank across the slide the rod does not rotate:
    J = m (r²/3 + w²/12) of the crank + (rod + slider) r²."""
    r, section = 0.05, {"width": 0.01, "thickness": 0.012}
    beam = {"model": "beam", "material": "steel", "mesh": {"elements": 2}}
    crank, rod = ({"kind": "bar", "between": x, **section} for x in ([[0, 0], [0, r]], [[0, r], [0.2, 0]]))
    factor = {"over": over, "at": [0, 1.0, 2.0], "value": [0, 1, 0], "period": 2.0 if over == "time" else 2 * np.pi}
    hinges = {"A": ("ground", "crank", [0, 0]), "B": ("crank", "rod", [0, r]), "C": ("rod", "slider", [0.2, 0])}
    raw = {
        "links": {
            "crank": {**beam, "shape": crank}, "rod": {**beam, "shape": rod}, "slider": {"model": "rigid", "mass": 0.8},
        },
        "joints": {
            **{name: {"kind": "revolute", "links": [a, b], "at": x} for name, (a, b, x) in hinges.items()},
            "G": {"kind": "prismatic", "links": ["ground", "slider"], "at": [0.2, 0], "axis": "x"},
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": "60 rpm"}},
        "loads": {"F": {"kind": "force", "link": "slider", "at": [0.2, 0], "vector": [1, 0], "factor": factor}},
        "damping": {"beta": 1e-5}, "analysis": {"accuracy": "quick", **times},
    }  # fmt: skip
    found = frequencies(scene_from(raw, tmp_path), Wanted(2, 2, free=True), tmp_path / "out")
    assert found.still == 1
    space, _ = state_space(scene_from(raw, tmp_path), 2, free=True)
    assert space.frequencies[1:] == pytest.approx(found.values[0], rel=1e-6)
    mass, w = 7850 * 0.01 * 0.012, 0.01
    inertia = mass * r * (r**2 / 3 + w**2 / 12) + (mass * float(np.hypot(0.2, r)) + 0.8) * r**2
    speed, torque, rate = space.outputs.index("drive/speed"), space.inputs.index("drive/torque"), len(space.frequencies)
    assert space.C[speed, rate] * space.B[rate, torque] == pytest.approx(1 / inertia, rel=1e-5)


@pytest.mark.parametrize("axis", [[1.0, 0, 0], [0, 1.0, 0], [0, 0, 1.0], [0.48, 0.6, 0.64]])
def test_a_released_shaft_whose_hub_is_hinged_at_its_end_face_turns_freely(axis: list[float], tmp_path: Path) -> None:
    """A cantilever on a rigid hub of next to no mass, along the axis: held by the drive, and free to rotate about itself,
    where bending stays and torsion is that of a bar with a free end."""
    d = np.array(axis)
    section = {"kind": "rectangle", "width": 0.02, "thickness": 0.02}
    up = np.roll(d, 1) - d * (d @ np.roll(d, 1))
    shape = {"kind": "polyline", "points": [[0, 0, 0], (0.4 * d).tolist()], "section": section, "up": up.tolist()}
    hub = {
        "kind": "bar",
        "between": [(-0.02 * d).tolist(), [0, 0, 0]],
        "width": 0.02,
        "thickness": 0.02,
        "up": up.tolist(),
    }
    raw = {
        "links": {
            "hub": {"model": "rigid", "material": "steel", "shape": hub},
            "shaft": {"model": "beam", "material": "steel", "shape": shape, "mesh": {"elements": 4}},
        },
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "hub"], "at": (-0.02 * d).tolist(), "axis": axis},
            "W": {"kind": "weld", "links": ["hub", "shaft"], "at": [0, 0, 0]},
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": "60 rpm"}},
        "analysis": {"revolutions": 1, "steps_per_revolution": 180},
    }  # fmt: skip
    held, free = (
        frequencies(scene_from(raw, tmp_path), Wanted(2, 2, free=each), tmp_path / f"{each}") for each in (False, True)
    )
    assert (held.still, free.still) == (0, 1)
    assert_allclose(free.values[:, :2], held.values[:, :2], rtol=1e-5)  # bending, both ways
