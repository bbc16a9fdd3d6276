"""Axes of a sweep: dotted keys of a scene with their values, as in ``drive.speed=500rpm:4000rpm:50``; all points."""

from collections.abc import Iterator, Mapping, Sequence
from copy import deepcopy
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import SceneError, Where, place
from kedfem.scene import Scene
from kedfem.scene.checks.hints import below, known_keys, marks, models
from kedfem.scene.records.curves import Curve
from kedfem.scene.records.drives import EITHER_SPEED, prescribes_travel
from kedfem.scene.records.units import NUMBER, UNIT, UNREADABLE, Quantity, unit_registry
from kedfem.scene.records.wording import nearest, shown

Value = bool | int | float | str
MOST = 100_000  # points: more is a typing error
SEED = 0  # of Latin hypercubes: the same points each time, so that a sweep can be continued
PARAMETERS = "parameters"
HOW = "a list a,b,c or a range from:to:count"


@dataclass(frozen=True, slots=True)
class Axis:
    """A key and the values that it takes, one for each point.

    where : the key's place in the scene
    values : as a scene would state them
    numbers : the same in one unit; None if they are words
    unit : the given one, as ``rpm``, else that of SI; empty of counts, ratios and parameters
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
        """The axis with the values of some points."""
        numbers = None if self.numbers is None else self.numbers[list(which)]
        return Axis(self.where, tuple(self.values[k] for k in which), numbers, self.unit)


def axes_of(texts: Sequence[str], raw: Mapping[str, Any], samples: int | None = None) -> list[Axis]:
    """The swept keys, each with a value for every point: a full grid, or a Latin hypercube.

    Parameters
    ----------
    texts : ``KEY=a,b,c`` or ``KEY=from:to:count``; for a Latin hypercube ``KEY=from:to``
    raw : keys and values of the scene
    samples : points of a Latin hypercube (`scipy.stats.qmc`), with the same seed each time

    Raises
    ------
    SceneError
        An axis is invalid: the first such one.
    """
    if samples is not None and not 1 <= samples <= MOST:
        raise SceneError(f"--samples: must be from 1 to {MOST:,}, got {samples}")
    named = [_named(text, raw) for text in texts]
    if len({where for where, _ in named}) < len(named):
        raise SceneError("--over: must name each key once, got one twice")
    if not named:
        raise SceneError("--over: must be given at least once, got nothing")
    if samples is not None:
        cube = _hypercube([(where, *_ends(where, spec.split(":"))) for where, spec in named], samples)
        return [_with_unit(axis, raw) for axis in cube]
    single = [_with_unit(_axis(where, spec), raw) for where, spec in named]
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
        full = [word if given else f"{word} {unit}".rstrip() for word, (_, given) in zip(words, found, strict=True)]
        return Axis(where, tuple(map(_word, full)), numbers, unit)
    parts = spec.split(":")
    if len(parts) != 3 or not parts[2].strip().isdigit() or not 2 <= int(parts[2]) <= MOST:
        raise SceneError(f"--over {place(where)}: must be {HOW} (2 to {MOST:,}), got {shown(spec)}")
    first, last, unit, whole = _ends(where, parts[:2])
    numbers = np.linspace(first, last, int(parts[2]))
    return Axis(where, tuple(stated(x, unit, whole) for x in numbers), numbers, unit)


def _with_unit(axis: Axis, raw: Mapping[str, Any]) -> Axis:
    """An axis of plain numbers with the unit in which the scene takes them."""
    if axis.unit or axis.numbers is None:
        return axis
    hint: Any = Scene
    held: Any = raw
    for part in axis.where:
        hint = below(hint, part, held)
        held = _item(held, part)
    quantities = marks(hint, Quantity) if hint else ()
    curves = [model for model in models(hint) if issubclass(model, Curve)]
    units = {x.unit for x in quantities}.union(*(curve.what.values() for curve in curves))
    if "initial_speeds" in axis.where[1:2] or EITHER_SPEED in quantities:
        units = {_speed_unit(axis.where, raw)}
    return replace(axis, unit=units.pop()) if len(units) == 1 and units != {"1"} else axis


def _speed_unit(where: Where, raw: Mapping[str, Any]) -> str:
    """The unit of a drive's or a joint's speed, by the kind of its joint; empty where the joint is not known."""
    starts = where[0] == "analysis"
    drive = {} if starts else _at(raw, where[:1] if where[0] == "drive" else where[:2])
    kind = _item(_at(raw, ("joints", where[-1] if starts else _item(drive, "joint"))), "kind")
    if kind is None:
        return ""
    slides = prescribes_travel(kind, _item(drive, "coordinate"), _item(drive, "along"))
    return "m/s" if slides or (starts and kind == "cylindrical") else "rad/s"


def _at(raw: Any, where: Where) -> Any:
    for part in where:
        raw = _item(raw, part)
    return raw


def _item(held: Any, part: Any) -> Any:
    """An entry of a table or list; None if there is none."""
    try:
        return held[part]
    except (KeyError, IndexError, TypeError):
        return None


def _ends(where: Where, parts: Sequence[str]) -> tuple[float, float, str, bool]:
    """The ends of a range in one unit, the unit, and whether both are whole numbers."""
    pairs = [pair for part in parts if (pair := _number(part)) is not None]
    if not len(pairs) == len(parts) == 2:
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
        wanted = f"must be in one unit, got {unit} and {common}"
        raise SceneError(f"--over {place(where)}: {wanted}: {reason}") from None


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


def located(name: str, raw: Mapping[str, Any]) -> Where:
    """The key of a scene by its full name, a parameter's name, or a name without middle parts that only one key matches.

    Parameters
    ----------
    name : ``drive.motion.speed``, ``drive.speed``, ``links.rod.shape.between[1][0]``, or ``r`` for ``parameters.r``
    raw : keys and values of the scene
    """
    known = {place(where): where for where in _keys(raw, Scene, ())}
    if found := known.get(name) or known.get(f"{PARAMETERS}.{name}"):
        return found
    short = [full for full in known if _fits(name.split("."), full.split("."))]
    if len(short) == 1:
        return known[short[0]]
    if short:
        raise SceneError(f"--over {name}: must name one key, got what fits {', '.join(sorted(short)[:6])}")
    close = _nearest(name, list(known))
    hint = f", did you mean {close!r}?" if close else "; keys are dotted, as in drive.motion.speed"
    wanted = "must name a key of the scene or one of its parameters"
    raise SceneError(f"--over {name}: {wanted}, got neither{hint}")


def with_values(raw: Mapping[str, Any], values: Mapping[Where, Any]) -> dict[str, Any]:
    """A changed copy of a scene's keys and values."""
    out: dict[str, Any] = deepcopy(dict(raw))
    for where, value in values.items():
        holder: Any = out
        for part in where[:-1]:
            holder = holder[part]
        holder[where[-1]] = value
    return out


