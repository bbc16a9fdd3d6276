"""Tables and key figures of a report, from results and their scene."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from kedfem.accuracy.error_budget import OF_SOURCE, TOGETHER, UNKNOWN, percent
from kedfem.output.words import known_names, number_in, place_of, unstrained, with_prefix
from kedfem.results import Fatigue, FatigueSpot, Peak, Results
from kedfem.results.frequencies import Summary
from kedfem.scene import percentage

STEADY = "steady "  # first word of the notes of a steady motion
ENDLESS = 1e15  # revolutions, taken as endless
SPOTS = 3  # places of the highest damage of each link

Rows = list[tuple[str, ...]]


@dataclass(frozen=True, slots=True)
class Table:
    """A table of the page.

    title : its title
    head : names of its columns; empty for a table of names and values
    rows : texts; the first of each is a name
    note : text below it
    """

    title: str
    head: tuple[str, ...]
    rows: Rows
    note: str = ""


@dataclass(frozen=True, slots=True)
class Fact:
    """A key figure: its name, its value as text, and details."""

    name: str
    value: str
    more: str = ""


def facts(results: Results, highest: Peak | None, moment: Callable[[float, float], str]) -> list[Fact]:
    """The key figures of a run."""
    out = []
    if highest is not None:
        more = f"link {highest.link}, {moment(highest.time, highest.angle)}"
        if highest.near:
            more += f"; at {highest.near}"
            more += f", away from it {with_prefix(highest.away.stress, 'Pa')}" if highest.away else ""
        if np.isfinite(highest.strength):
            more += f"; {_share(highest)} of the yield strength"
        out.append(Fact("Highest von Mises stress", with_prefix(highest.stress, "Pa"), more))
    for what, beginning, endings in (
        ("Largest joint force", "joints/", ("/force",)),
        ("Largest drive effort", "drive/", ("torque", "/force")),
        ("Largest elastic displacement", "probes/", ("/displacement", "/deflection")),
    ):
        if found := _largest(results, beginning, endings):
            name, value, unit, when = found
            message = f"{name}, {moment(*when)}"
            out.append(Fact(what, with_prefix(value, unit), message))
    if results.fatigue is not None and (spot := results.fatigue.worst) is not None:
        message = f"link {spot.link}; life {life_of(spot, results.fatigue)}"
        message += "; unreliable, see below" if results.fatigue.unreliable else ""
        out.append(Fact("Highest utilisation in fatigue", percent(spot.utilisation), message))
    if errors := _noted(results.notes, TOGETHER):
        worst = max(errors, key=lambda kind: errors[kind])
        out.append(Fact("Estimated error", percent(errors[worst]), f"of {worst}, the largest; see below"))
    return out


def _largest(
    results: Results, beginning: str, endings: tuple[str, ...]
) -> tuple[str, float, str, tuple[float, float]] | None:
    """Description, largest magnitude, unit, and time and drive position of the largest of some channels."""
    found = None
    for name in results.channels:
        if not (name.startswith(beginning) and name.endswith(endings)) or "rigid_" in name:
            continue
        channel, (time, angle, values) = results.channels[name][0], results.largest_rows(name)
        size = np.linalg.norm(values, axis=1)
        if np.isfinite(size).any() and (found is None or np.nanmax(size) > found[1]):
            k = int(np.nanargmax(size))
            what, when = channel.description.partition(";")[0] or name, (float(time[k]), float(angle[k]))
            found = what, float(size[k]), channel.unit, when
    return found


def links_table(scene: Mapping[str, Any], results: Results) -> Table:
    """Model and material of each link."""
    rows: Rows = []
    for name, link in scene["links"].items():
        message = results.links.get(name, {})
        mass, centre = message.get("mass [kg]"), message.get("centre of mass [m]")
        shape = link.get("shape") or {}
        model, material = str(message.get("model", link.get("model", ""))), str(link.get("material") or "–")
        form = str(shape.get("kind", "–")) + (f" {shape['file']}" if "file" in shape else "")
        counts = (_count(message.get(key)) for key in ("elements", "unknowns"))
        weight = "–" if mass is None else with_prefix(float(mass), "kg")
        place = "–" if centre is None else place_of(centre)
        rows.append((name, model, material, form, *counts, weight, place))
    head = ("link", "model", "material", "shape", "elements", "unknowns", "mass", "centre of mass")
    note = "Mass with what is attached; centre of mass in the reference position."
    return Table("Links", head, rows, note)


def _count(number: Any) -> str:
    return "–" if number is None else f"{int(number):,}"


def joints_table(scene: Mapping[str, Any]) -> Table:
    """Joints and their points in the reference position."""
    rows: Rows = [
        (name, joint["kind"], " – ".join(joint["links"]), place_of(joint["at"]), _axis(joint))
        for name, joint in scene["joints"].items()
    ]
    return Table("Joints", ("joint", "kind", "links", "reference position", "axis"), rows)


def _axis(joint: Mapping[str, Any]) -> str:
    axes = joint.get("axes") or ([joint["axis"]] if joint.get("axis") else [])
    return "; ".join(place_of(axis).removesuffix(" m") for axis in axes) or "–"


def peaks_table(results: Results, moment: Callable[[float, float], str]) -> Table:
    """The highest stress of each link, over all steps."""
    head = ("link", "von Mises stress", *of_yield(results.peaks), "reference position", "when", "near")
    return Table("Highest stress of each link, over all steps", head, peak_rows(results.peaks, moment))


def peak_rows(peaks: Mapping[str, Peak], moment: Callable[[float, float], str]) -> Rows:
    """Link, stress, share of the yield strength where any is known, place, instant and nearby singular place of each
    link's peak, and of its peak away from these.

    Parameters
    ----------
    moment : function from a time [s] and the drive's position [rad or m] to words
    """
    every = (row for name, x in peaks.items() for row in ((name, x), ("  away from it", x.away)))
    known, rows = bool(of_yield(peaks)), list[tuple[str, ...]]()
    for label, x in every:
        if x is not None:
            share = (_share(x),) if known else ()
            rows.append((label, with_prefix(x.stress, "Pa"), *share, place_of(x.place), moment(x.time, x.angle), x.near))
    return rows


def of_yield(peaks: Mapping[str, Peak]) -> tuple[str, ...]:
    """The heading of the column that relates stresses to yield strengths; none if none is known."""
    return ("of yield",) if any(np.isfinite(peak.strength) for peak in peaks.values()) else ()


def _share(peak: Peak) -> str:
    return percentage(peak.stress / peak.strength, 3) if np.isfinite(peak.strength) else "–"


def frequencies_table(found: Summary) -> Table:
    """Range of each natural frequency over the positions, and the speeds at which harmonics of the drive meet it."""
    head = ("mode", "lowest", "highest", "met by harmonics of the drive")
    rows: Rows = []
    for mode, (low, high) in enumerate(zip(found.lowest, found.highest, strict=True), start=1):
        met = [f"{k}: {_rpm(slow, fast)}" for m, k, slow, fast in found.crossings if m == mode]
        ends = (with_prefix(x, "Hz").replace(" ", "\u00a0") for x in (low, high))
        rows.append((str(mode), *ends, "; ".join(met) or "none"))
    held = "release" if found.free else "hold"
    message = f"The mechanism frozen at {found.positions} positions, drives {held} their joints."
    if found.still:
        message += f" Left out: {unstrained(found.still)}."
    if found.speed:
        message += f" The scene's drive rotates at {found.speed:.4g} rpm."
    message += "".join(f" {note[0].upper()}{note[1:]}." for note in found.notes)
    columns = len(head) if found.speed else 3
    return Table("Natural frequencies", head[:columns], [row[:columns] for row in rows], message)


def _rpm(slowest: float, fastest: float) -> str:
    """A range of speeds."""
    low, high = (f"{x:.4g}" if x < 1e4 else f"{x:,.0f}" for x in (slowest, fastest))
    if not np.isfinite(fastest):
        return f"from {low} rpm"
    return f"{low} rpm" if low == high else f"{low} to {high} rpm"


def loads_tables(joints: Mapping[str, Mapping[str, float]], drives: Mapping[str, Mapping[str, float]]) -> list[Table]:
    """Numbers for suppliers of bearings and motors, by name of the joint."""
    out = []
    if joints:
        note = "Equivalent bearing loads: mean by the power 3 (ball) or 10/3 (roller), ISO 281, over the whole run."
        out.append(_numbers("Joint forces", "joint", joints, ("equivalent", note)))
    if drives:
        out.append(_numbers("Drive", "joint", drives, ("power", "Power is positive when the drive supplies it.")))
    return out


def _numbers(title: str, what: str, reported: Mapping[str, Mapping[str, float]], note: tuple[str, str]) -> Table:
    """A table with a row for each name; columns without any number are left out.

    note : a word of the columns that a sentence is about, and the sentence
    """
    keys, (of, said) = known_names(reported.values()), note
    rows: Rows = [(name, *(number_in(x, key) for key in keys)) for name, x in reported.items()]
    shown = said if any(of in key for key in keys) else ""
    return Table(title, (what, *(key.rpartition(" [")[0] for key in keys)), rows, shown)


def budget_table(notes: Mapping[str, str | float]) -> list[Table]:
    """Estimated errors: a row for each source, a column for each kind of channel."""
    of_sources = {key: x for key, x in _noted(notes, OF_SOURCE).items() if ", " in key}
    cells = {tuple(key.split(", ", 1)): x for key, x in of_sources.items()}
    cells |= {("together", kind): x for kind, x in _noted(notes, TOGETHER).items()}
    if not cells:
        return []
    kinds = list(dict.fromkeys(kind for _, kind in cells))
    rows: Rows = [
        (source, *(percent(cells[source, kind]) if (source, kind) in cells else "–" for kind in kinds))
        for source in dict.fromkeys(source for source, _ in cells)
    ]
    message = "; ".join(str(x) for key, x in notes.items() if key.startswith(UNKNOWN))
    note = "Of each channel's largest value." + (f" No estimate of {message}." if message else "")
    return [Table("Estimated error", ("from", *kinds), rows, note)]


def _noted(notes: Mapping[str, str | float], beginning: str) -> dict[str, float]:
    """Numbers whose names have a common beginning, by the rest of the name."""
    return {key.removeprefix(beginning): float(x) for key, x in notes.items() if key.startswith(beginning)}


def steady_table(notes: Mapping[str, str | float]) -> list[Table]:
    """A steady motion: its period, and the growth of vibrations about it in a period."""
    if f"{STEADY}period [s]" not in notes:
        return []
    keys = "period [s]", "revolutions", "marches", "residual"
    period, turns, marches, residual = (float(notes[STEADY + key]) for key in keys)
    growth = notes.get(f"{STEADY}growth in a period")
    left = "not determined" if growth is None else f"{100 * float(growth):.4g} %"
    rows: Rows = [
        ("period", with_prefix(period, "s")),
        ("revolutions of the drive in it", f"{turns:g}" if turns else "–"),
        ("least damped vibration after a period", left),
        ("relative change of the state in a period", f"{residual:.1e}"),
        ("periods computed to find it", f"{marches:g}"),
    ]
    return [Table("Steady motion", (), rows, "Above 100 % the vibration grows: the motion is unstable.")]


def notes_table(notes: Mapping[str, str | float]) -> Table:
    """All other notes of the run."""
    reported = (OF_SOURCE, TOGETHER, UNKNOWN, STEADY)
    plain = {key: x for key, x in notes.items() if not key.startswith(reported)}
    return named_table("Notes of the run", plain.items())


def named_table(title: str, items: Iterable[tuple[str, str | float]]) -> Table:
    """Names and values."""
    rows: Rows = [(key, x if isinstance(x, str) else f"{x:.4g}") for key, x in items]
    return Table(title, (), rows)


def life_of(spot: FatigueSpot, found: Fatigue) -> str:
    """Life at a place in revolutions of the drive, or in periods, and in hours."""
    cycles, what = found.cycles(spot), "revolutions" if found.revolutions else "periods"
    return "endless" if cycles > ENDLESS else f"{cycles:.3g} {what}, {found.hours(spot):.3g} h"


def fatigue_notes(found: Fatigue) -> list[str]:
    """Notes below the table."""
    turns = f", {found.revolutions:.6g} revolutions" if found.revolutions else ""
    lines = [f"Period {with_prefix(found.period, 's')}{turns}; stresses repeat to {percent(found.repeats)}."]
    lines += [f"UNRELIABLE: {found.unreliable}."] if found.unreliable else []
    lines += [f"{name}: {words}." for name, words in found.strengths.items()]
    if left := found.left_out_words:
        lines.append(f"Left out near corners, point forces and joints: {left} points.")
    empty = [name for name, spots in found.spots.items() if not spots]
    lines += [f"No point of {', '.join(empty)} is left to examine."] if empty else []
    lines += [f"No data of {', '.join(found.without)}."] if found.without else []
    return lines


def fatigue_table(found: Fatigue) -> Table:
    """Life and utilisation at the places of the highest damage."""
    head = (
        "link", "life", "utilisation", "amplitude", "mean", "criterion", "not proportional", "reference position", "near",
    )  # fmt: skip
    rows: Rows = [
        (
            name if rank == 0 else "", life_of(spot, found), percent(spot.utilisation),
            with_prefix(spot.amplitude, "Pa"), with_prefix(spot.mean, "Pa"), spot.criterion,
            percent(spot.disproportion), place_of(spot.place), spot.near,
        )
        for name, spots in found.spots.items()
        for rank, spot in enumerate(spots[:SPOTS])
    ]  # fmt: skip
    return Table("Fatigue: life and utilisation", head, rows, " ".join(fatigue_notes(found)))
