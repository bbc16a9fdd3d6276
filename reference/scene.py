"""The reference of all keys of a scene, from its records.

Regenerate it with ``python -m reference.scene > docs/scene.md``.
"""

from __future__ import annotations

import math
import sys
import types
from collections.abc import Sequence
from typing import Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

from kedfem.scene.checks.hints import field_hint, keys, kind_of, models, options
from kedfem.scene.records import (
    analysis,
    curves,
    drives,
    expressions,
    fatigue,
    force_elements,
    joints,
    links,
    loads,
    materials,
    outlines,
    patterns,
    points,
    scene,
    sections,
    shapes,
)
from kedfem.scene.records.units import Quantity
from reference.meanings import meanings
from reference.scene_examples import EXAMPLES

INTRODUCTION = """\
# The scene file

A scene is a TOML file: an assembled linkage in its reference position, its drive and loads, and what to compute.
`kedfem new four-bar` writes a commented one to start from. All faults of a scene are reported at once, each
as *where: what was wanted, what was got*.

* **Units** are SI (m, kg, s, N, Pa, rad, Hz). A string may carry another unit of the same kind: `"25.4 mm"`,
  `"600 rpm"`, `"60 deg"`, `"70 GPa"`. Hertz do not count as a rotational speed nor rpm as a frequency.
* **Parameters and expressions:** `[parameters]` holds numbers by name, `r = "25 mm"`, and any number of the scene may be
  an expression of them: `width = "=2*r + 5 mm"`. `+ - * / ^` and brackets, `pi`, `sqrt`, `abs`, `min`, `max`, `hypot`,
  `sin`, `cos`, `tan` (of angles), `asin`, `acos`, `atan`, `atan2`, `exp`, `log`. A unit follows its number and belongs to
  it, powers and quotients included: `1/5 N/m` is 1/(5 N/m). Units are checked: `25 mm + 3` and `25 mm + 3 s` are faults;
  so is `50 Hz` where rad/s is wanted (write `"=2*pi*1 rad*f"`). What has no unit in the end
  is in SI, or a count. At most {longest} letters, exponents up to {power:g}. Parameters may be expressions of each other.
* **Included files:** `include = ["materials.toml"]`, before all tables, takes over the tables of other scene files, key
  by key; what the scene states itself stands, of several files the later one, and a table of another `kind` replaces the
  whole one. File names in an included file are relative to that file. Results store the scene with all that it includes
  and all expressions worked out.
* **Points** are two or three coordinates (z = 0 if left out), the name of a point in `[points]`,
  `joints.NAME` for the place of a joint, or one of the constructions below, wherever a point stands:
  `at = {{ between = ["A", "B"], fraction = 0.3 }}`. **Axes** are `"x"`, `"y"`, `"z"`, a vector of any length, or two
  points: `axis = {{ from = "A", to = "B" }}`.
  **Vectors** are two or three components; the third is 0 if left out.
* **One reference position:** all points, shapes and axes are those of the linkage in this position; the drive's angle
  counts from there. Where joints have points of their own on each link, this position is the closed one.
* **Names** (of points, links, joints ...) are made of letters, digits, `_`, `-` and inner spaces. `ground` is
  the frame.
* **Materials** that are built in: {materials}.
* **Plane links** are two-dimensional. A scene with any lies in one plane z = constant, with hinges along z and
  forces in the plane; solids and beams in space may share it, joined to them by hinges, welds and slides, where they stay
  upright.
* **Beams** are planar where they can be: if all that touches the beam is in one plane z = constant, all hinges of the
  scene are along z, all forces, gravity and slides in xy, and the beam is welded to nothing but such beams and plane
  links. Else they are beams in space; `beam = "planar"` or `"spatial"` settles it. Beams, plane links and solids go
  together: a hinge joins any two.
* **Welds** join beams, solids and rigid links in any pair; a beam welded to a solid or to a beam in space is one in space
  itself.
* **Without a drive** the mechanism moves by itself: under `motors`, `springs`, gravity and other loads, from
  `analysis.initial_speeds`. Frames are co-rotational then, `analysis.end_time` and `step` are required, and links need
  not be connected by joints. Torques, angles and speeds of a joint are those of its first link that is not the ground
  against the other, positive about its axis.
* **From Python** `kedfem.scene.scene_from(dict, folder)` takes the same keys, and records such as
  `kedfem.scene.Bar` in place of tables; `read_scene(path)` reads a file.

The tables below are made from the program's own records (`python -m reference.scene > docs/scene.md`).
What a `—` in the column *default* stands for is said under *meaning*.
"""

