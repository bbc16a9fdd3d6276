"""Plain sizes: silent where units are right, and each usual mistake is reported with the unit that was meant."""

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.sizes import size_warnings, sizes
from kedfem.errors import MeshError
from kedfem.kinematics import rigid_links
from kedfem.marching import begun_march
from kedfem.scene import Cad, Scene, read_scene, scene_from
from kedfem.scene.records.units import si_number
from kedfem.tables import size_line

ROOT = Path(__file__).parents[2]
SCENES = sorted([*ROOT.glob("examples/*/scene.toml"), *ROOT.glob("src/kedfem/templates/*.toml")])


def seen(scene: Scene) -> tuple[str, tuple[str, ...]]:
    """The line of sizes and the warnings, with links as coarse as their masses allow; parts from CAD are left out."""
    drawn = {name: link for name, link in scene.links.items() if not isinstance(link.shape, Cad)}
    links = rigid_links(scene.model_copy(update={"links": drawn}))
    sliders = [SimpleNamespace(name=name, mass=x.mass) for name, x in scene.links.items() if x.shape is None]
    model: Any = SimpleNamespace(links=list(links.values()), prescribed=(), sliders=sliders)
    found = sizes(scene, model)
    return size_line(found), size_warnings(scene, found)


@pytest.mark.parametrize("path", SCENES, ids=lambda path: f"{path.parent.name}/{path.stem}")
def test_no_example_and_no_template_is_doubted(path: Path) -> None:
    assert seen(read_scene(path))[1] == ()


def test_a_rigid_link_without_a_shape_has_no_material_to_doubt() -> None:
    """However heavy it is: 40 t on a line of 0.3 m made one stiffer than diamond."""
    raw = four_bar()
    raw["links"]["coupler"] = {"model": "rigid", "mass": 4e4, "centre": [0.2, 0.2], "inertia": [1, 1, 1, 0, 0, 0]}
    line, warnings = seen(scene_from(raw))
    assert "E 210 GPa;" in line
    assert warnings == ()


def test_sliders_and_moving_parts_of_the_ground_have_no_size() -> None:
    """A body of any size stands for them in the equations."""
    shape = {"kind": "bar", "between": [[0, 0], [0.4, 0]], "width": 0.03, "thickness": 0.02}
    slide = {"kind": "prismatic", "axis": "x"}
    raw = {
        "links": {
            "arm": {"model": "beam", "material": "steel", "shape": shape},
            "block": {"model": "rigid", "mass": 0.5}, "table": {"model": "rigid"},
        },
        "joints": {
            "table": slide | {"links": ["table", "ground"], "at": [0, 0]},
            "root": {"kind": "weld", "links": ["arm", "table"], "at": [0, 0]},
            "guide": slide | {"links": ["block", "arm"], "at": [0.2, 0]},
        },
        "springs": {"hold": {"kind": "spring", "joint": "guide", "stiffness": 2000}},
        "drive": {"joint": "table", "motion": {"kind": "harmonic", "travel": 0.01, "frequency": 5}},
        "analysis": {"end_time": 0.1, "step": 0.001, "frames": "co-rotational", "accuracy": "quick"},
    }  # fmt: skip
    scene = scene_from(raw)
    found = sizes(scene, meshed(scene).model)
    assert found.lengths == pytest.approx({"arm": 0.4})
    assert found.overall == pytest.approx(0.4)
    assert found.masses["block"] == pytest.approx(0.5)


