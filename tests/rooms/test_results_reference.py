"""docs/results.md: made from the code, and says of every channel what it is."""

from pathlib import Path

import pytest
from reference.results import CHANNELS, entries, results_page

from kedfem.analysis import analyse
from kedfem.kinematics import kinematics
from kedfem.results import Channel
from kedfem.scene import scene_from
from tests.reliability.fuzz import short
from tests.scenes import example

PAGE = Path(__file__).parents[2] / "docs" / "results.md"
SOME = ("four_bar_beams", "motor_four_bar")  # of all examples: tests/test_examples.py
DRIVEN = ("four_bar_beams", "spinning_bar", "rssr", "bennett", "universal_joint_shaft", "quick_return", "five_bar_robot")


def test_the_page_is_made_from_the_code() -> None:
    assert PAGE.read_text(encoding="utf-8") == results_page(), "python -m reference.results > docs/results.md"


@pytest.mark.parametrize("name", SOME)
def test_every_channel_of_a_run_is_described(name: str, tmp_path: Path) -> None:
    found = analyse(scene_from(short(example(name)), tmp_path)).results
    assert not [each for each, (channel, _) in found.channels.items() if not entries(channel)]


@pytest.mark.parametrize("name", DRIVEN)
def test_every_channel_of_the_rigid_motion_is_described(name: str, tmp_path: Path) -> None:
    found = kinematics(scene_from(short(example(name)), tmp_path)).results
    assert not [each for each, (channel, _) in found.channels.items() if not entries(channel)]


@pytest.mark.parametrize(
    "other",
    [
        Channel("joints/B/force", ("x", "y", "z"), "kN", "world", ""),
        Channel("joints/B/force", ("x", "y", "z"), "N", "link", ""),
        Channel("joints/B/force", ("torque", "y"), "N", "world", ""),
        Channel("joints/B/forces", ("x", "y", "z"), "N", "world", ""),
        Channel("joints/B/C/force", ("x", "y", "z"), "N", "world", ""),
    ],
)
def test_a_channel_of_another_kind_is_not_described(other: Channel) -> None:
    assert not entries(other)


def test_every_line_of_the_page_says_a_unit_and_a_meaning() -> None:
    every = [each for group in CHANNELS.values() for each in group]
    assert all(each.unit and each.text.endswith(".") for each in every)
    units = {unit for each in every for unit in each.words().values()}
    assert units == {"m", "m/s", "m/s^2", "Pa", "N", "N m", "rad", "rad/s", "rad/s^2", "J"}
