"""Tables of kinematics, loads of joints and drives, load cases of links, and natural frequencies."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from rich.table import Table
from rich.text import Text

from kedfem.accuracy.frequencies import error_words
from kedfem.frequencies import Crossing, Frequencies, PartFrequencies
from kedfem.kinematics import KinematicsRun, first_largest
from kedfem.load_cases import LoadCases
from kedfem.loads import Loads
from kedfem.motion.coordinates import driven_names
from kedfem.output.words import NOTHING, clock, known_names, moment, number_in, unstrained, with_prefix
from kedfem.results.channels import largest_by_unit
from kedfem.results.kinematic import transmission_key
from kedfem.scene import Scene, percentage
from kedfem.scene.records.units import RPM
from kedfem.tables.layout import facts, left, listed, right

WIDTH, BORDER = 72, 3  # of all columns but the first in a terminal of 80 characters; of each column's border
MODES = 8  # side by side
SHORT = {
    "drive at peak": "at", "time of peak": "at", "time of largest": "at",
    "largest bearing load": "radial", "largest axial": "axial", "equivalent, ball bearing": "ball",
    "equivalent, roller bearing": "roller", "drive at largest": "at", "largest power": "peak power",
}  # fmt: skip


def kinematics_tables(scene: Scene, moved: KinematicsRun) -> list[Table]:
    """Coordinates of joints, transmission angles, forces of joints and drive, and the seconds spent."""
    angles = [*left("coupler", "drives"), *right("from", "to", "furthest from 90°", f"at {clock(scene)}")]
    forces = [*left("of"), *right("largest", f"at {clock(scene)}")]
    joints = [*left("joint", "coordinate"), *right("from", "to", "range")]
    return [
        listed(Text(scene.title or "Joints"), joints, _coordinates(scene, moved)),
        listed("Transmission angles", angles, _transmissions(scene, moved)),
        listed("Largest forces with all links rigid", forces, _forces(scene, moved)),
        seconds_table(f"{len(moved.results.time) - 1} steps", moved.seconds),
    ]


def seconds_table(of: str, seconds: Mapping[str, float]) -> Table:
    """Duration of each stage."""
    return facts(f"{of}; seconds", ((stage, f"{each:.2f}") for stage, each in seconds.items()))


def _coordinates(scene: Scene, moved: KinematicsRun) -> Iterator[tuple[str, ...]]:
    for each in moved.recorded.coordinates:
        values = moved.results.channels[f"joints/{each.joint}/{each.name}"][1][:, 0]
        low, high = float(values.min()), float(values.max())
        shown = _length if each.kind == "length" else _degrees
        words = [shown(x) for x in (low, high, high - low)]
        driven, links = "", scene.joints[each.joint].links
        if each.name in driven_names(scene, each.joint):  # between moving links it is easily taken the other way round
            driven = " (driven)" if "ground" in links else f" of {links[0]} against {links[1]} (driven)"
        yield each.joint, each.name.replace("_", " ") + driven, *words


def _transmissions(scene: Scene, moved: KinematicsRun) -> Iterator[tuple[str, ...]]:
    for each in moved.recorded.transmissions:
        values = moved.results.channels[transmission_key(each.coupler)][1][:, 0]
        k = first_largest(np.abs(values - np.pi / 2))
        words = map(_degrees, (values.min(), values.max(), values[k]))
        yield each.coupler, each.driven, *words, _at(scene, moved, k)


def _forces(scene: Scene, moved: KinematicsRun) -> Iterator[tuple[str, ...]]:
    """Largest magnitudes of statically determinate forces."""
    found = {name: x for name, x in moved.results.channels.items() if "/rigid_" in name}
    highest = largest_by_unit(found.values())
    for name, (channel, values) in found.items():
        size = np.linalg.norm(values, axis=1)
        k = first_largest(size)
        shown = float(values[k, 0]) if values.shape[1] == 1 else float(size[k])
        of = name.replace("/rigid_", " ").replace("/", " ").removeprefix("joints ")
        nothing = abs(shown) <= NOTHING * highest[channel.unit]
        words = ("≈ 0", "") if nothing else (with_prefix(shown, channel.unit), _at(scene, moved, k))
        yield of, *words


def _at(scene: Scene, moved: KinematicsRun, k: int) -> str:
    return moment(scene, float(moved.results.time[k]), float(moved.results.angle[k]))


def _degrees(x: float) -> str:
    return f"{np.degrees(x):.2f}°"


def _length(x: float) -> str:
    return with_prefix(x, "m") if abs(x) > 1e-12 else "0 m"


def loads_tables(found: Loads) -> list[Table]:
    """Peak, mean and equivalent loads of joints; torque and power of drives."""
    joints = _summary("Loads of joints", "joint", found.joints)
    if "ball" in (column.header for column in joints.columns):
        joints.caption = "radial, axial: largest; ball, roller: equivalent load for the life of such a bearing"
    return [joints, _summary("Drives", "drive", found.drives)]


def _summary(title: str, what: str, every: Mapping[str, Mapping[str, float]]) -> Table:
    names = known_names(every.values())
    if any(name.startswith("drive at") for name in names):
        names = [name for name in names if not name.startswith("time of")]
    labels = [SHORT.get(label := name.rpartition(" [")[0], label) for name in names]
    rows = ((key, *(number_in(row, name) for name in names)) for key, row in every.items())
    return listed(Text(title), [*left(what), *right(*labels)], rows)


def case_tables(found: LoadCases) -> list[Table]:
    """Resultants of each kind of force at each instant, in the link's axes; highest stress, residual."""
    title = Text(f"Load cases of {found.link}, in its axes in the reference position")
    table = listed(title, [*right("time"), *left("what"), *right("x", "y", "z")])
    short = listed("", right(
        "time", "highest von Mises stress", "by statics", "off at most", "supports bear, of the largest force"
    ))  # fmt: skip
    for case, residual in zip(found.cases, found.left, strict=True):
        every = {name: forces.sum(axis=0) for name, forces in case.parts.items()}
        largest = max(float(np.abs(x).max()) for x in every.values())
        time = with_prefix(case.time, "s")
        stresses = (with_prefix(float(x.max()), "Pa") for x in (case.von_mises, case.static_von_mises))
        for k, (name, force) in enumerate(every.items()):
            words = ("≈ 0" if abs(x) < NOTHING * largest else with_prefix(float(x), "N") for x in force)
            table.add_row(time if k == 0 else "", name, *words)
        table.add_section()
        short.add_row(time, *stresses, percentage(case.differs, 1), percentage(residual, 1))
    return [table, short]


