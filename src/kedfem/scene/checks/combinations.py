"""Combinations of options in a scene that the table of capabilities refuses."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

from kedfem.errors import Fault, Where
from kedfem.scene.checks.capabilities import CONSTRAINED, SHARED, Facts, refusals
from kedfem.scene.checks.drives import driven_coordinate
from kedfem.scene.checks.parts import Entry, Parts, category, link_names
from kedfem.scene.questions.enforced import enforced_by_equations
from kedfem.scene.questions.modelling import default_frames
from kedfem.scene.questions.planes import spatial_beams
from kedfem.scene.records.joints import Bushing
from kedfem.scene.records.wording import NOUNS, shown

Reported = tuple[str, Facts, Where, Mapping[str, str]]
"""Section of a part of a scene, its factors, its place, and words for messages."""


def combination_faults(parts: Parts) -> Iterator[Fault]:
    """All combinations of the scene that the table of capabilities refuses."""
    common = common_facts(parts)
    for reported in (joints, drives, gears, elements, analysis, fatigue, links, loads):
        for of, facts, where, words in reported(parts):
            for refusal in refusals(of, {**common, **facts}):
                yield refusal.fault(where, words)


def frames_of(parts: Parts, link: Entry | None = None) -> str:
    """Frames of a link, or of the analysis: as given, else the default."""
    own = None if link is None else link.word("frames")
    return own or parts.analysis.word("frames") or default_frames(parts.driven)


def common_facts(parts: Parts) -> dict[str, str]:
    """Factors of the whole scene."""
    record = parts.analysis.record
    every = [frames_of(parts, link) == "co-rotational" for link in parts.links.values()]
    return {
        "every link": "co-rotational" if all(every) else "",
        "frames": "co-rotational" if any(every) else "rigid-body",
        "stiffening": "on" if parts.analysis.raw.get("stiffening") is True else "off",
        "drive": "given" if parts.driven else "none",
        "rho_inf": "1" if record is not None and record.rho_inf == 1.0 else "below 1",
        "solver": parts.analysis.word("solver") or "condensed",
    }


def joints(parts: Parts) -> Iterator[Reported]:
    """Valid joints: how each is enforced, and its bushing."""
    for joint in parts.joints.values():
        if joint.record is not None:
            kind, bushing = joint.record.kind, joint.record.bushing
            facts = {"joint": kind, "bushing": "none"}
            facts["enforced"] = CONSTRAINED if enforced_by_equations(parts.good, joint.name) else SHARED
            if bushing is not None and bushing.rotational_stiffness is not None:
                facts["bushing"] = "against rotations"
            elif bushing is not None and kind == "slot" and unlike_across(bushing) and in_space(parts, joint):
                facts["bushing"] = "unlike across the line"
            yield "joints", facts, joint.where, {"kind": kind}


def in_space(parts: Parts, joint: Entry) -> bool:
    """Whether a link of a joint is neither a plane link nor a planar beam."""
    links = [parts.links[name] for name in link_names(joint) if name in parts.links]
    planar = {"plane"} if spatial_beams(parts.good).intersection(link_names(joint)) else {"plane", "beam"}
    return any(category(link) not in planar for link in links)


def unlike_across(bushing: Bushing) -> bool:
    """Whether stiffness or damping of a bushing differs between the directions across its axis."""
    return any(each is not None and each[0] != each[1] for each in (bushing.stiffness, bushing.damping))


def on_joint(parts: Parts, name: str | None) -> tuple[dict[str, str], dict[str, str]]:
    """Factors and words of the joint of a drive, gear, motor, spring or limit."""
    joint = parts.joints.get(name or "")
    if joint is None:
        return {}, {}
    kind = str(joint.word("kind"))
    return {"joint": kind}, {"name": joint.name, "kind": kind}


def drives(parts: Parts) -> Iterator[Reported]:
    """Drives, the coordinates that they prescribe, and their shafts."""
    for drive in parts.all_drives:
        facts, words = on_joint(parts, drive.word("joint"))
        shaft = "given" if drive.has("shaft_stiffness") else "none"
        moves = driven_coordinate(drive, facts.get("joint", ""))
        yield "drives", {**facts, "shaft": shaft, "moves": moves}, drive.where, words


def driven(parts: Parts) -> dict[str, str]:
    """The coordinate that the only drive prescribes, on which a factor may depend."""
    if len(parts.all_drives) != 1:
        return {"driven": "several" if parts.all_drives else "nothing"}
    drive = parts.all_drives[0]
    joint = parts.joints.get(drive.word("joint") or "")
    return {"driven": "" if joint is None else driven_coordinate(drive, str(joint.word("kind")))}


def gears(parts: Parts) -> Iterator[Reported]:
    """The joints of gears."""
    for gear in parts.gears.values():
        names = gear.raw.get("joints")
        if not isinstance(names, (list, tuple)) or len(names) != 2:
            continue
        for i, name in enumerate(names):
            facts, words = on_joint(parts, name if isinstance(name, str) else None)
            element = "rack" if gear.has("radius") and i == 1 else "gear"
            yield "gears", {**facts, "element": element}, (*gear.where, "joints", i), words


def elements(parts: Parts) -> Iterator[Reported]:
    """Motors, springs and limits on joints."""
    for motor in parts.motors.values():
        facts, words = on_joint(parts, motor.word("joint"))
        element = next((key for key in ("torque", "force") if motor.has(key)), "")
        yield "motors", {**facts, "element": element}, motor.where, words
    for spring in parts.springs.values():
        facts, words = on_joint(parts, spring.word("joint"))
        element = "torsion" if spring.word("kind") == "torsion" else "along"
        factor = spring.word("stiffness_factor", "over") or ""
        facts |= {"element": element, "factor": factor, **driven(parts)}
        yield "springs", facts, spring.where, words
    for limit in parts.limits.values():
        facts, words = on_joint(parts, limit.word("joint"))
        moved = "prescribed" if limit.word("joint") in parts.driven_joints else "free"
        facts |= {"element": f"{limit.word('kind')} limit", "moved": moved}
        yield "limits", facts, limit.where, words


def analysis(parts: Parts) -> Iterator[Reported]:
    """The analysis: its kind, frames, start and times."""
    entry = parts.analysis
    at = entry.where
    if parts.limits:
        levels = "several" if entry.record is not None and (entry.record.extrapolation_levels or 1) > 1 else "one"
        yield "analysis", only(element="limit", levels=levels), at, {"elements": shown(list(parts.limits))}
    yield "analysis", {"drive": ""}, at, {}
    yield from kinds(parts)
    if entry.word("frames"):
        yield "analysis", only(frames=str(entry.word("frames"))), at, {}
    if entry.word("initial"):
        yield "analysis", only(start=str(entry.word("initial"))), at, {}
    for key in ("revolutions", "steps_per_revolution"):
        if entry.has(key):
            yield "analysis", only(time=key), at, {}
    for key in ("initial_speeds", "initial_motions"):
        speeds = entry.raw.get(key)
        if isinstance(speeds, Mapping) and speeds and parts.links:
            facts = {"start": key, "stiffening": "", "solver": "", "drive": ""}
            yield "analysis", facts, at, {"given": shown(list(speeds))}
    forces = entry.raw.get("initial_deflection")
    if isinstance(forces, Mapping) and forces:
        speeds = any(entry.raw.get(key) for key in ("initial_speeds", "initial_motions"))
        for each in (*(["speeds"] if speeds else []), entry.word("initial") or "rest"):
            facts = {"start": "initial_deflection", "beside": each, "frames": "", "solver": ""}
            yield "analysis", facts, at, {"given": shown(list(forces))}


def kinds(parts: Parts) -> Iterator[Reported]:
    """Steady motions and positions without vibration: their solver, levels and start."""
    entry = parts.analysis
    kind = entry.word("kind") or "transient"
    if kind == "transient":
        return
    facts, words = only(kind=kind), {"kind": kind}
    yield "analysis", facts | {"solver": entry.word("solver") or "condensed"}, entry.where, words
    levels = "one" if entry.record is None or (entry.record.extrapolation_levels or 1) == 1 else "several"
    yield "analysis", {**facts, "drive": "", "rho_inf": "", "levels": levels}, entry.where, words
    for key in ("initial_speeds", "initial_motions", "initial_deflection"):
        given = entry.raw.get(key)
        if isinstance(given, Mapping) and given:
            more = {"start": key, "drive": "", "rho_inf": ""}
            yield "analysis", {**facts, **more}, entry.where, {**words, "given": shown(list(given))}


def fatigue(parts: Parts) -> Iterator[Reported]:
    """Damage over a period."""
    if parts.fatigue.where:
        period = "given" if parts.fatigue.has("period") else "none"
        yield "fatigue", only(period=period), parts.fatigue.where, {}


def only(**facts: str) -> dict[str, str]:
    """Factors of one key of the analysis, without those of others, which are reported with these."""
    return {"frames": "", "stiffening": "", "solver": "", **facts}


def links(parts: Parts) -> Iterator[Reported]:
    """Links with their own frames."""
    for link in parts.links.values():
        if link.word("frames") and not slider(link):
            yield "links", {"frames": str(link.word("frames"))}, link.where, {}


def loads(parts: Parts) -> Iterator[Reported]:
    """Loads, the links on which they act, and their factors."""
    for load in parts.loads.values():
        link = parts.links.get(load.word("link") or "")
        if link is None:
            continue
        kind = "slider" if slider(link) else category(link)
        facts = {"element": str(load.word("kind")), "link": kind}
        section, smooth = link.word("shape", "section", "kind") or "", link.given("shape", "smooth") is True
        facts |= {"section": section, "line": "smooth" if smooth else "straight"}
        words = {"name": link.name, "noun": NOUNS.get(kind, kind), "section": section}
        facts |= {"factor": load.word("factor", "over") or "", **driven(parts)}
        yield "loads", facts, load.where, words


def slider(link: Entry) -> bool:
    """Whether a link is rigid and has no shape."""
    return category(link) == "rigid" and not link.has("shape")
