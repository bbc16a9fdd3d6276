"""The table of capabilities: its page, a scene for each line, and each joint with all frames as its page says."""

import tomllib
from pathlib import Path
from typing import Any

import pytest
from reference.capabilities import COLUMNS, JOINTS, capabilities_page

from kedfem.errors import SceneError
from kedfem.scene import scene_from
from kedfem.scene.checks import capabilities
from kedfem.scene.checks.capabilities import KINDS, REFUSALS, refusals
from tests.cells import as_said
from tests.moving import bar, driven_slide, inverted, turning
from tests.partners import chain
from tests.rooms.test_bad_scenes import BASES, changed

Raw = dict[str, Any]
AT = {"at": [0.1, 0]}


def over(what: str, link: str = "arm") -> Raw:
    """A load and a spring with factors over the angle or travel of a drive."""
    factor, end = {"over": what, "at": [0], "value": [1]}, {"link": link, "at": [0.1, 0]}
    between = [end, {"link": "ground", "at": [1, 1]}]
    return {
        "loads": {"p": {"kind": "force", **end, "vector": [0, 1], "factor": factor}},
        "springs": {"s": {"kind": "spring", "between": between, "stiffness": 1.0, "stiffness_factor": factor}},
    }


def test_the_page_is_the_table() -> None:
    page = Path(__file__).parents[2] / "docs" / "capabilities.md"
    said = "python -m reference.capabilities > docs/capabilities.md"
    assert page.read_text("utf-8") == capabilities_page(), said


def faults(raw: Raw) -> list[str]:
    try:
        scene_from(raw)
    except SceneError as error:
        return [str(fault) for fault in error.faults]
    return []


def slid(kind: str, **more: Any) -> Raw:
    """A crank and an arm with a block or a pin that slides on it."""
    return {**inverted(kind=kind), **more}


def bare(**load: Any) -> Raw:
    """A load on a slider without a shape."""
    return changed(BASES["beam"], {"loads/l": {"link": "shoe", **load}})


def line(more: Raw) -> Raw:
    """A polyline of some section."""
    return {"kind": "polyline", "points": [[0, 0, 0], [0.5, 0, 0], [1, 0, 0]], **more}


def loaded(model: str, shape: Raw | None = None, **load: Any) -> Raw:
    """A load on a link with a shape."""
    change: Raw = {"links/arm/model": model, "loads/l": {"link": "arm", **load}}
    return changed(BASES["beam"], change | ({"links/arm/shape": shape} if shape else {}))


def planar(kind: str, other: str) -> Raw:
    """A plane link joined to a solid or rigid one between hinges."""
    links = {"a": bar("beam", (0, 0), (0.1, 0), 1), "b": bar("plane", (0.1, 0), (0.3, 0)),
             "c": bar(other, (0.3, 0), (0.5, 0))}  # fmt: skip
    joints = {
        "A": {"kind": "revolute", "links": ["ground", "a"], "at": [0, 0]},
        "B": {"kind": "revolute", "links": ["a", "b"], "at": [0.1, 0]},
        "C": {"kind": kind, "links": ["b", "c"], "at": [0.3, 0], **({"axis": "x"} if kind == "prismatic" else {})},
    }
    return {"links": links, "joints": joints, "drive": turning(), "analysis": {"end_time": 0.1, "step": 1e-3}}


def bushed() -> Raw:
    raw = chain("spherical", ("beam", "beam"))
    raw["joints"]["J"]["bushing"] = {"stiffness": 1e6, "rotational_stiffness": 1e3}
    return raw


def shafted() -> Raw:
    raw = driven_slide()
    raw["drive"]["shaft_stiffness"] = 1.0
    return raw


def driven(kind: str) -> Raw:
    raw = chain(kind, ("beam", "beam"))
    raw["drive"] |= {"joint": "J"}
    return raw


BOTH = {"a": {"kind": "torsion", "joint": "S", "stiffness": 1.0}, "b": {"kind": "spring", "joint": "A", "stiffness": 1.0}}
STOPS = {
    "a": {"kind": "angle", "joint": "S", "upper": 1.0, "stiffness": 1.0},
    "b": {"kind": "travel", "joint": "B", "upper": 1.0, "stiffness": 1.0},
    "c": {"kind": "travel", "joint": "S", "upper": 1.0, "stiffness": 1.0},
    "d": {"kind": "angle", "joint": "A", "upper": 1.0, "stiffness": 1.0},
}


def unlike_across(model: str = "beam", driven: bool = False) -> Raw:
    """A slot whose bushing gives way in one direction across its line more than in the other."""
    raw = chain("slot", (model, model), plane=model != "beam")
    raw["analysis"] |= {"initial": "rest", "frames": "co-rotational"}
    raw["joints"]["J"]["bushing"] = {"stiffness": [1e6, 2e6, 1e6]}
    return raw if driven else {key: x for key, x in raw.items() if key != "drive"}


