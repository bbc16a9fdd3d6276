"""Cross checks of [fatigue]: names that must exist, links that must have stress."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from kedfem.errors import Fault
from kedfem.scene.checks.parts import Parts, category
from kedfem.scene.records.wording import unknown_name


def fatigue_faults(parts: Parts) -> Iterator[Fault]:
    """Names that do not exist, links without stress, and what has no period."""
    entry = parts.fatigue
    if not entry.where:
        return
    for name in _named(entry.raw, "materials"):
        if name not in parts.materials:
            yield Fault(("fatigue", "materials", name), unknown_name("a material", name, parts.materials))
    for name in _named(entry.raw, "links"):
        if name not in parts.links:
            yield Fault(("fatigue", "links", name), unknown_name("a link", name, parts.links))
        elif category(parts.links[name]) == "rigid":
            yield Fault(("fatigue", "links", name), "must name an elastic link, got a rigid one")
    materials, links = _named(entry.raw, "materials"), _named(entry.raw, "links")
    if not (materials or links) or {*links} - {*parts.links} or {*materials} - {*parts.materials}:
        return
    elastic = {name: link for name, link in parts.links.items() if category(link) != "rigid"}
    if elastic.keys().isdisjoint(links) and not any(
        x.word("material") in materials for x in elastic.values()
    ):
        got = "data of none of them" if elastic else "rigid links only"
        yield Fault(entry.where, f"must have data of an elastic link or of its material, got {got}")


def _named(raw: Mapping[str, Any], key: str) -> list[str]:
    found = raw.get(key)
    return [str(name) for name in found] if isinstance(found, Mapping) else []
