"""Numbers as text with SI prefixes; places, instants and stresses in words."""

import math
from collections.abc import Iterable, Mapping

import numpy as np

from kedfem.output.abscissa import abscissa
from kedfem.results import Peak
from kedfem.scene import Scene, drive_angle, driven_travel, time_grid

PREFIXES = {-12: "p", -9: "n", -6: "µ", -3: "m", 0: "", 3: "k", 6: "M", 9: "G", 12: "T"}

PLAIN = frozenset({"", "-", "1", "rad", "deg", "°", "°/s", "°/s²", "kg", "%"})  # units without prefixes
NOTHING = 1e-9  # of the largest value of the same unit: smaller values are rounding errors
SAMPLES = 500  # of a drive's motion, to see whether it reverses
UNITS = tuple((10.0**k, prefix) for k, prefix in reversed(PREFIXES.items()) if abs(k) <= 9)


def prefixed(peak: float, unit: str) -> tuple[float, str]:
    """Divisor and prefixed unit with which a peak is between 1 and 1000.

    Parameters
    ----------
    peak : largest absolute value, in `unit`
    unit : it gets the prefix before its first letter

    Examples
    --------
    >>> prefixed(4.2e7, "Pa")
    (1000000.0, 'MPa')
    >>> prefixed(0.0042, "m")
    (0.001, 'mm')
    >>> prefixed(2500.0, "m/s^2")
    (1.0, 'm/s²')
    >>> prefixed(0.0, "N*m")
    (1.0, 'N m')
    """
    pretty = unit.replace("**", "^").replace("^2", "²").replace("^3", "³").replace("*", " ")
    if pretty in PLAIN or peak <= 0 or not math.isfinite(peak):
        return 1.0, pretty
    power = 3 * math.floor(math.log10(peak) / 3 + 1e-12)
    power = min(max(power, min(PREFIXES)), max(PREFIXES))
    if power > 0 and pretty.startswith("m"):
        power = 0  # kilometres per second are unusual for a linkage
    return 10.0**power, PREFIXES[power] + pretty


def number_in(row: Mapping[str, float], name: str) -> str:
    """A number of a row with the unit of its name; a value that is rounding compared with others of that unit is ≈ 0.

    >>> number_in({"force [N]": 2e3, "moment [N m]": 3.0, "axial [N]": 1e-8}, "axial [N]")
    '≈ 0'
    """
    x, unit = row.get(name, np.nan), name.rpartition(" [")[2]
    alike = (abs(value) for other, value in row.items() if other.rpartition(" [")[2] == unit)
    largest = max(alike, default=0.0)
    return "≈ 0" if abs(x) < NOTHING * largest else with_prefix(x, unit.removesuffix("]"))


def known_names(every: Iterable[Mapping[str, float]]) -> list[str]:
    """Names of which any row has a number."""
    return list(dict.fromkeys(name for row in every for name, x in row.items() if np.isfinite(x)))


def with_prefix(value: float, unit: str) -> str:
    """A number with an SI prefix: 1.23e7, Pa → 12.3 MPa. Angles are in degrees; kilograms and radians take no prefix.

    >>> with_prefix(1.234e7, "Pa"), with_prefix(60.0, "rad"), with_prefix(1600.0, "kg"), with_prefix(float("nan"), "m")
    ('12.34 MPa', '3438°', '1600 kg', '–')
    """
    if not np.isfinite(value):
        return "–"
    if unit == "rad":
        return f"{np.degrees(value):.4g}°"
    if unit.startswith(("kg", "rad")):
        return f"{value:.4g} {unit}"
    size = abs(value)
    factor, prefix = next(((f, p) for f, p in UNITS if size >= f), (1.0, ""))
    return f"{value / factor:.4g} {prefix}{unit}"


def clock(scene: Scene, frozen: bool = False) -> str:
    """The quantity that counts the instants of a run: the position of a single monotonic drive, else the time.

    Parameters
    ----------
    frozen : whether the mechanism is frozen at positions of its drive, whose motion need not be monotonic then
    """
    if len(scene.all_drives) != 1 or not (frozen or _keeps_on(scene)):
        return "time"
    (name,) = scene.all_drives
    return "drive travel" if driven_travel(scene, name) else "drive angle"


def _keeps_on(scene: Scene) -> bool:
    """Whether the drive has each position only once, so that it determines the instant; always for static positions."""
    if scene.analysis.kind == "static":
        return True
    t = np.linspace(0.0, time_grid(scene).end, SAMPLES)
    return not abscissa(t, drive_angle(scene.motion, t)[0]).over_time


def moment(scene: Scene, time: float, angle: float, frozen: bool = False) -> str:
    """A drive angle [rad] in degrees, a drive's travel [m], or the time [s], as `clock` says."""
    match clock(scene, frozen):
        case "time":
            return with_prefix(time, "s")
        case "drive travel":
            return with_prefix(angle, "m")
    return f"{round(np.degrees(angle), 1) + 0.0:.1f}°"


def unstrained(count: int) -> str:
    """Rigid-body modes in words."""
    return f"{count} motion{'s' * (count > 1)} without strain"


def place_of(point: Iterable[float]) -> str:
    """A point as text [m], rounded to a micrometre."""
    return f"({', '.join(f'{round(x, 6) + 0.0:g}' for x in point)}) m"


def stress_at(peak: Peak) -> str:
    """The highest stress in words, with its link and place."""
    return f"{with_prefix(peak.stress, 'Pa')} in link {peak.link} at {place_of(peak.place)} in the reference position"