SCENES: list[Raw] = [
    slid("prismatic", limits=STOPS, analysis={**inverted()["analysis"], "extrapolation_levels": 2}),
    unlike_across(),
    slid("prismatic", analysis={**inverted()["analysis"], "kind": "steady", "solver": "monolithic", "rho_inf": 1.0,
         "initial_speeds": {"B": 1.0}, "initial_motions": {"arm": {**AT, "velocity": [0, 1]}},
         "initial_deflection": {"d": {**AT, "link": "arm", "force": [0, 1]}}}),
    changed(BASES["free"], {"analysis/kind": "steady"}),
    changed(BASES["free"], {"fatigue/materials/steel": {"group": "steel", "tensile_strength": 6e8}}),
    changed(BASES["free"], {"analysis/kind": "quasi-static"}),
    slid("prismatic", analysis={**inverted()["analysis"], "kind": "static", "stiffening": True,
         "extrapolation_levels": 2}),
    slid("prismatic", analysis={**inverted()["analysis"], "stiffening": True, "rho_inf": 1.0}),
    slid("prismatic", analysis={**inverted()["analysis"], "stiffening": True, "frames": "co-rotational"}),
    slid("prismatic", springs=BOTH, motors={"m": {"joint": "S", "torque": 1.0}, "n": {"joint": "A", "force": 1.0}}),
    slid("prismatic", motors={"n": {"joint": "S", "force": 1.0}},
         springs={"s": {"kind": "spring", "joint": "S", "stiffness": 1.0}},
         gears={"g": {"joints": ["A", "S"], "ratio": 2}, "r": {"joints": ["A", "B"], "radius": 0.1}},
         analysis={**inverted()["analysis"], "stiffening": True,
                   "initial_speeds": {"B": 1.0}, "initial_motions": {"arm": {**AT, "velocity": [0, 1]}},
                   "initial": "rest", "initial_deflection": {"d": {**AT, "link": "arm", "force": [0, 1]}}}),
    bushed(), shafted(), driven("spherical"), planar("weld", "solid"),
    planar("weld", "rigid"),
    bare(kind="torque", at=[1, 0], vector=[0, 0, 1]), bare(kind="body", force_density=[0, 1]),
    bare(kind="surface", at=[1, 0], axis="x", force=[0, 1]), bare(kind="pressure", at=[1, 0], axis="x", pressure=5),
    bare(kind="line", vector=[0, 1]),
    loaded("beam", kind="surface", at=[0.1, 0.1], vector=[0, 1]), loaded("plane", kind="line", vector=[0, 1]),
    loaded("beam", line({"section": {"kind": "round", "diameter": 0.2}}), kind="pressure", at=[0.1, 0.1], pressure=1),
    loaded("beam", line({"width": 0.2, "thickness": 0.2, "smooth": True}), kind="pressure", at=[0.1, 0.1], pressure=1),
    {**inverted(), **over("travel")}, {**driven_slide(), **over("angle", "one")},
    {**inverted(), **over("angle"), "drive": None, "drives": {"a": turning(), "b": {**turning(), "joint": "B"}}},
    changed(BASES["free"], {
        "analysis/frames": "rigid-body", "links/arm/frames": "rigid-body", "analysis/initial": "quasi-static",
        "analysis/revolutions": 1, "analysis/steps_per_revolution": 10,
        "loads/p": {"kind": "force", "link": "arm", "at": [1, 0], "vector": [0, 1],
                    "factor": {"over": "angle", "at": [0], "value": [1]}},
        "springs/s": {"kind": "spring", "between": [{"link": "arm", "at": [1, 0]}, {"link": "ground", "at": [1, 1]}],
                      "stiffness": 1.0, "stiffness_factor": {"over": "angle", "at": [0], "value": [1]}},
    }),
]  # fmt: skip


def test_every_line_of_the_table_refuses_a_scene_in_its_own_words() -> None:
    """But those of models, which their parts show when they are meshed."""
    said = [fault for raw in SCENES for fault in faults(raw)]
    silent = [each for each in REFUSALS if each.of != "model" and not any(as_said(each, x) for x in said)]
    assert not silent, [each.must for each in silent]


@pytest.mark.parametrize("column", COLUMNS)
@pytest.mark.parametrize("kind", KINDS)
def test_a_joint_stands_with_frames_as_its_page_says(kind: str, column: str) -> None:
    """Between two beams that move: refused in the words of each line that it meets, and for nothing else."""
    facts, raw = COLUMNS[column], chain(kind, ("beam", "beam"))
    raw["analysis"] |= {"initial": "rest", "frames": facts["frames"], "stiffening": facts["stiffening"] == "on"}
    if facts["drive"] == "none":
        del raw["drive"]
    met = list(refusals("joints", {**JOINTS[kind], **facts}))
    found = [x for x in faults(raw) if x.startswith("joints.J.")]
    assert all(any(as_said(each, x) for x in found) for each in met)
    assert all(any(as_said(each, x) for each in met) for x in found), found


def test_a_line_that_is_taken_out_refuses_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    """To lift a refusal is to change one line: of bushings in slots that nothing drives."""
    raw = unlike_across()
    assert any("must be alike" in fault for fault in faults(raw))
    monkeypatch.setattr(capabilities, "REFUSALS", tuple(x for x in REFUSALS if x is not capabilities.UNLIKE))
    assert not faults(raw)


@pytest.mark.parametrize("case", ["alike", "driven", "in a plane"])
def test_bushings_of_slots_are_alike_across_only_where_nothing_shows_how_these_turn(case: str) -> None:
    raw = unlike_across("planar beam" if case == "in a plane" else "beam", driven=case == "driven")
    if case == "alike":
        raw["joints"]["J"]["bushing"]["stiffness"] = [1e6, 1e6, 1.0]
    assert not faults(raw)


def test_a_message_says_what_was_wanted_why_what_was_got_and_what_to_take() -> None:
    (said,) = faults(unlike_across())
    assert said == (
        "joints.J.bushing: must be alike in all directions across the line of a slot in space that no drive moves (its "
        "stations do not determine the rotation of the line about itself), got one that is not: give it one stiffness "
        "and one damping, or take a drive"
    )


def test_bases_are_good() -> None:
    assert not faults(tomllib.loads(BASES["beam"]))
