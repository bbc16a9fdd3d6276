"""What a scene combines, in the factors of the table of capabilities: what it refuses of them."""

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
"""Section, factors, place and words of a part of a scene."""


def combination_faults(parts: Parts) -> Iterator[Fault]:
    """All combinations of the scene that the table of capabilities refuses."""
    common = common_facts(parts)
    for reported in (joints, drives, gears, elements, analysis, fatigue, links, loads):
        for of, facts, where, words in reported(parts):
            for refusal in refusals(of, {**common, **facts}):
                yield refusal.fault(where, words)


def frames_of(parts: Parts, link: Entry | None = None) -> str:
    """Frames of a link, or of the analysis, as given or left open."""
    own = None if link is None else link.word("frames")
    return own or parts.analysis.word("frames") or default_frames(parts.driven)


def common_facts(parts: Parts) -> dict[str, str]:
    """What the whole scene says."""
    record = parts.analysis.record
    every = [frames_of(parts, link) == "co-rotational" for link in parts.links.values()]
    following = any(every)
    return {
        "every link": "co-rotational" if all(every) else "",
        "frames": "co-rotational" if following else "rigid-body",
        "stiffening": "on" if parts.analysis.raw.get("stiffening") is True else "off",
        "drive": "given" if parts.driven else "none",
        "rho_inf": "1" if record is not None and record.rho_inf == 1.0 else "below 1",
        "solver": parts.analysis.word("solver") or "condensed",
    }


def joints(parts: Parts) -> Iterator[Reported]:
    """Good joints: how each is enforced."""
    moving = {name for name in parts.good.joints if enforced_by_equations(parts.good, name)}
    slots = (joint for joint in parts.joints.values() if joint.word("kind") == "slot")
    spatial = spatial_beams(parts.good) if any(x.has("bushing") for x in slots) else frozenset[str]()
    for joint in parts.joints.values():
        kind, held = str(joint.word("kind")), [parts.links[x] for x in link_names(joint) if x in parts.links]
        facts = {"joint": kind}
        words = {"kind": kind, "key": "kind"}
        if joint.record is None:
            yield "joints", facts, joint.where, words
            continue
        facts["enforced"] = CONSTRAINED if joint.name in moving else SHARED
        driven = "driven " if joint.name in parts.driven_joints else ""
        words["noun"] = f"a {driven}{kind} joint"
        if joint.record.bushing is not None:
            words |= {"key": "bushing", "noun": "one"}
            turns = joint.record.bushing.rotational_stiffness is not None
            facts["bushing"] = "against rotations" if turns else "given"
            if kind == "slot" and not turns and unlike_across(joint.record.bushing):
                planar = all(category(x) == "plane" or (category(x) == "beam" and x.name not in spatial) for x in held)
                facts["bushing"] = "given" if planar else "unlike across the line"
        yield "joints", facts, joint.where, words


def unlike_across(bushing: Bushing) -> bool:
    """Whether a bushing gives way across its axis in one direction more than in another."""
    return any(each is not None and each[0] != each[1] for each in (bushing.stiffness, bushing.damping))


def on_joint(parts: Parts, name: str | None) -> tuple[dict[str, str], dict[str, str]]:
    """What a drive, gear, motor or spring is on."""
    joint = parts.joints.get(name or "")
    if joint is None:
        return {}, {}
    kind = str(joint.word("kind"))
    return {"joint": kind}, {"name": joint.name, "kind": kind}


def drives(parts: Parts) -> Iterator[Reported]:
    """Drives, the coordinates that they prescribe and their shafts."""
    for drive in parts.all_drives:
        facts, words = on_joint(parts, drive.word("joint"))
        shaft = "given" if drive.has("shaft_stiffness") else "none"
        moves = driven_coordinate(drive, facts.get("joint", ""))
        yield "drives", {**facts, "shaft": shaft, "moves": moves}, drive.where, words


def driven(parts: Parts) -> dict[str, str]:
    """What the only drive prescribes, whose angle or travel a factor may be over."""
    if len(parts.all_drives) != 1:
        return {"driven": "several" if parts.all_drives else "nothing"}
    drive = parts.all_drives[0]
    joint = parts.joints.get(drive.word("joint") or "")
    return {"driven": "" if joint is None else driven_coordinate(drive, str(joint.word("kind")))}


def gears(parts: Parts) -> Iterator[Reported]:
    """Gears as a whole, and their joints."""
    for gear in parts.gears.values():
        yield "gears", {}, gear.where, {}
        names = gear.raw.get("joints")
        if not isinstance(names, (list, tuple)) or len(names) != 2:
            continue
        for i, name in enumerate(names):
            facts, words = on_joint(parts, name if isinstance(name, str) else None)
            element = "rack" if gear.has("radius") and i == 1 else "gear"
            yield "gears", {**facts, "element": element, "stiffening": ""}, (*gear.where, "joints", i), words


def elements(parts: Parts) -> Iterator[Reported]:
    """Motors, springs on joints, and limits of these."""
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
    """The analysis with its start and times."""
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
    """What a steady motion, and positions without vibration, are combined with."""
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
    """Factors of one key of the analysis, beside which those of others were reported already."""
    return {"frames": "", "stiffening": "", "solver": "", **facts}


def links(parts: Parts) -> Iterator[Reported]:
    """Links with frames of their own."""
    for link in parts.links.values():
        if link.word("frames") and not slider(link):
            yield "links", {"frames": str(link.word("frames"))}, link.where, {}


def loads(parts: Parts) -> Iterator[Reported]:
    """Loads on kinds of links, and their factors."""
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
