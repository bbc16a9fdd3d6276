"""Every example of the scene reference is valid, within a whole scene, and every table has one."""

import json
import re
import tomllib
from collections.abc import Mapping
from pathlib import Path

import pytest
from reference.scene import SECTIONS
from reference.scene_examples import EXAMPLES

from kedfem.scene import Scene, read_scene, scene_from
from tests.rooms.test_bad_scenes import BEAMS, FREE, GOOD

UNDRIVEN = ("motor", "spring", "initial_motions")
SLIDE = "S"
PART = "The file of a part"
SCENES = Path(__file__).parents[2] / "examples"


def base(text: str) -> str:
    """The scene of a test that has the names of an example."""
    if any(word in text for word in UNDRIVEN):
        return FREE
    return BEAMS if f'joint = "{SLIDE}"' in text else GOOD


def merged(scene: dict[str, object], change: Mapping[str, object]) -> dict[str, object]:
    """A scene with the tables of an example; a table of another kind replaces the whole one."""
    for key, value in change.items():
        old = scene.get(key)
        same = isinstance(old, dict) and isinstance(value, dict) and old.get("kind") == value.get("kind", old.get("kind"))
        scene[key] = merged(old, value) if same else value  # type: ignore[arg-type]
    return scene


def survives_storage(scene: Scene) -> None:
    """Results keep their scene as text: reports and loads read it again."""
    assert scene_from(json.loads(scene.model_dump_json()), scene.folder).model_dump() == scene.model_dump()


@pytest.mark.parametrize("path", sorted(SCENES.glob("*/*.toml")), ids=lambda path: str(path.parent.name))
def test_the_scene_of_an_example_survives_storage(path: Path) -> None:
    survives_storage(read_scene(path))


def test_every_table_of_the_reference_has_an_example() -> None:
    assert list(EXAMPLES) == [heading for heading, _, _ in SECTIONS]


@pytest.mark.parametrize("heading", EXAMPLES)
def test_an_example_of_the_reference_is_valid_in_a_whole_scene(heading: str, tmp_path: Path) -> None:
    text = EXAMPLES[heading]
    (tmp_path / "materials.toml").write_text("[materials.mine]\ndensity = 2800\n")
    if heading == PART:
        (tmp_path / "part.toml").write_text(text)
        text = '[links.rocker.shape]\nkind = "part"\nfile = "part.toml"\nbetween = ["C", "D"]\n'
    survives_storage(scene_from(merged(tomllib.loads(base(text)), tomllib.loads(text)), tmp_path))
    keys = re.sub(r"\[([\w.]+)\.NAME(.*)\]", r"[\1.", heading)
    if heading.startswith("["):
        assert keys.rstrip("]") in text, "the example shows the table"
