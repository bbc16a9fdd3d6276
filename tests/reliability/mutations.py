"""Scenes changed at random, by the types of their values; and any file by bytes. A seed gives the same change again."""

import copy
import random
import re
from collections.abc import Callable
from typing import Any

NUMBERS: list[Any] = [
    0, -1, 1, 3, 1e-6, -1e-6, 0.5, 2.5, 1e3, 1e6, 1e9, 1e30, 1e31, -1e30, 1e-30, 1e-31, 1e100, 1e300, -1e300, 1e-300,
    5e-324,     float("nan"), float("inf"), -float("inf"), 10**29, 10**400,
    True, False,
]  # fmt: skip
TEXTS = [
    "", " ", "x", "A", "B", "ground", "steel", "1 m", "2 mm", "3 deg", "1 m**(9**9**9)", "1e308 km", "9" * 400,
    "x" * 5000,
    "nan", "1 / 0", "../../x", "/dev/zero", "/", "a\0b", "\x1b[31m", "\u202e", "é" * 200, "sin(t)", "t**t**t",
    "__import__('os')",
    "(" * 2000, "beam", "rigid", "solid", "plane", "modal", "auto", "co-rotational", "rest", "stress", "revolute",
    "weld", "0 0",
    "10 rpm", "-5 N", "1 kg m", "1 m2", "{}", "%s", "None",
]  # fmt: skip
NESTED: list[Any] = [
    [],
    {},
    [[]],
    [0],
    [0, 0],
    [0, 0, 0],
    [1, 2, 3, 4],
    ["A", "B"],
    {"kind": "bar"},
    {"x": 1},
    [None],
    None,
]
Place = tuple[Any, ...]
Raw = dict[str, Any]
MOST_STEPS = 24  # of a whole short run


def places(x: Any, at: Place = ()) -> list[Place]:
    """Where all values of a scene are, tables and lists too."""
    out = [at] if at else []
    items = x.items() if isinstance(x, dict) else enumerate(x) if isinstance(x, list) else ()
    for key, value in items:
        out += places(value, (*at, key))
    return out


def value_at(x: Any, place: Place) -> Any:
    for key in place:
        x = x[key]
    return x


def another(value: Any, whole: Any, rng: random.Random) -> Any:
    """A value in place of one: of the same type as a rule, near it or far off, or one from elsewhere in the scene."""
    draw = rng.random()
    if draw < 0.2:
        return copy.deepcopy(value_at(whole, rng.choice(places(whole))))
    if draw < 0.3:
        return copy.deepcopy(rng.choice([*NUMBERS, *TEXTS, *NESTED]))
    if isinstance(value, bool):
        return not value
    if isinstance(value, int | float):
        near = [value * rng.uniform(0.5, 2), -value, value + 1, value * 10 ** rng.randint(-12, 12)]
        return rng.choice(near if rng.random() < 0.6 else NUMBERS)
    if isinstance(value, str):
        cut = [value[: rng.randrange(len(value) + 1)], value * 2, value.upper(), f" {value}\n"]
        return rng.choice(cut if rng.random() < 0.3 else TEXTS)
    return copy.deepcopy(rng.choice(NESTED))


def mutated(raw: dict[str, Any], rng: random.Random, most: int = 4) -> dict[str, Any]:
    """A scene with a few changes: other values, keys that are gone, come twice or have other names."""
    raw = copy.deepcopy(raw)
    for _ in range(rng.randint(1, most)):
        every = places(raw)
        if not every:
            break
        place = rng.choice(every)
        table, key = value_at(raw, place[:-1]), place[-1]
        what = rng.random()
        if what < 0.7:
            table[key] = another(table[key], raw, rng)
        elif what < 0.85:
            del table[key]
        elif isinstance(table, dict):
            name = rng.choice([*TEXTS, *(p[-1] for p in every if isinstance(p[-1], str))])
            table[name] = copy.deepcopy(table[key])
        else:
            table.insert(key, copy.deepcopy(table[key]))
    return raw