SECTIONS: list[tuple[str, str, Sequence[type[BaseModel]]]] = [
    ("The file", "", [scene.Scene]),
    (
        "[points]",
        "Each is a list of coordinates or one of these constructions, which may stand in place of any other point too.",
        [points.PolarPoint, points.CirclesPoint, points.LinePoint, points.BetweenPoint],
    ),
    ("[materials.NAME]", "", [materials.Material]),
    ("[links.NAME]", "", [links.LinkScene]),
    ("[links.NAME.mesh]", "", [links.Meshing]),
    ("[links.NAME.shape]", "", models(shapes.Shape)),
    ("section of a polyline", "", models(sections.SectionShape)),
    ("Items of an outline, holes", "", [outlines.Arc, outlines.Hole]),
    ("The file of a part", "It may have `[points]` of its own.", [shapes.PartGeometry]),
    ("[joints.NAME]", "", [joints.Joint]),
    (
        "A face by what it is",
        "One of `plane`, `cylinder`, `sphere`. What is missing or ambiguous is refused with the faces that the link\n"
        "has, each as it would be written here, nearest first.",
        [joints.ChosenFace],
    ),
    (
        "bushing of a joint",
        "One number for all directions, or three along the axes x, y, z of the joint. z is its `axis`; x is at right "
        "angles to z and to\nthat world axis which is farthest from it in the reference position (of equals "
        "the first), y at right angles "
        "to both. Without an `axis` they are\nthe world's in the reference position. They are fixed in the "
        "joint's second link, or the "
        "ground if that is one.",
        [joints.Bushing],
    ),
    ("[gears.NAME]", "", [drives.Gear]),
    ("[drive]", "Or several, as `[drives.NAME]`.", [drives.Drive]),
    ("[drive.motion]", "", models(drives.MotionLaw)),
    ("[motors.NAME]", "", [force_elements.Motor]),
    ("torque of a motor or a spring", "", [curves.TorqueCurve]),
    ("force of a motor", "", [curves.ForceCurve]),
    ("[springs.NAME]", "", models(force_elements.Spring)),
    ("force of a spring", "", [curves.PullCurve]),
    ("Ends of a spring", "", [force_elements.SpringEnd]),
    ("[limits.NAME]", "", models(force_elements.Limit)),
    ("[loads.NAME]", "", models(loads.Load)),
    ("factor of a load", "", [curves.Factor]),
    ("[bodies.NAME]", "", models(loads.Body)),
    ("[patterns.NAME]", "", [patterns.Pattern]),
    ("[damping]", "", [materials.Damping]),
    ("[analysis]", "", [analysis.Analysis]),
    ("[analysis.initial_motions.NAME]", "", [analysis.InitialMotion]),
    ("[analysis.initial_deflection.NAME]", "", [analysis.InitialForce]),
    ("[fatigue]", "See [fatigue.md](fatigue.md).", [fatigue.Fatigue]),
    ("[fatigue.materials.NAME], [fatigue.links.NAME]", "", [fatigue.FatigueData]),
    ("strain_life of a material", "", [fatigue.StrainLife]),
    ("[output]", "", [analysis.Output]),
    ("[output.animation]", "", [analysis.Animation]),
    ("[output.probes.NAME]", "", [analysis.Probe]),
]

NAMED = {
    dict[expressions.ParameterName, expressions.Parameter]: ("numbers, texts with units or expressions by name", ""),
    patterns.Entries: ("tables by name", ""),
    points.Point: ("point", "m"),
    points.JointPoint: ("point, or points by link", "m"),
    points.Axis: ("axis", ""),
    points.AccelerationVector: ("vector", "m/s²"),
    loads.ForceVector: ("vector", "N"),
    loads.TorqueVector: ("vector", "N m"),
    loads.BodyVector: ("vector", "N/m³"),
    loads.LineVector: ("vector", "N/m"),
    loads.SurfaceVector: ("vector", "Pa"),
    curves.FactorOver: ("number or curve", ""),
    curves.TorqueOver: ("number or curve", "N·m"),
    curves.ForceOver: ("number or curve", "N"),
    curves.PullOver: ("number or curve", "N"),
    curves.Abscissa: ("number", "s, rad/s, rad, m/s or m"),
    drives.DriveSpeed: ("number", "rad/s or m/s"),
    drives.AngleOrTravel: ("number", "rad or m"),
    drives.Period: ("number > 0", "s"),
    drives.PositiveAngleOrTravel: ("number > 0", "rad or m"),
    curves.Span: ("number", "s, rad/s, rad, m/s or m"),
    loads.Moments: ("3 or 6 × number", "kg·m²"),
    materials.Ratios: ("number or 2 × number ≥ 0, < 1", ""),
    joints.Rates: ("number or 3 × number > 0", "N/m"),
    joints.Dampers: ("number or 3 × number ≥ 0", "N·s/m"),
    joints.RotationalSprings: ("number or 3 × number > 0", "N·m/rad"),
    joints.RotationalDampers: ("number or 3 × number ≥ 0", "N·m·s/rad"),
    analysis.JointSpeed: ("number", "rad/s or m/s"),
    analysis.VelocityVector: ("vector", "m/s"),
    analysis.AngularVelocity: ("vector", "rad/s"),
}


