"""Renamed keys and values: docs/notation.md and messages agree, and each message names the present word."""

import re
from itertools import chain
from pathlib import Path
from typing import Any

import pytest

from kedfem.errors import SceneError
from kedfem.scene import scene_from
from kedfem.scene.records.wording import KEYS, VALUES
from tests.scenes import arm, bar, constant_speed

TABLE = Path(__file__).parents[2] / "docs" / "notation.md"
PLACES: dict[str, tuple[str, ...]] = {
    **dict.fromkeys(("fidelity", "functions", "modes", "reduced", "step", "file"), ("links", "arm")),
    "reduction": ("analysis",),
    "port": ("joints", "A"),
    "turning_stiffness": ("joints", "A", "bushing"),
    "turning_damping": ("joints", "A", "bushing"),
    "spin": ("analysis", "initial_motions", "arm"),
    "turn": ("patterns", "p"),
    "turns": ("analysis",),
    "last_turns": ("output", "animation"),
    "steps_per_turn": ("analysis",),
    "frames_per_turn": ("output", "animation"),
    "levels": ("analysis",),
    "exaggeration": ("output", "animation"),
    "ignore": ("links", "arm", "mesh"),
    **dict.fromkeys(("angle", "travel", "smooth"), ("drive", "motion")),
}
WORDS: dict[str, tuple[str, ...]] = {
    "nominal": ("analysis", "frames"),
    "following": ("links", "arm", "frames"),
    "literal": ("analysis", "solver"),
    "averaged": ("joints", "A", "coupling"),
    "stiff": ("joints", "A", "coupling"),
    "table": ("drive", "motion", "kind"),
}


def changed(place: tuple[str, ...], value: Any) -> dict[str, Any]:
    raw = arm(bar(), constant_speed(1.0), analysis={"revolutions": 1})
    if place[:2] == ("drive", "motion"):
        raw["drive"]["motion"] = {"kind": "curve"}
    table = raw
    for key in place[:-1]:
        table = table.setdefault(key, {})
    table[place[-1]] = value
    return raw


@pytest.mark.parametrize("old", KEYS)
def test_an_old_key_is_an_unknown_key_whose_message_names_the_present_one(old: str) -> None:
    place = ".".join((*PLACES[old], old))
    with pytest.raises(SceneError, match=re.escape(f"{place}: unknown key, did you mean '{KEYS[old]}'?")):
        scene_from(changed((*PLACES[old], old), 1))


@pytest.mark.parametrize("old", VALUES)
def test_an_old_value_is_refused_with_the_present_one(old: str) -> None:
    place = ".".join(WORDS[old])
    with pytest.raises(SceneError, match=rf"{re.escape(place)}: must be .*did you mean '{VALUES[old]}'\?"):
        scene_from(changed(WORDS[old], old))


def test_the_notation_lists_all_renamed_keys_and_values() -> None:
    section = TABLE.read_text("utf-8").split("### Keys and values of the scene\n", 1)[1].split("\n### ", 1)[0]
    rows = [line.split("|") for line in section.splitlines() if line.startswith("| `")]
    found: dict[str, str] = {}
    for row in rows:
        words = [re.findall(r'"([\w-]+)"', cell) or re.findall(r"`(\w+)`", cell) for cell in row[1:3]]
        found |= dict(zip(*words, strict=True))
        if '"' in row[1]:  # a key may change with its values
            names = [re.match(r" `(\w+) =", cell) for cell in row[1:3]]
            found |= {old[1]: new[1] for old, new in [names] if old and new and old[1] != new[1]}
    assert found == KEYS | VALUES