def nudged(raw: dict[str, Any], rng: random.Random) -> dict[str, Any]:
    """A scene some of whose numbers are others: it is accepted more often than not, and then has to run."""
    raw = copy.deepcopy(raw)
    numbers = [p for p in places(raw) if type(value_at(raw, p)) in {int, float} and p[0] != "analysis"]
    for place in rng.sample(numbers, min(len(numbers), rng.randint(1, 3))):
        table, value = value_at(raw, place[:-1]), value_at(raw, place)
        factor = rng.choice([0.0, -1.0, 1.01, 0.5, 2.0, 10.0 ** rng.randint(-9, 9), 10.0 ** rng.randint(-3, 3)])
        table[place[-1]] = value * factor
    if rng.random() < 0.3:
        raw = mutated(raw, rng, 1)
    return raw


def damaged(content: bytes, rng: random.Random) -> bytes:
    """A file with other bytes, fewer, more, or bytes from elsewhere in it."""
    out = bytearray(content)
    match rng.randrange(5):
        case 0:
            for _ in range(rng.choice((1, 1, 5, 50))):
                out[rng.randrange(len(out))] ^= 1 << rng.randrange(8)
        case 1:
            out = out[: rng.randrange(len(out))]
        case 2:
            start = rng.randrange(len(out))
            del out[start : start + rng.randrange(1, max(2, len(out) // 4))]
        case 3:
            start = rng.randrange(len(out))
            out[start:start] = rng.randbytes(rng.randrange(1, 300))
        case _:
            one, other, size = rng.randrange(len(out)), rng.randrange(len(out)), rng.randrange(1, 64)
            out[one : one + size] = out[other : other + size]
    return bytes(out)


def flipped(content: bytes, rng: random.Random) -> bytes:
    """Some bytes are others."""
    out = bytearray(content)
    for _ in range(rng.choice((1, 5, 50))):
        out[rng.randrange(len(out))] = rng.randrange(256)
    return bytes(out)


def cut(content: bytes, rng: random.Random) -> bytes:
    """A piece is missing."""
    start = rng.randrange(len(content))
    return content[:start] + content[start + rng.randrange(1, max(2, len(content) // 4)) :]


def renumbered(content: bytes, rng: random.Random) -> bytes:
    """Some numbers are others: negative, huge, not a number, zero."""
    spots = list(re.finditer(rb"\d+(?:\.\d*)?", content))
    for spot in sorted(rng.sample(spots, min(len(spots), rng.choice((1, 4, 20)))), key=lambda x: -x.start()):
        other = rng.choice((b"-1", b"0", b"99999999999", b"1e308", b"nan", b"7"))
        content = content[: spot.start()] + other + content[spot.end() :]
    return content


def shuffled(content: bytes, rng: random.Random) -> bytes:
    """Lines at other places, some twice."""
    lines = content.splitlines(keepends=True)
    for _ in range(rng.choice((1, 5, 20))):
        lines.insert(rng.randrange(len(lines)), lines[rng.randrange(len(lines))])
        lines.pop(rng.randrange(len(lines)))
    return b"".join(lines)


def noise(content: bytes, rng: random.Random) -> bytes:
    """Random bytes, with the beginning and the end of the real file or without."""
    middle = rng.randbytes(rng.randrange(1, 3000))
    return middle if rng.random() < 0.3 else content[:300] + middle + content[-200:]


DAMAGES: tuple[Callable[[bytes, random.Random], bytes], ...] = (flipped, cut, renumbered, shuffled, noise)


def short(raw: Raw) -> Raw:
    """The scene with few steps, plain defaults and nothing drawn."""
    analysis = raw.get("analysis")
    analysis = dict(analysis) if isinstance(analysis, dict) else {}
    for key in ("revolutions", "steps_per_revolution", "end_time", "step", "accuracy"):
        analysis.pop(key, None)
    analysis |= {"step": 1e-3, "end_time": 1e-3 * MOST_STEPS, "accuracy": "quick", "extrapolation_levels": 1}
    output = {"animation": {"frames_per_revolution": 12}, "plots": False, "picture": False, "csv": False}
    probes = raw.get("output", {}).get("probes") if isinstance(raw.get("output"), dict) else None
    return raw | {"analysis": analysis, "output": output | ({"probes": probes} if probes is not None else {})}
