"""Names in the scene that must be those of its entries, wherever a key is such a name."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, get_args, get_origin

from kedfem.errors import Fault
from kedfem.scene.checks.hints import marks, members, walk
from kedfem.scene.checks.parts import Parts
from kedfem.scene.records.base import NameOf
from kedfem.scene.records.links import GROUND
from kedfem.scene.records.scene import Scene
from kedfem.scene.records.wording import unknown_name


def reference_faults(parts: Parts) -> Iterator[Fault]:
    """Names of links, joints and materials that do not exist; where a table is not there at all that is the fault."""
    known = {"links": [*parts.links], "joints": [*parts.joints], "materials": parts.materials}
    for where, value, hint in walk(parts.raw, Scene):
        names = [(where, value, hint)] if isinstance(value, str) and str in members(hint) else []
        if isinstance(value, dict) and (keys := key_hint(hint)):
            names = [((*where, name), name, keys) for name in value]
        for place, name, kind in names:
            for of in marks(kind, NameOf):
                wanted = [*known[of.section], *([GROUND] if of.ground else [])]
                if known[of.section] and name not in wanted:
                    yield Fault(place, unknown_name(of.what, name, wanted))


def key_hint(hint: Any) -> Any:
    """The type of the names of a table's entries."""
    return next((get_args(part)[0] for part in members(hint) if get_origin(part) is dict), None)