RETIRED = {
    "nominal": r"\bnominal",
    "seat": r"(?<!ball[ _])\bseats?\b(?!\.)|(?<!ball)_seat\b|\bseat_",
    "literal": r"\bliteral\b|\bLiteralS|literal_(?!e)",
    "as drawn": r"(?i)\bas drawn\b(?! by hand)|\blinks were drawn\b|\b(drawn shape|point drawn)\b|\bdrawn .* apart$",
    "drawn position": r"(?i)\bdrawn position|\b(where|from where) (it is|they are|its pin is|the pin is) drawn",
    "in full": r"(?i)\blinks in full\b|\bin_full\b|\bfull links?\b",
    "told": r"(?i)is to be reported of|\bwatch : reported of|\btold\b(?! (?:of|to|apart)\b)|_told\b|\btold of\b",
    "oracle": r"(?i)oracle(?!\.py)",
    "mixing": r"(?i)\bAnderson mixing\b|\bmixing\b|mixing_",
    "functions": r"\bfunctions of a reduced link\b",
    "were rigid": r"\bwere all links rigid\b",
    "holds": r"\bheld by (a joint|joints)\b|\bnothing holds\b|\bjoints? holds?\b",
    "port point": r"(?i)\bport points?\b",
    "room": r"\bsingle rooms\b",
    "props": r"\bprops\.py\b",
    "noticed": r"\bNOTICED\b",
    "looked at": r"\blooked at\b",
    "carried": r"(?i)\.carried\b|\bcarried (along|by|to)\b",
    "hub": r"\bhubs?_|_hubs?\b|\bHUBS?_|\.hub\b",
    "left over": r"\bleft over\b",
    "leaves free": r"\bleaves? free\b",
    "action": r"\bactions?\b(?!=)",
    "sweeps": r"\bSWEEPS\b",
    "turning": r"\bgo(es)? on turning\b|\bhas turned\b|\bturning_(loads|bodies|kernel)\b|counted_turns",
    "loads that turn": r"\bloads? that turns? with\b|\bturns? (back )?with (the|its) link\b",
    "turn (a full one)": r"\bper turn\b|\b(work|twice) a turn\b|\b(last|steady) turn\b|\bin turn \d",
    "turn": r"\b(two|three|four|five|ten|whole|full|last) turns\b|\b(over|after|within) (a|one) turn\b|\bsteps a turn\b",
    "in thought": r"\bstands? still in thought\b",
    "doubtful": r"[`\"]doubtful|\bDOUBTFUL\b|\.doubt\b",
    "let go": r"\blets? go of\b",
    "fidelity": r"(?i)\bfidelit",
    "averaged": r"`averaged`|\bAveraged\b",
    "filled_mesh": r"\bfilled_mesh\b|\bmesh[./](filling|hollows)\b|\b(free|finer)_hollows\b",
    "kept_whole": r"(?i)\bkept_?whole\b",
    "laid_over": r"\b(laid_over|one_surface|not_too_bad|check_room)\b",
    "watcher": r"(?i)\bwatcher\b|\bStepWatch\b|\b(asked_for|first_enough|last_of|let_go)\b",
    "in_common": r"\b(in_common|drawn_points|places_apart|stated_link|counted_on)\b",
    "parted": r"\b(parted|most_(segments|slices)|not_touching|in_its_plane|between_gauss|on_functions|rigid_functions)\b",
    "looser_rows": r"\b(looser_rows|would_move|reference_linkage|of_joints|weakness)\b",
    "truth": r"\b(from|against|beside) the truth\b",
}
"""Words of docs/notation.md that package and docs do not use any more; its names and prose have the right column."""


@pytest.mark.parametrize("word", RETIRED)
def test_the_project_speaks_the_words_of_the_field(word: str) -> None:
    root = TABLE.parents[1]
    rooms = [(root / name).rglob("*") for name in ("src", "docs", "examples", "benchmarks", "reference")]
    used = [
        f"{file.relative_to(root)}:{number}: {line.strip()}"
        for file in chain(root.glob("*.md"), *rooms)
        if file.suffix in {".py", ".md", ".toml"} and file.name not in {"wording.py", TABLE.name, "CHANGELOG.md"}
        for number, line in enumerate(file.read_text(encoding="utf-8").splitlines(), 1)
        if re.search(RETIRED[word], line)
    ]
    assert used == []
    assert word.split(maxsplit=1)[0] in TABLE.read_text(encoding="utf-8")
