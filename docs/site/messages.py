"""The reference of messages: how they are made, warnings of runs, and the messages of wrong scenes, each made by its scene."""

import tomllib
from itertools import groupby
from pathlib import Path

ROOT = Path(__file__).parents[2]

INTRODUCTION = """\
# Messages

Errors name the *place* in the scene, what is required there, what was given, and where it helps the nearest right word:

    links.crank.material: must name a material, got 'stel', did you mean 'steel'?

All faults of a scene come at once, before anything is computed. Places are paths of the scene file: `links.crank.material` is the key
`material` of the table `[links.crank]`. A run that cannot go on ends with the time, the drive's position and the step, and keeps what
it has. Exit statuses are on the [command line's page](command-line.md).

## Warnings of a run

A warning never stops a run. It is printed, kept in `results.h5` and shown in the report.

| it says | what it is about | what to do |
|---|---|---|
| `... m long, longer than any machine's`, `is it in mm?`, `are all lengths in one unit?` | a number that looks like one of another unit | write the unit: `"25 mm"` |
| `the step resolves the first frequency ... by ... steps in a period` | vibration of the mechanism is faster than the time step, whose estimated error is above 1 % | a shorter `analysis.step`, or leave it open; a smoother start or load, or damping ([accuracy](../accuracy.md)) |
| `the drive's harmonic ... meets the first frequency` | resonance somewhere on the revolution | `kedfem frequencies`, another speed, damping ([frequencies](../frequencies.md)) |
| `estimated error: ...; most of it from the ...` | mesh, step, modes, frames or rounding leave more than 5 %, or more than twice what was asked for | what the warning names; [how far to trust results](../tutorial/trust.md) |
| `the elastic rotation of links is up to ... deg` | links bend so far that stiffness has to follow them | `frames = "co-rotational"` in `[analysis]` |
| `the residual of the balance is ...` | energy is lost or made by the steps | shorter steps |
| `the step is too long for rho_inf` | numerical damping is too small for the angle of a step: vibration would grow | as many steps as it says, or a smaller `rho_inf` |
| `joints/NAME/force: not reported` | a force that rigid-body statics leaves open | looser joints, as `kedfem check` proposes |
| `the highest stress, ..., is at a sharp re-entrant corner` | stress there grows with every refinement | [peak stress](../how-to/peak-stress.md) |
| `comes near a singular position` | a mechanism that moves freely passes a position with two ways to go on | damping, or a shorter step to compare with |
| `the work of the drive is off ..., no more` | steps whose iterations do not end quite, or levels in time that differ | where that is more than you need, a shorter step |
| `... contradicts ...`, `a part of its effort is missing` | two routes to one force differ | do not use the run; it is worth a report as a defect |

## Faults of a scene

What the checks of a scene say: each line below was made by reading a scene with that one fault. NAME, place and number are
those of the scene that was read.

"""


def said(text: str, case: dict[str, object]) -> str:
    """What kedfem says of one wrong scene, or nothing where its files are needed."""
    from tests.rooms.test_bad_scenes import changed

    from kedfem.errors import KedfemError
    from kedfem.scene import scene_from

    try:
        scene_from(changed(text, case.get("change", {}), case.get("gone", [])), ROOT / "tests")
    except KedfemError as error:
        return str(error)
    return ""


def faults() -> list[tuple[str, str]]:
    """Table of the scene and message, each once, in the order of the tables."""
    from tests.rooms.test_bad_scenes import BASES

    cases = tomllib.loads((ROOT / "tests" / "rooms" / "bad_scenes.toml").read_text("utf-8"))
    lines = {
        line.strip() for base, wrong in cases.items() for case in wrong for line in said(BASES[base], case).splitlines()
    }
    rows = [(line.split(":")[0].split(".")[0].split("[")[0], line) for line in lines if ": " in line]
    return sorted(rows)


def messages() -> str:
    """The text of the page."""
    parts = [INTRODUCTION]
    for table, rows in groupby(faults(), key=lambda row: row[0]):
        parts.append(
            f"### {table}\n\n```{{code-block}} none\n:class: wrapped\n\n"
            + "\n".join(line for _, line in rows)
            + "\n```\n\n"
        )
    return "".join(parts)
