"""Keys of a scene by their dotted names: which there are, which one is meant, and a scene with others' values."""

from collections.abc import Iterator, Mapping
from copy import deepcopy
from typing import Any

from kedfem.errors import SceneError, Where, place
from kedfem.scene import Scene
from kedfem.scene.checks.hints import below, known_keys
from kedfem.scene.records.wording import nearest

PARAMETERS = "parameters"


def located(name: str, raw: Mapping[str, Any]) -> Where:
    """The key of a scene that is meant: in full, a parameter's name, or without names in between if one key alone fits.

    Parameters
    ----------
    name : ``drive.motion.speed``, ``drive.speed``, ``links.rod.shape.between[1][0]``, or ``r`` for ``parameters.r``
    raw : keys and values of the scene

    Raises
    ------
    SceneError
        None fits, or several do.
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
    raise SceneError(
        f"--over {name}: must name a key of the scene or one of its parameters, got neither{hint}"
    )


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
    """Places of single values: those that are written, and those that tables which are there may have."""
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
    """The known key that looks most like a name, with or without the table of parameters and names in between."""
    forms = {short: full for full in reversed(known) for short in _shortened(full)}
    close = nearest(name, forms)
    return forms[close] if close else None


def _shortened(full: str) -> list[str]:
    parts = full.split(".")
    return [full, f"{parts[0]}.{parts[-1]}", *([parts[-1]] if parts[0] == PARAMETERS else [])]