def _keys(raw: Any, hint: Any, where: Where) -> Iterator[Where]:
    """Keys of single values: those that the scene has, and others that its tables may have."""
    if isinstance(raw, Mapping):
        for key in dict.fromkeys([*raw, *known_keys(hint, raw)]):
            if key in raw:
                yield from _keys(raw[key], below(hint, key, raw), (*where, key))
            elif where:
                yield (*where, key)
    elif isinstance(raw, list):
        for k, each in enumerate(raw):
            yield from _keys(each, below(hint, k, raw), (*where, k))
    else:
        yield where


def _fits(short: list[str], full: list[str]) -> bool:
    """Whether a name is a full one without some of the names between its first and its last."""
    rest = iter(full)
    return len(short) > 1 and (short[0], short[-1]) == (full[0], full[-1]) and all(x in rest for x in short)


def _nearest(name: str, known: list[str]) -> str | None:
    """The known key most similar to a name, also without its middle parts or the table of parameters."""
    forms = {short: full for full in reversed(known) for short in _shortened(full)}
    close = nearest(name, forms)
    return forms[close] if close else None


def _shortened(full: str) -> list[str]:
    parts = full.split(".")
    return [full, f"{parts[0]}.{parts[-1]}", *([parts[-1]] if parts[0] == PARAMETERS else [])]
