"""Cross checks of frames, motors, springs, initial velocities, and of scenes without a drive; each yields fault lines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, get_args

from kedfem.scene.checks import fidelity, link_names
from kedfem.scene.damping import rayleigh
from kedfem.scene.drives import SLIDING, TURNING
from kedfem.scene.frames import default_frames
from kedfem.scene.links import GROUND, Joint
from kedfem.scene.parts import Entry, Parts
from kedfem.scene.units import Quantity, si_number
from kedfem.scene.wording import shown, unknown_name

EVERY_JOINT = frozenset(get_args(Joint.model_fields["kind"].annotation))
TURNED = ("revolute", "cylindrical", "screw")  # kinds with one turn, which a torque or torsion spring acts on
SLID = ("prismatic", "cylindrical")  # and one travel along the same axis
AXES = {"revolute": TURNING, "prismatic": SLIDING}  # joints with one motion, and its speed


def frames_of(parts: Parts, link: Entry | None = None) -> str:
    """Frames of a link, or of the analysis, as given or left open."""
    own = None if link is None else link.word("frames")
    return own or parts.analysis.word("frames") or default_frames(parts.driven)


def any_following(parts: Parts) -> bool:
    """Whether any link has frames that follow it."""
    return any(frames_of(parts, link) == "following" for link in parts.links.values())


def frame_faults(parts: Parts) -> Iterator[str]:
    """Frames and segments that do not suit a link or the analysis."""
    if not parts.driven and parts.analysis.word("frames") == "nominal":
        yield parts.analysis.fault("frames", "must be 'following' in a scene without a drive, got 'nominal'")
    if parts.analysis.raw.get("stiffening") is True and any_following(parts):
        wanted = "must stand with nominal frames (those that follow know all of it)"
        yield parts.analysis.fault("stiffening", f"{wanted}, got it with frames that follow")
    if parts.analysis.raw.get("stiffening") is True and (parts.motors or parts.springs):
        wanted = "must stand without motors and springs, whose stresses it does not know"
        yield parts.analysis.fault("stiffening", f"{wanted}, got {shown([*parts.motors, *parts.springs])}")
    if parts.analysis.word("solver") == "literal" and any_following(parts):
        yield parts.analysis.fault("solver", "must be 'condensed' for frames that follow, got 'literal'")
    for link in parts.links.values():
        if fidelity(link) == "rigid" and not link.has("shape"):
            for key in ("frames", "segments"):
                if link.has(key):
                    got = shown(link.raw[key])
                    yield link.fault(key, f"must be left out for a rigid link without a shape, got {got}")
            continue
        if not parts.driven and link.word("frames") == "nominal":
            yield link.fault("frames", "must be 'following' in a scene without a drive, got 'nominal'")
        yield from segment_faults(parts, link)


def segment_faults(parts: Parts, link: Entry) -> Iterator[str]:
    """A number of segments where there is nothing to cut."""
    if not link.has("segments"):
        return
    got = f"got {shown(link.raw['segments'])}"
    if fidelity(link) == "rigid":
        yield link.fault("segments", f"must be left out for a rigid link (it is one segment), {got}")
    elif fidelity(link) == "beam":
        yield link.fault("segments", f"must be left out for a beam: its elements are its segments, {got}")
    elif frames_of(parts, link) == "nominal":
        yield link.fault("segments", f"must stand with frames that follow, {got} with nominal ones")


def motor_faults(parts: Parts) -> Iterator[str]:
    """Motors on joints that they cannot move."""
    for motor in parts.motors.values():
        joint = joint_of(parts, motor)
        if motor.word("joint") and parts.joints and joint is None:
            yield motor.fault("joint", unknown_name("a joint", str(motor.word("joint")), parts.joints))
        if joint is None:
            continue
        kind, key = joint.word("kind"), "torque" if motor.has("torque") else "force"
        wanted = TURNED if key == "torque" else SLID
        if kind in EVERY_JOINT - {*wanted} and motor.has(key):
            got = f"got {joint.name!r}, which is {kind}"
            yield motor.fault("joint", f"must name a {' or '.join(wanted)} joint for a {key}, {got}")
        elif key == "force" and motor.has(key):
            yield from slide_faults(parts, motor, joint)


def slide_faults(parts: Parts, entry: Entry, joint: Entry) -> Iterator[str]:
    """A motor or spring along a slide that turns, with frames that do not know how."""
    if GROUND not in link_names(joint) and not any_following(parts):
        wanted = 'must name a slide on the ground, or stand with frames = "following"'
        reason = "with nominal ones its force would keep the direction as drawn while the slide turns"
        yield entry.fault("joint", f"{wanted} ({reason}), got {joint.name!r}")


def spring_faults(parts: Parts) -> Iterator[str]:
    """Springs on links or joints that do not exist, or that they cannot move."""
    for spring in parts.springs.values():
        if spring.word("kind") == "torsion" or spring.has("joint"):
            yield from joint_spring_faults(parts, spring)
            continue
        names = end_links(spring)
        for i, name in enumerate(names):
            if name is not None and parts.links and name not in parts.links and name != GROUND:
                known = [*parts.links, GROUND]
                yield spring.fault("between", unknown_name("a link", name, known), i, "link")
        if names == [GROUND, GROUND]:
            yield spring.fault("between", "must hold a link, got the ground twice")


def joint_spring_faults(parts: Parts, spring: Entry) -> Iterator[str]:
    """A torsion spring on a joint that has no turn, or one along what is no slide."""
    joint = joint_of(parts, spring)
    if joint is None:
        if spring.word("joint") and parts.joints:
            yield spring.fault("joint", unknown_name("a joint", str(spring.word("joint")), parts.joints))
        return
    kind = joint.word("kind")
    wanted = TURNED if spring.word("kind") == "torsion" else SLID
    if kind in EVERY_JOINT - {*wanted}:
        kinds = " or ".join(wanted)
        yield spring.fault("joint", f"must name a {kinds} joint, got {joint.name!r}, which is {kind}")
    elif spring.word("kind") != "torsion":
        yield from slide_faults(parts, spring, joint)


def joint_of(parts: Parts, entry: Entry) -> Entry | None:
    """The joint that an entry names."""
    return parts.joints.get(entry.word("joint") or "")


def end_links(spring: Entry) -> list[str | None]:
    """The links at the ends of a spring between two points, as given."""
    ends = spring.raw.get("between")
    given = ends if isinstance(ends, (list, tuple)) else ()
    words = [end.get("link") if isinstance(end, Mapping) else None for end in given]
    return [word if isinstance(word, str) else None for word in words]


def initial_faults(parts: Parts) -> Iterator[str]:
    """Velocities at the start of what has none of its own."""
    for key, known, what in (
        ("initial_speeds", parts.joints, "a joint"),
        ("initial_motions", parts.links, "a link"),
    ):
        given = parts.analysis.raw.get(key)
        if not isinstance(given, Mapping) or not given:
            continue
        if parts.links and not any_following(parts):
            yield parts.analysis.fault(
                key, f'must stand with frames = "following", got {shown(list(given))} with nominal ones'
            )
        for name in given if known else ():
            if name not in known:
                yield parts.analysis.fault(key, unknown_name(what, str(name), known), str(name))
            elif key == "initial_speeds":
                yield from speed_faults(parts, parts.joints[name], given[name])


def speed_faults(parts: Parts, joint: Entry, given: Any) -> Iterator[str]:
    """A speed of a joint that has none, that the drive moves, or in a unit of another kind."""
    kind = joint.word("kind")
    if kind in {"spherical", "weld"}:
        got = f"got {joint.name!r}, which is {kind}"
        message = f"must be of a revolute or prismatic joint, {got}"
        yield parts.analysis.fault("initial_speeds", message, joint.name)
    elif joint.name in parts.driven_joints:
        message = f"must be of a joint that the drive does not move, got {joint.name!r}"
        yield parts.analysis.fault("initial_speeds", message, joint.name)
    elif kind in AXES and isinstance(given, str) and not in_unit(given, AXES[kind]):
        message = f"must be {AXES[kind].kind} for a {kind} joint, got {given!r}"
        yield parts.analysis.fault("initial_speeds", message, joint.name)


def in_unit(text: str, quantity: Quantity) -> bool:
    """Whether a text is a number with a unit of one kind; one that is no number at all has its fault already."""
    others = [other for other in AXES.values() if other != quantity]
    return readable(text, quantity) or not any(readable(text, other) for other in others)


def readable(text: str, quantity: Quantity) -> bool:
    """Whether a text is a number with a unit."""
    try:
        si_number(text, quantity.unit)
    except ValueError:
        return False
    return True


def undriven_faults(parts: Parts) -> Iterator[str]:
    """What only makes sense with a drive, in a scene without one."""
    if parts.driven:
        return
    analysis = parts.analysis
    for key, instead in (("turns", "end_time"), ("steps_per_turn", "step")):
        if analysis.has(key):
            yield analysis.fault(key, f"needs a drive (else {instead} [s]), got a scene without one")
    if analysis.word("initial") == "quasi-static":
        yield analysis.fault("initial", "must be 'rest' in a scene without a drive, got 'quasi-static'")
    drawn = parts.animation.record
    if drawn is not None and drawn.exaggeration != 1.0:
        message = "must be 1 in a scene without a drive, which has no motion that it deviates from"
        yield parts.animation.fault("exaggeration", f"{message}, got {drawn.exaggeration:g}")
    yield from drag_faults(parts)


def drag_faults(parts: Parts) -> Iterator[str]:
    """Damping in proportion to the mass, where no nominal motion tells the motion that it should leave alone."""
    damping = parts.damping
    alpha, beta = (0.0, 0.0) if damping.record is None else rayleigh(damping.record)
    if alpha:
        key = "ratio" if damping.has("ratio") else "alpha"
        wanted = f"must be given as beta alone in a scene without a drive, such as beta = {beta:.3g} [s]"
        yield damping.fault(
            key, f"{wanted}: alpha resists the motion as a whole, got alpha = {alpha:.3g} 1/s"
        )
