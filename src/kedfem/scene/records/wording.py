"""Wording of messages about names, keys and values."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any

KEYS = {  # present keys by their former names, for messages about unknown words
    "functions": "reduction", "modes": "reduction", "reduced": "reduction", "fidelity": "model",
    "step": "shape", "file": "shape", "reduction": "reduction_tolerance", "port": "coupling",
    "turning_stiffness": "rotational_stiffness", "turning_damping": "rotational_damping",
    "spin": "angular_velocity", "turn": "rotation", "turns": "revolutions", "last_turns": "last_revolutions",
    "steps_per_turn": "steps_per_revolution", "frames_per_turn": "frames_per_revolution",
    "angle": "value", "travel": "value", "smooth": "smoothing",
    "levels": "extrapolation_levels", "exaggeration": "deformation_scale", "ignore": "defeature_size",
}  # fmt: skip
VALUES = {
    "nominal": "rigid-body", "following": "co-rotational", "literal": "monolithic",
    "averaged": "distributing", "stiff": "rigid", "table": "curve",
}  # fmt: skip
NOUNS = {"solid": "solid", "plane": "plane link", "beam": "beam"}  # links by their model


def percentage(x: float, digits: int = 2) -> str:
    """A ratio in percent, of any size without a power of ten.

    >>> percentage(0.01234), percentage(14.96, 3)
    ('1.2 %', '1500 %')
    """
    return f"{float(f'{100 * x:.{digits}g}'):g} %"


def nearest(word: str, known: Iterable[str]) -> str | None:
    """Known word to which ``word`` was renamed, or the most similar one; None if there is none."""
    lower = {name.lower(): name for name in known}
    for renamed in (KEYS, VALUES):
        if renamed.get(word) in lower:
            return renamed[word]
    close = get_close_matches(word.lower(), lower, n=1, cutoff=0.65)
    return lower[close[0]] if close else None


def unknown_name(what: str, word: str, known: Iterable[str]) -> str:
    """Message about a word that is not among the known ones."""
    names = list(known)
    close = nearest(word, names)
    hint = f"did you mean {close!r}?" if close else f"known: {', '.join(names) or 'none'}"
    return f"must name {what}, got {word!r}, {hint}"


def shown(value: Any) -> str:
    """A value as messages show it, shortened if it is long."""
    if value is None:
        return "nothing"
    text = {True: "true", False: "false"}[value] if isinstance(value, bool) else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def either(words: list[Any]) -> str:
    """'one of a, b, c', or a single word unchanged."""
    return ("one of " if len(words) > 1 else "") + ", ".join(str(word) for word in words)


def one_of(words: list[Any], got: Any) -> str:
    """Message about a word that is not one of the choices."""
    close = nearest(got, [str(word) for word in words]) if isinstance(got, str) else None
    return f"must be {either(words)}, got {shown(got)}" + (f", did you mean {close!r}?" if close else "")


def unknown_key(key: str, known: list[str], kinds: list[str]) -> str:
    """Message about a key that a record does not have; `kinds` are its alternatives that have it.

    >>> unknown_key("section", ["kind", "width"], ["polyline"])
    "unknown key, 'section' is one of kind polyline; known: kind, width"
    """
    if close := nearest(key, known):
        return f"unknown key, did you mean {close!r}?"
    of_kind = f"{key!r} is one of kind {' or '.join(kinds)}; " if kinds else ""
    return f"unknown key, {of_kind}known: {', '.join(known)}"
