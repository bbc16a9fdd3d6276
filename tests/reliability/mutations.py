"""Scenes changed at random, by the types of their values; and any file by bytes. A seed gives the same change again."""

import copy
import random
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
    "(" * 2000, "beam", "rigid", "solid", "plane", "reduced", "auto", "co-rotational", "rest", "stress", "revolute",
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
        factor = rng.choice(
            [0.0, -1.0, 1.01, 0.5, 2.0, 10.0 ** rng.randint(-9, 9), 10.0 ** rng.randint(-3, 3)]
        )
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