def frequencies_tables(scene: Scene, found: Frequencies) -> list[Table]:
    """Frequencies at each position; of a drive that rotates continuously critical speeds of each harmonic."""
    still = f"; {unstrained(found.still)}, at 0 Hz" if found.still else ""
    stiffened = ", stiffened by its motion" if scene.analysis.stiffening else ""
    title = Text(f"Natural frequencies of the frozen linkage{stiffened} [Hz]{still}")
    positions = zip(found.time.tolist(), found.angle.tolist(), strict=True)
    places = [moment(scene, *each, frozen=True) for each in positions]
    places = ["in the reference position"] * len(places) if scene.driven is None else places
    out = []
    for modes in _blocks(range(found.values.shape[1]), MODES):
        columns = [*left("position"), *right(*(str(k + 1) for k in modes))]
        out.append(listed(title, columns, (
            (place, *("–" if np.isnan(row[k]) else f"{row[k]:.4g}" for k in modes))
            for place, row in zip(places, found.values, strict=True)
        ), caption=_caption(error_words(found.errors))))  # fmt: skip
    ranges = {(x.mode, x.harmonic): _range(x, found.speed) for x in found.crossings}
    harmonics = sorted({k for _, k in ranges})
    side_by_side = WIDTH // (BORDER + max(map(len, ranges.values()), default=1))
    return out + [_speeds(found, ranges, some) for some in _blocks(harmonics, side_by_side)]


def _speeds(found: Frequencies, ranges: Mapping[tuple[int, int], str], harmonics: Sequence[int]) -> Table:
    turns = f"the drive rotates at {found.speed * RPM:.4g}"
    beyond = any(np.isinf(x.fastest) for x in found.crossings)
    caption = "* at the drive's speed" + ("; – alone: beyond the speeds examined" if beyond else "")
    columns = [*left("mode"), *right(*(f"{k}×" for k in harmonics))]
    rows = (
        (str(mode), *(ranges.get((mode, k), "–") for k in harmonics)) for mode in sorted({mode for mode, _ in ranges})
    )
    title = Text(f"Drive speeds at which its harmonics meet them [rpm]; {turns}")
    return listed(title, columns, rows, caption=Text(caption))


def _blocks(numbers: Sequence[int], most: int) -> list[Sequence[int]]:
    """Groups of columns that fit side by side."""
    return [numbers[k : k + most] for k in range(0, len(numbers), most)]


def _range(x: Crossing, speed: float) -> str:
    """From the slowest speed to the fastest [rpm], with a mark where the drive's is among them."""
    here = " *" * (x.slowest <= speed <= x.fastest)
    fastest = f"{x.fastest * RPM:.0f}" if np.isfinite(x.fastest) else ""
    return f"{x.slowest * RPM:.0f}–{fastest}{here}"


def part_tables(found: PartFrequencies) -> list[Table]:
    """Frequencies of a single link, with its mass and support."""
    part, still = found.part, found.still
    held = f"held at {', '.join(part.held)}" if part.held else "free"
    left_out = f"{unstrained(still)}, at 0 Hz, left out" if still else ""
    rows = [("mass", with_prefix(found.mass, "kg")), ("unknowns", str(part.link.unknowns))]
    rows += [(f"mode {number}", f"{f:.5g} Hz") for number, f in enumerate(found.values, 1)]
    title = Text(f"Natural frequencies of {part.name}, {held}")
    return [facts(title, rows, caption=_caption(left_out, error_words(found.errors)), min_width=60)]


def _caption(*words: str) -> Text | None:
    """The caption of a table; None of empty words."""
    text = "; ".join(filter(None, words))
    return Text(text) if text else None
