"""The table of capabilities: combinations of options that are refused, with the reason and an alternative.

A combination that no line of `REFUSALS` describes is allowed. The checks of scenes, docs/capabilities.md
(`capability_page`) and tests read this one table; a refusal is lifted by removing its line.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import get_args

from kedfem.errors import Fault, Where, place
from kedfem.scene.records.analysis import WITHOUT_VIBRATION
from kedfem.scene.records.joints import JointKind

Facts = Mapping[str, str]
"""Known factors of a part of a scene, and their levels."""

KINDS: tuple[str, ...] = get_args(JointKind)
TURNED = ("revolute", "cylindrical", "screw", "planar", "universal")  # kinds with angles, on which torques act
SLID = ("prismatic", "cylindrical", "screw", "planar", "slot")  # kinds with travels, along which forces act
DRIVEN = tuple(kind for kind in KINDS if kind in TURNED + SLID)  # kinds with either, which a drive may prescribe
GEARED = ("revolute", "cylindrical", "screw", "planar")  # kinds with a single angle, which gears couple
RACKED = ("prismatic", "cylindrical", "screw")  # kinds with a single travel, along which a rack may slide
ON_ANGLE, ON_TRAVEL, ON_DRIVE, ON_GEAR, ON_RACK = (
    f"{', '.join(kinds[:-1])} or {kinds[-1]}" for kinds in (TURNED, SLID, DRIVEN, GEARED, RACKED)
)
NO_ANGLE = "no other joint has an angle about an axis of its links"
NO_TRAVEL = "no other joint has a travel along a direction, or a line, of a link"
CONSTRAINED = "constraint equations"  # a joint that moves with both of its links
SHARED = "shared points"  # a joint whose links share points


def others(*kinds: str) -> tuple[str, ...]:
    """All other kinds of joint."""
    return tuple(kind for kind in KINDS if kind not in kinds)


@dataclass(frozen=True, slots=True)
class Refusal:
    """A combination that is refused; its texts may contain {words} of the part of a scene that has it.

    of : section of the scene whose parts may have it
    when : levels of factors that must all apply
    where : place that the message names
    must, why, got, take : the requirement, the reason, what was given, an alternative
    """

    of: str
    when: Mapping[str, tuple[str, ...]]
    where: str
    must: str
    why: str
    got: str
    take: str

    def meets(self, facts: Facts) -> bool:
        """Whether a part of a scene has this combination."""
        return all(facts.get(factor) in levels for factor, levels in self.when.items())

    def fault(self, where: Where, words: Mapping[str, str]) -> Fault:
        """The fault of a part of a scene at a place."""
        named = {**words, "where": place(where)}
        keys = (key.format_map(named) for key in self.where.removeprefix("{where}").split(".") if key)
        text = f"must {self.must} ({self.why}), got {self.got}: {self.take}".format_map(named)
        return Fault((*(where if self.where.startswith("{where}") else ()), *keys), text)


MOTOR = ", or a motor on the joint whose angle or travel the force depends on"
UNLIKE = Refusal("joints", {"joint": ("slot",), "bushing": ("unlike across the line",), "drive": ("none",)},
    "{where}.bushing", "be alike in all directions across the line of a slot in space that no drive moves",
    "its stations do not determine the rotation of the line about itself", "one that is not",
    "give it one stiffness and one damping, or take a drive")  # fmt: skip
REFUSALS = (
    UNLIKE,
    Refusal("joints", {"enforced": (CONSTRAINED,), "rho_inf": ("1",)}, "analysis.rho_inf",
        "be less than 1 with {where}", "its force would swing from step to step, and grow", "1", "take 0.95"),
    Refusal("joints", {"joint": ("spherical", "slot"), "bushing": ("against rotations",)},
        "{where}.bushing.rotational_stiffness", "be given for a joint that constrains rotations",
        "there is none that it could resist", "a {kind} joint, which leaves all free",
        "leave it out, or take another kind of joint"),
    Refusal("drives", {"joint": others(*DRIVEN)}, "{where}.joint", f"name a {ON_DRIVE} joint",
        "no other joint has an angle about an axis, or a travel along a direction or a line, of a link",
        "{name!r}, a {kind} joint", "drive a hinge or a slide beside it"),
    Refusal("drives", {"moves": ("travel",), "shaft": ("given",)}, "{where}.shaft_stiffness",
        "be given for an angle", "a shaft gives as it is twisted", "one for a travel of {name!r}, a {kind} joint",
        "take a bushing, or a spring along the slide"),
    Refusal("gears", {"element": ("gear",), "joint": others(*GEARED)}, "{where}",
        f"be a {ON_GEAR} joint, as joints of gears are", "these couple rotations about one axis each",
        "{name!r}, a {kind} joint", "take hinges"),
    Refusal("gears", {"element": ("rack",), "joint": others(*RACKED)}, "{where}",
        f"be a {ON_RACK} joint as the second joint of a rack", "a rack slides along one direction",
        "{name!r}, a {kind} joint", "take a slide, or a ratio instead of the radius"),
    Refusal("motors", {"element": ("torque",), "joint": others(*TURNED)}, "{where}.joint",
        f"name a {ON_ANGLE} joint for a torque", NO_ANGLE,
        "{name!r}, a {kind} joint", "take a force along a slide or slot, else loads of kind torque on its links"),
    Refusal("motors", {"element": ("force",), "joint": others(*SLID)}, "{where}.joint",
        f"name a {ON_TRAVEL} joint for a force", NO_TRAVEL,
        "{name!r}, a {kind} joint", "take a torque about a hinge, else loads of kind force on its links"),
    Refusal("springs", {"element": ("torsion",), "joint": others(*TURNED)}, "{where}.joint",
        f"name a {ON_ANGLE} joint", NO_ANGLE,
        "{name!r}, a {kind} joint", "take a bushing with rotational_stiffness"),
    Refusal("springs", {"element": ("along",), "joint": others(*SLID)}, "{where}.joint",
        f"name a {ON_TRAVEL} joint", NO_TRAVEL,
        "{name!r}, a {kind} joint", "take a spring between two points"),
    Refusal("limits", {"element": ("angle limit",), "joint": others(*TURNED)}, "{where}.joint",
        f"name a {ON_ANGLE} joint for an angle", NO_ANGLE,
        "{name!r}, a {kind} joint", "take a limit of a hinge beside it"),
    Refusal("limits", {"element": ("travel limit",), "joint": others(*SLID)}, "{where}.joint",
        f"name a {ON_TRAVEL} joint for a travel", NO_TRAVEL,
        "{name!r}, a {kind} joint", "take a limit of a slide beside it"),
    Refusal("limits", {"moved": ("prescribed",)}, "{where}.joint", "name a joint that no drive moves",
        "a drive prescribes how far its joint goes", "{name!r}, which is driven", "limit another joint, or take a motor"),
    Refusal("analysis", {"element": ("limit",), "levels": ("several",)}, "{where}.extrapolation_levels",
        "be 1 with limits", "levels are combined where motion is smooth in time, and it is not where stops are met",
        "more with {elements}", "take a smaller step"),
    Refusal("analysis", {"drive": ("none",), "frames": ("rigid-body",)}, "{where}.frames",
        "be 'co-rotational' in a scene without a drive", "there is no rigid-body motion", "'rigid-body'",
        "leave it out, or give a drive"),
    Refusal("links", {"drive": ("none",), "frames": ("rigid-body",)}, "{where}.frames",
        "be 'co-rotational' in a scene without a drive", "there is no rigid-body motion", "'rigid-body'",
        "leave it out, or give a drive"),
    Refusal("analysis", {"stiffening": ("on",), "every link": ("co-rotational",)}, "{where}.stiffening",
        "be combined with rigid-body frames", "co-rotational ones know all of it", "it with co-rotational frames",
        "leave stiffening out"),
    *(Refusal("analysis", {"frames": ("rigid-body",), "start": (key,)}, f"{{where}}.{key}",
        'be combined with frames = "co-rotational"', "rigid-body ones begin as the drive moves them",
        "{given} with rigid-body ones",
        'take frames = "co-rotational"') for key in ("initial_speeds", "initial_motions")),
    Refusal("analysis", {"kind": ("steady",), "drive": ("none",)}, "{where}.kind", "be combined with a drive as 'steady'",
        "a mechanism that moves freely has no period", "'steady' without one", "give a drive, or take 'transient'"),
    Refusal("analysis", {"kind": ("quasi-static",), "drive": ("none",)}, "{where}.kind",
        "be combined with a drive as 'quasi-static'", "nothing else says how a mechanism moves on", "it without one",
        "give a drive, or take 'static' or 'transient'"),
    Refusal("analysis", {"kind": ("steady", *WITHOUT_VIBRATION), "solver": ("monolithic",)}, "{where}.solver",
        "be 'condensed' for a {kind} analysis", "the monolithic solver marches from a start", "'monolithic'",
        "leave it out"),
    Refusal("analysis", {"kind": WITHOUT_VIBRATION, "levels": ("several",)}, "{where}.extrapolation_levels",
        "be left out of a {kind} analysis", "which has no time steps", "more than 1", "leave it out"),
    Refusal("analysis", {"kind": ("steady",), "rho_inf": ("1",)}, "{where}.rho_inf", "be less than 1 for a steady motion",
        "vibrations that a step cannot resolve would have no end", "1", "take 0.95"),
    *(Refusal("analysis", {"kind": ("steady", *WITHOUT_VIBRATION), "start": (key,)}, f"{{where}}.{key}",
        "be left out of a {kind} analysis", "which does not depend on how the motion began", "{given}",
        "leave it out, or take kind = 'transient'")
        for key in ("initial_speeds", "initial_motions", "initial_deflection")),
    Refusal("analysis", {"start": ("initial_deflection",), "drive": ("given",), "beside": ("rest",)}, "{where}.initial",
        "be 'quasi-static' with an initial deflection and a drive", "these forces deflect links beside their motion",
        "'rest'", 'take initial = "quasi-static"'),
    Refusal("analysis", {"start": ("initial_deflection",), "beside": ("speeds",)}, "{where}.initial_deflection",
        "not be combined with initial speeds and motions", "the release is from rest", "{given}",
        "take one of them, or loads that end soon"),
    *(Refusal("analysis", {"drive": ("none",), "time": (key,)}, f"{{where}}.{key}", "be combined with a drive",
        "it counts the drive's revolutions", "a scene without one", f"take {instead} [s]")
        for key, instead in (("revolutions", "end_time"), ("steps_per_revolution", "step"))),
    Refusal("fatigue", {"drive": ("none",), "period": ("none",)}, "{where}.period", "be given without a drive",
        "nothing else says after which time stresses repeat", "nothing", "give it [s], or a drive, or leave fatigue out"),
    Refusal("loads", {"element": ("surface",), "link": ("beam",)}, "{where}.link",
        "name a solid or a plane link for a surface load", "a beam takes forces on its axis", "{name!r}, a {noun}",
        "take a load of kind line, or of kind pressure"),
    Refusal("loads", {"element": ("pressure",), "link": ("beam", "rigid"), "section": ("round", "tube", "constants")},
        "{where}.link", "name a link with flat sides for a pressure",
        "a section that is round, or given by constants, has none",
        "{name!r}, which is of section {section!r}", "take a load of kind line"),
    Refusal("loads", {"element": ("pressure",), "link": ("beam", "rigid"), "line": ("smooth",)}, "{where}.link",
        "name a link with flat sides for a pressure", "those of a smooth line are curved", "{name!r}, which is smooth",
        "take a load of kind line"),
    Refusal("loads", {"element": ("line",), "link": ("solid", "plane")}, "{where}.link",
        "name a beam or a rigid link for a load along a line", "a solid and a plane link have faces, and no axis",
        "{name!r}, a {noun}", "take a load of kind surface or pressure"),
    *(Refusal("loads", {"element": (kind,), "link": ("slider",)}, "{where}.link",
        f"name a link with a shape for a {noun}", "a slider without a shape is a point", "{name!r}, a slider",
        "take a load of kind force, or give it a shape")
        for kind, noun in (("surface", "surface load"), ("pressure", "pressure"), ("line", "load along a line"))),
    Refusal("loads", {"element": ("torque",), "link": ("slider",)}, "{where}.link",
        "name a link with a shape for a torque", "a slider without a shape has no rotation", "{name!r}, a slider",
        "give it a shape"),
    Refusal("loads", {"element": ("body",), "link": ("slider",)}, "{where}.link",
        "name a link with a shape for a body load", "a slider without a shape has no volume",
        "{name!r}, a slider", "take a load of kind force, or give it a shape"),
    *(Refusal(section, {"factor": over, "driven": (driven,)}, f"{{where}}.{key}.over", must, why, got, take + also)
        for section, key, also in (("loads", "factor", MOTOR), ("springs", "stiffness_factor", ""))
        for over, driven, must, why, got, take in (
            (("angle", "travel"), "nothing", "be combined with a drive over whose angle or travel it is",
             "no other is prescribed", "a scene without one", "take a factor over time"),
            (("angle", "travel"), "several", "be combined with one drive over whose angle or travel it is",
             "it does not say which", "several", "take a factor over time"),
            (("angle",), "travel", "be over the travel of a drive that prescribes one", "it has no angle", "an angle",
             "take 'travel'"),
            (("travel",), "angle", "be over the angle of a drive that prescribes one", "it has no travel", "a travel",
             "take 'angle'"))),
)  # fmt: skip


def refusals(of: str, facts: Facts) -> Iterator[Refusal]:
    """All lines of the table that apply to a part of a section of the scene."""
    return (each for each in REFUSALS if each.of == of and each.meets(facts))