def four_bar(factor: float = 1.0, **change: Any) -> dict[str, Any]:
    """All lengths times a factor; keys a__b replaced."""
    a, width, thickness = 0.1 * factor, 0.02 * factor, 0.01 * factor

    def bar(between: list[str]) -> dict[str, Any]:
        shape = {"kind": "bar", "between": between, "width": width, "thickness": thickness}
        return {"model": "beam", "material": "mine", "shape": shape}

    def hinge(at: str, *links: str) -> dict[str, Any]:
        return {"kind": "revolute", "links": list(links), "at": at}

    raw: dict[str, Any] = {
        "points": {
            "A": [0, 0], "D": [3 * a, 0], "B": {"from": "A", "distance": a, "angle": "60 deg"},
            "C": {"from": ["B", "D"], "distances": [3 * a, 2.5 * a]},
        },
        "materials": {"mine": {"density": 7850, "youngs_modulus": 2.1e11, "poisson_ratio": 0.3}},
        "links": {"crank": bar(["A", "B"]), "coupler": bar(["B", "C"]), "rocker": bar(["C", "D"])},
        "joints": {
            "A": hinge("A", "ground", "crank"), "B": hinge("B", "crank", "coupler"),
            "C": hinge("C", "coupler", "rocker"), "D": hinge("D", "ground", "rocker"),
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": "300 rpm"}},
        "analysis": {"revolutions": 1},
    }  # fmt: skip
    for path, value in change.items():
        *above, last = path.split("__")
        table = raw
        for key in above:
            table = table[key]
        table[last] = value
    return raw


MISTAKES = [
    ("all in mm", four_bar(1000), "links.crank, coupler, rocker: 100 to 300 m long", "'25 mm'"),
    ("small, all in mm", four_bar(80, drive__motion__speed="3000 rpm"), "the end of links.crank moves at",
     "faster than any rotor"),
    ("smaller, all in mm", four_bar(80, drive__motion__speed="450 rpm"), "would stretch it by 0.27 %", "'25 mm'"),
    ("one width in mm", four_bar(links__crank__shape__width=20), "links.crank.shape.width: 20 m", "'20 mm'"),
    ("GPa forgotten", four_bar(materials__mine__youngs_modulus=210), "mine.youngs_modulus: 210 Pa", "'210 GPa'"),
    ("MPa forgotten", four_bar(materials__mine__youngs_modulus=2.1e5), "youngs_modulus: 2.1e+05 Pa", "MPa"),
    ("g/cm^3", four_bar(materials__mine__density=7.85), "mine.density: 7.85 kg/m^3", "'7.85 g/cm^3'"),
    ("t/mm^3", four_bar(materials__mine__density=7.85e-9), "mine.density: 7.85e-09 kg/m^3", "t/mm^3"),
    ("rpm", four_bar(drive__motion__speed=300), "drive.motion.speed: 300 without a unit is in rad/s, 2865 rpm",
     "'300 rpm'"),
    ("degrees", four_bar(points__B__angle=60), "points.B.angle: 60 without a unit is in radians, 3438°", "'60 deg'"),
    ("mm/s^2", four_bar(gravity=[0, -9810]), "gravity: 9810 m/s^2", "'9810 mm/s^2'"),
    ("a mass in g", four_bar(bodies={"w": {"kind": "point_mass", "link": "rocker", "at": "C", "mass": 2e6}}),
     "links.rocker: its mass is 2e+06 kg", "heavier"),
]  # fmt: skip


@pytest.mark.parametrize(("raw", "words", "unit"), [case[1:] for case in MISTAKES], ids=[case[0] for case in MISTAKES])
def test_a_wrong_unit_is_told(raw: dict[str, Any], words: str, unit: str) -> None:
    from kedfem.accuracy.prepared import meshed

    if "B" in raw["points"] and raw["points"]["B"]["angle"] == 60:
        raw["points"]["C"]["distances"] = [0.35, 0.3]
    scene = scene_from(raw)
    found = sizes(scene, meshed(scene).model) if "bodies" in raw else None
    warnings = size_warnings(scene, found) if found else seen(scene)[1]
    told = [warning for warning in warnings if words in warning]
    assert len(told) == 1, warnings
    assert unit in told[0]


def test_a_bare_number_with_its_unit_is_not_doubted() -> None:
    for speed in ("300 rpm", "300 rad/s", 62.83):
        assert seen(scene_from(four_bar(drive__motion__speed=speed)))[1] == ()
    table = {"kind": "curve", "time": [0, 1, 2, 3], "value": [0, 10, 20, 30]}  # many revolutions
    assert seen(scene_from(four_bar(drive__motion=table, analysis={"end_time": 3, "step": 0.1})))[1] == ()


def test_sizes_are_in_one_line() -> None:
    line, warnings = seen(scene_from(four_bar()))
    assert warnings == ()
    # L b h rho of 0.1 and 0.3 m, 20 x 10 mm, 7850 kg/m³
    assert line == (
        "sizes: 301.6 mm overall; links 100 mm (crank) to 300 mm (coupler); masses 0.157 to 0.471 kg; "
        "E 210 GPa; drive 300 rpm"
    )


def test_a_slider_has_no_size() -> None:
    """Only points of its model, 173 mm apart for joints 2 m apart: one was listed as the shortest link."""
    raw = four_bar()
    del raw["joints"]["D"], raw["links"]["rocker"]
    raw["links"]["block"] = {"model": "rigid", "mass": 0.01}
    raw["joints"]["C"]["links"] = ["coupler", "block"]
    raw["joints"]["guide"] = {"kind": "prismatic", "links": ["block", "ground"], "at": "C", "axis": "x"}
    raw["drive"]["motion"] = {"kind": "harmonic", "frequency": 1, "angle": "1 deg"}
    scene = scene_from(raw | {"analysis": {"end_time": 1, "step": 0.1, "accuracy": "quick"}})
    line = size_line(sizes(scene, begun_march(scene).prepared.model))
    assert "links 100 mm (crank) to 300 mm (coupler); masses 0.01 to 0.471 kg;" in line


def test_points_drawn_apart_do_not_meet() -> None:
    from kedfem.accuracy.prepared import meshed

    raw = four_bar(points__E=[0.3, 0.001])
    raw["joints"]["D"]["at"] = "E"
    with pytest.raises(MeshError, match=r"joints\.D: .*parts do not meet"):
        meshed(scene_from(raw))


@pytest.mark.parametrize(
    ("text", "unit", "wanted"),
    [("300 MM", "m", "'mm'"), ("5 KG", "kg", "'kg'"), ("3 mpa", "Pa", "'MPa'"), ("600 RPM", "rad/s", "'rpm'"),
     ("2 n", "N", "'N'"), ("3 S", "s", "'s'")],
)  # fmt: skip
def test_a_unit_in_other_letters_has_a_hint(text: str, unit: str, wanted: str) -> None:
    with pytest.raises(ValueError, match=f"did you mean {wanted}"):
        si_number(text, unit)


@pytest.mark.parametrize(
    "given",
    ["m**(9**9**9)", "m**9**9**9**9", "m//m*m", "m*inf/inf", "m**-0", "k" * 20_000, "m*" * 2000 + "m",
     "(" * 5000 + "m" + ")" * 5000, "__import__('os')", "m**99", "m²²²"],
)  # fmt: skip
def test_a_unit_is_names_with_small_powers(given: str) -> None:
    with pytest.raises(ValueError, match=r"is not a unit|unknown unit|another kind"):
        si_number(f"1 {given}", "m")


def test_units_that_are_usual_are_read() -> None:
    for text, unit, value in (
        ("2 N*m*s/rad", "N*m*s/rad", 2.0), ("3 kg m²", "kg*m^2", 3.0), ("5 /s", None, 5.0), ("9 N/(m*m)", "Pa", 9.0),
        ("1 µm", "m", 1e-6), ("180 °", "rad", 3.141592653589793), ("1 m/s**2", "m/s^2", 1.0), ("4 N·m", "N*m", 4.0),
    ):  # fmt: skip
        if unit:
            assert si_number(text, unit) == pytest.approx(value, rel=1e-15)
