"""What is swept: keys with their values, from texts as ``drive.speed=500rpm:4000rpm:50``; the points of all together."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import product
from typing import Any

import numpy as np
from jaxtyping import Float

from kedfem.errors import SceneError, Where, place
from kedfem.scene.records.units import NUMBER, UNIT, UNREADABLE, unit_registry
from kedfem.scene.records.wording import shown
from kedfem.sweep.keys import located

Value = bool | int | float | str
MOST = 100_000  # points: a slip of the keyboard, not a sweep
SEED = 0  # of Latin hypercubes: the same points each time, so that a sweep goes on where it was
HOW = "a list a,b,c or a range from:to:count"


@dataclass(frozen=True, slots=True)
class Axis:
    """A key and the values that it takes, one for each point.

    where : the key's place in the scene
    values : as a scene would state them
    numbers : the same in one unit; None if they are words
    unit : as it was given, ``rpm``; empty of plain numbers
    """

    where: Where
    values: tuple[Value, ...]
    numbers: Float[np.ndarray, " P"] | None
    unit: str

    @property
    def key(self) -> str:
        """The key's full name."""
        return place(self.where)

    def at(self, which: Sequence[int]) -> "Axis":
        """The same with the values of some points."""
        numbers = None if self.numbers is None else self.numbers[list(which)]
        return Axis(self.where, tuple(self.values[k] for k in which), numbers, self.unit)


def axes_of(texts: Sequence[str], raw: Mapping[str, Any], samples: int | None = None) -> list[Axis]:
    """The swept keys, each with a value for every point: a grid of all, or a Latin hypercube.

    Parameters
    ----------
    texts : ``KEY=a,b,c`` or ``KEY=from:to:count``; for a Latin hypercube ``KEY=from:to``
    raw : keys and values of the scene
    samples : points of a Latin hypercube (`scipy.stats.qmc`), with the same seed each time

    Raises
    ------
    SceneError
        With what is wrong with the first of them.
    """
    if samples is not None and not 1 <= samples <= MOST:
        raise SceneError(f"--samples: must be from 1 to {MOST:,}, got {samples}")
    named = [_named(text, raw) for text in texts]
    if len({where for where, _ in named}) < len(named):
        raise SceneError("--over: must name each key once, got one twice")
    if not named:
        raise SceneError("--over: must be given at least once, got nothing")
    if samples is not None:
        return _hypercube([(where, *_ends(where, spec.split(":"), 2)) for where, spec in named], samples)
    single = [_axis(where, spec) for where, spec in named]
    count = int(np.prod([float(len(axis.values)) for axis in single]))
    if count > MOST:
        raise SceneError(f"--over: must make at most {MOST:,} points, got {count:,}")
    order = list(product(*(range(len(axis.values)) for axis in single)))
    return [axis.at([k[i] for k in order]) for i, axis in enumerate(single)]


def _named(text: str, raw: Mapping[str, Any]) -> tuple[Where, str]:
    name, equals, spec = text.partition("=")
    if not equals or not spec.strip():
        raise SceneError(f"--over: must be KEY={HOW}, got {shown(text)}")
    return located(name.strip(), raw), spec.strip()


def _axis(where: Where, spec: str) -> Axis:
    """One key's own values."""
    if ":" not in spec:
        words = [word.strip() for word in spec.split(",")]
        pairs = [_number(word) for word in words]
        found = [pair for pair in pairs if pair is not None]
        if len(found) < len(words):
            return Axis(where, tuple(map(_word, words)), None, "")
        unit = next((unit for _, unit in found if unit), "")
        numbers = np.array([_in(where, *pair, unit) for pair in found])
        return Axis(where, tuple(map(_word, words)), numbers, unit)
    parts = spec.split(":")
    if len(parts) != 3 or not parts[2].strip().isdigit() or not 2 <= int(parts[2]) <= MOST:
        raise SceneError(f"--over {place(where)}: must be {HOW} (2 to {MOST:,}), got {shown(spec)}")
    first, last, unit, whole = _ends(where, parts[:2], 2)
    numbers = np.linspace(first, last, int(parts[2]))
    return Axis(where, tuple(stated(x, unit, whole) for x in numbers), numbers, unit)


def _ends(where: Where, parts: Sequence[str], count: int) -> tuple[float, float, str, bool]:
    """The ends of a range in one unit, the unit, and whether both are whole numbers."""
    pairs = [pair for part in parts if (pair := _number(part)) is not None]
    if not len(pairs) == len(parts) == count:
        wanted = "two ends with a : between them, numbers with or without a unit"
        raise SceneError(f"--over {place(where)}: must have {wanted}, got {shown(':'.join(parts))}")
    unit = next((unit for _, unit in pairs if unit), "")
    first, last = (_in(where, *pair, unit) for pair in pairs)
    return first, last, unit, not unit and all(part.strip().lstrip("+-").isdigit() for part in parts)


def _number(text: str) -> tuple[float, str] | None:
    """A number and its unit; None of a text that is neither."""
    found = NUMBER.fullmatch(text)
    if not found or (found[2] and not UNIT.fullmatch(found[2])):
        return None
    return float(found[1]), found[2]


def _in(where: Where, number: float, unit: str, common: str) -> float:
    """A number in the unit of its axis; one without a unit is taken to be in it."""
    if unit in {"", common}:
        return number
    try:
        quantity = unit_registry().Quantity(number, unit)
        if quantity.check("1/[time]"):  # pint takes 1 Hz for 1 rad/s
            raise ValueError("speeds and frequencies are not converted")
        return float(quantity.to(common).magnitude)
    except UNREADABLE as reason:
        raise SceneError(
            f"--over {place(where)}: must be in one unit, got {unit} and {common}: {reason}"
        ) from None


def _word(text: str) -> Value:
    """A value of a list as a scene would state it."""
    if text in {"true", "false"}:
        return text == "true"
    pair = _number(text)
    if pair is None or pair[1]:
        return text
    return int(text) if text.lstrip("+-").isdigit() else pair[0]


def stated(number: float, unit: str, whole: bool = False) -> Value:
    """A value of a range as a scene would state it."""
    if unit:
        return f"{number:.15g} {unit}"
    return round(number) if whole and float(number).is_integer() else float(number)


def _hypercube(ranges: Sequence[tuple[Where, float, float, str, bool]], samples: int) -> list[Axis]:
    from scipy.stats import qmc

    cube = qmc.LatinHypercube(len(ranges), seed=SEED).random(samples)
    out = []
    for (where, first, last, unit, _), x in zip(ranges, cube.T, strict=True):
        numbers = first + (last - first) * x
        out.append(Axis(where, tuple(stated(each, unit) for each in numbers), numbers, unit))
    return out
