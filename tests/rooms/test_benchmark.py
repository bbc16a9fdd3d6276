"""The benchmark of the elements: its parts against beam theory, and how it reads a cost from errors."""

from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from benchmarks.before import by_stage, renamed
from benchmarks.elements import cost
from benchmarks.pages import DOCS, MEASURED, table, write_page
from benchmarks.parts import BAR, FORMS, STEEL, answer
from benchmarks.ports import bench_ports
from numpy.testing import assert_allclose


@pytest.mark.parametrize(("element", "size"), [("hex27", (8, 1, 1)), ("hex20", (8, 1, 1))])
def test_the_bar_bends_and_vibrates_as_a_beam(element: str, size: tuple[int, ...]) -> None:
    found = answer(BAR, element, size, 1)
    L, h = 0.3, 0.02
    EI, GA = STEEL.youngs_modulus * h**4 / 12, STEEL.shear_modulus * h**2
    tip = L**3 / (3 * EI) + L / (5 / 6 * GA)  # unit force, Timoshenko
    assert_allclose(found.values["deflection"], tip, rtol=3e-3)
    assert_allclose(found.values["stress"], L / 2 * h / 2 / (h**4 / 12), rtol=1e-3)
    # free Euler beam: cosh λ cos λ = 1, λ = 4.730; shear and rotary inertia take 1.5 % off, a coarse mesh adds 1 %
    euler = 4.730041**2 / (2 * np.pi * L**2) * np.sqrt(EI / (STEEL.density * h**2))
    assert_allclose(found.values["frequencies"][:2], euler, rtol=0.02)
    assert found.unknowns == {"hex27": 3 * 17 * 9, "hex20": 3 * (9 * 4 + 9 * 4 + 8 * 4)}[element]
    assert set(FORMS) == set(BAR.sizes)


def test_distortion_moves_no_corner_off_the_surface() -> None:
    from dataclasses import replace

    straight = answer(BAR, "hex27", (12, 2, 2), 1)
    moved = answer(replace(BAR, moved=0.25), "hex27", (12, 2, 2), 1)
    errors = moved.errors(straight)
    assert 1e-5 < errors["deflection"] < 1e-3  # another mesh of the same bar


def test_cost_counts_no_error_that_rises_again_and_no_target_that_is_missed() -> None:
    work = [1.0, 10.0, 100.0]
    assert cost(work, [1e-1, 1e-5, 1e-3], 1e-2) == pytest.approx(10**0.5)  # halfway from 1e-1 to 1e-3
    assert cost(work, [1e-3, 1e-3, 1e-3], 1e-2) == 1.0
    assert cost(work, [1e-3, 1e-3, 1e-1], 1e-2) is None


def words(page: str) -> list[str]:
    """What stands outside its tables, without the machine."""
    return [line.partition(MEASURED)[0] for line in page.splitlines() if not line.startswith("|")]


def test_tables_take_the_places_of_former_ones(tmp_path: Path) -> None:
    new = [table(("a", "b"), [(str(k), "2")]) for k in range(3)]
    write_page(tmp_path, "performance/growth", new[:1])
    text, former = ((folder / "growth.md").read_text("utf-8") for folder in (tmp_path, DOCS / "performance"))
    assert words(text) == words(former)
    assert "\n\n| a | b |\n|---|---|\n| 0 | 2 |\n\n" in text
    assert "| factor | " in text  # the second table, for which there is none
    with pytest.raises(ValueError, match="3 tables, got 2"):
        write_page(tmp_path, "performance/growth", new)


def test_stages_of_an_earlier_revision_stand_in_the_same_columns() -> None:
    old = by_stage({"functions": 1.0, "error of the reduction": 2.0, "factor": 4.0, "steps": 8.0})
    new = by_stage({"plan: frames": 1.0, "plan: step": 2.0, "modes": 3.0, "start": 4.0, "steps": 8.0})
    assert (old["modes"], old["steps"], old["plan"]) == (3.0, 12.0, 0.0)
    assert (new["modes"], new["steps"], new["plan"]) == (3.0, 12.0, 3.0)
    with pytest.raises(KeyError, match="lunch"):
        by_stage({"lunch": 1.0})


def test_a_scene_takes_other_words_in_all_its_tables_and_lists() -> None:
    scene = {"links": {"a": {"frames": "nominal"}}, "analysis": {"turns": 2}, "each": [{"turns": "turns"}]}
    found = renamed(scene, {"turns": "revolutions"}, {"nominal": "rigid-body"})
    assert found == {
        "links": {"a": {"frames": "rigid-body"}},
        "analysis": {"revolutions": 2},
        "each": [{"revolutions": "turns"}],
    }


@pytest.mark.long
@pytest.mark.parametrize(
    ("name", "pictures"),
    [
        ("start", []),
        ("accuracy", []),
        ("suite", ["suite.png"]),
        ("reduction", ["reduction.png", "reduction_field.png", "reduction_loop.png"]),
    ],
)
def test_a_benchmark_writes_its_page(name: str, pictures: list[str], tmp_path: Path) -> None:
    benchmark = getattr(import_module(f"benchmarks.{name}"), f"bench_{name}")
    benchmark(tmp_path, True)
    text, former = ((folder / f"{name}.md").read_text("utf-8") for folder in (tmp_path, DOCS / "performance"))
    assert f"`python -m benchmarks.{name}`" in text
    assert text != former
    assert words(text) == words(former)
    for picture in pictures:
        assert f"({picture})" in text
        assert (tmp_path / picture).read_bytes().startswith(b"\x89PNG")


def test_the_study_of_ports_shows_stiffer_and_less_stressed_plates(tmp_path: Path) -> None:
    bench_ports(tmp_path, True)
    text = (tmp_path / "ports.md").read_text("utf-8")
    (row,) = [line for line in text.splitlines() if line.startswith("| 2×1 |")]
    changes = [float(cell.split(": ")[1].split()[0]) for cell in row.split("|")[3:-1]]
    pull, bend, frequency, *stress = changes
    assert max(pull, bend, *stress) < 0 < frequency  # stiffer in every way