def scene_reference() -> str:
    """The text of docs/scene.md."""
    built_in = ", ".join(f"`{name}`" for name in materials.BUILT_IN)
    parts = [
        INTRODUCTION.format(materials=built_in, longest=expressions.LONGEST_EXPRESSION, power=expressions.MOST_POWER)
    ]
    for heading, note, records in SECTIONS:
        example = f"\n```toml{EXAMPLES[heading]}```\n" if heading in EXAMPLES else ""
        parts.append(f"## {heading}\n" + (f"\n{note}\n" if note else "") + example)
        parts += [record_table(record, alone=len(records) == 1) for record in records]
    return "\n".join(parts)


def record_table(record: type[BaseModel], alone: bool) -> str:
    """The keys of a record as a Markdown table; under a heading if it is one of several."""
    kind = kind_of(record)
    about = (record.__doc__ or "").strip().splitlines()[0].replace("``", "`")
    title = "" if alone else f"### {f'kind = {chr(34)}{kind}{chr(34)}' if kind else construction(record)}\n\n"
    texts, names = meanings(record), {id(field): name for name, field in record.model_fields.items()}
    shown = [each for each in keys(record).items() if each[0] != "kind" or kind is None]
    shown.sort(key=lambda each: not each[1].is_required())  # what must be given first
    rows = [row(key, field, texts.get(names[id(field)], "")) for key, field in shown]
    header = "| key | value | unit | default | meaning |\n| --- | --- | --- | --- | --- |\n"
    return f"{title}{about}\n\n{header}" + "\n".join(rows) + "\n"


def construction(record: type[BaseModel]) -> str:
    """The keys that must be given, as the heading of a record without a kind."""
    return "`{ " + ", ".join(f"{key} =" for key, field in keys(record).items() if field.is_required()) + " }`"


def row(key: str, field: FieldInfo, meaning: str) -> str:
    """One key as a line of a table."""
    value, unit = described(field_hint(field))
    return f"| `{key}` | {value} | {unit} | {default(field)} | {' '.join(meaning.split())} |"


def described(hint: Any) -> tuple[str, str]:
    """What a value is, in words, and its unit."""
    for known, words in NAMED.items():
        if hint == known:
            return words
    quantity = next((extra for extra in getattr(hint, "__metadata__", ()) if isinstance(extra, Quantity)), None)
    if quantity is not None:
        return f"number{limits(quantity)}", unit_sign(quantity.unit)
    parts = [part for part in annotated_members(hint) if part is not type(None)]
    kinds = [plain_type(part) for part in parts]
    units = {unit for _, unit in kinds if unit}
    return " or ".join(dict.fromkeys(word for word, _ in kinds)), units.pop() if len(units) == 1 else ""


def annotated_members(hint: Any) -> list[Any]:
    """The alternatives of a type with their annotations."""
    while hasattr(hint, "__metadata__") and not any(isinstance(extra, Quantity) for extra in hint.__metadata__):
        if any(hint == known for known in NAMED):
            return [hint]
        hint = hint.__origin__
    return list(get_args(hint)) if get_origin(hint) in {Union, types.UnionType} else [hint]


def plain_type(hint: Any) -> tuple[str, str]:
    """A type that is not a number with a unit, in words, and the unit of numbers within it."""
    if hasattr(hint, "__metadata__") or len(annotated_members(hint)) > 1:
        return described(hint)
    inner = get_args(hint)
    if get_origin(hint) is Literal:
        return ", ".join(f'`"{word}"`' if isinstance(word, str) else f"`{word}`" for word in options(hint)), ""
    if get_origin(hint) is dict:
        return "tables by name" if models(inner[1]) else f"{described(inner[1])[0]}s by name", described(inner[1])[1]
    if get_origin(hint) is tuple:
        word, unit = described(inner[0])
        return (f"list: {word}" if inner[-1] is Ellipsis else f"{len(inner)} × {word}"), unit
    words = {str: "text", bool: "`true`, `false`", int: "whole number", float: "number"}
    return ("table" if models(hint) else words.get(hint, str(hint))), ""


def limits(quantity: Quantity) -> str:
    """The bounds of a number in signs."""
    signs = {">": quantity.above, "≥": quantity.least, "<": quantity.below, "≤": quantity.most}
    return ",".join(f" {sign} {bound:g}" for sign, bound in signs.items() if math.isfinite(bound))


def unit_sign(unit: str) -> str:
    """A unit as it is printed."""
    return "" if unit == "1" else unit.replace("^2", "²").replace("^3", "³").replace("^4", "⁴").replace("*", "·")


def default(field: FieldInfo) -> str:
    """The default of a key."""
    value = field.default
    if field.is_required():
        return "required"
    if value is PydanticUndefined or value is None or isinstance(value, BaseModel):
        return "—"
    if isinstance(value, float) and math.isnan(value):
        return "—"
    if isinstance(value, bool):
        return f"`{str(value).lower()}`"
    if isinstance(value, (tuple, list)):
        return f"`{[round(part, 12) for part in value]}`".replace(".0", "")
    return f'`"{value}"`' if isinstance(value, str) else f"`{value:.6g}`"


if __name__ == "__main__":
    sys.stdout.write(scene_reference())
