"""Words and values in messages."""

from __future__ import annotations

from collections.abc import Iterable
from difflib import get_close_matches
from typing import Any

from kedfem.scene.old_words import KEYS, VALUES


def nearest(word: str, known: Iterable[str]) -> str | None:
    """The known word that ``word`` was renamed to, or that looks most like it; None if there is none."""
    lower = {name.lower(): name for name in known}
    for renamed in (KEYS, VALUES):
        if renamed.get(word) in lower:
            return renamed[word]
    close = get_close_matches(word.lower(), lower, n=1, cutoff=0.65)
    return lower[close[0]] if close else None


def unknown_name(what: str, word: str, known: Iterable[str]) -> str:
    """The message about a word that is not among the known ones."""
    names = list(known)
    close = nearest(word, names)
    hint = f"did you mean {close!r}?" if close else f"known: {', '.join(names) or 'none'}"
    return f"must name {what}, got {word!r}, {hint}"


def shown(value: Any) -> str:
    """A value as it stands in a message: shortened if it is long."""
    if value is None:
        return "nothing"
    text = {True: "true", False: "false"}[value] if isinstance(value, bool) else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
