"""Memory of a run between time points, as names, numbers and arrays that can be stored and restored.

A class with a tuple REMEMBERED names the attributes that change while a run steps; the others are made anew from the
scene. Records (dataclasses and named tuples of kedfem) are stored by the names of their fields. Nothing is pickled: what
is read can make records, and nothing else.
"""

import json
from collections.abc import Mapping
from dataclasses import fields, is_dataclass
from importlib import import_module
from io import BytesIO
from typing import Any
from zipfile import BadZipFile

import numpy as np

TREE = "tree"
NUMBERED = "array{}"


def packed(content: Mapping[str, Any]) -> bytes:
    """Names and what belongs to them as the content of a file.

    Raises
    ------
    TypeError
        Something is neither a number, a text, an array, a record, nor made up of such.
    """
    arrays: list[np.ndarray] = []
    tree = json.dumps({name: _plain(value, arrays) for name, value in content.items()}).encode()
    out = BytesIO()
    named = {NUMBERED.format(k): x for k, x in enumerate(arrays)}
    np.savez(out, allow_pickle=False, **{TREE: np.frombuffer(tree, np.uint8)}, **named)
    return out.getvalue()


class Packed:
    """The content of a file of `packed`.

    Raises
    ------
    ValueError
        It is no such content.
    """

    def __init__(self, content: bytes) -> None:
        try:
            self._file = np.load(BytesIO(content), allow_pickle=False)
            self.content: dict[str, Any] = json.loads(bytes(self._file[TREE]))
        except (OSError, EOFError, BadZipFile, KeyError, TypeError) as error:
            raise ValueError(f"content that is not what was written ({error})") from error

    def put_back(self, name: str, onto: Any = None) -> Any:
        """What belongs to a name; put back in place where that is an object with REMEMBERED.

        Raises
        ------
        ValueError
            There is no such name, or it holds what kedfem does not know.
        """
        try:
            return self._made(self.content[name], onto)
        except (KeyError, TypeError, AttributeError, ImportError, BadZipFile, IndexError) as error:
            raise ValueError(f"{name} that is not what was written ({error})") from error

    def _made(self, x: Any, onto: Any = None) -> Any:
        if not isinstance(x, dict):
            return x
        ((kind, content),) = x.items()
        made = self._remembered(content, onto) if kind == "remembered" else None
        match kind:
            case "array":
                made = self._file[NUMBERED.format(content)]
            case "scalar":
                made = self._file[NUMBERED.format(content)][()]
            case "list" | "tuple":
                before = onto if isinstance(onto, list | tuple) and len(onto) == len(content) else [None] * len(content)
                every = [self._made(y, each) for y, each in zip(content, before, strict=True)]
                made = every if kind == "list" else tuple(every)
            case "dict":
                made = {self._made(k): self._made(y) for k, y in content}
            case "record":
                made = _record(content[0])(**{k: self._made(y) for k, y in content[1].items()})
        return made

    def _remembered(self, content: dict[str, Any], onto: Any) -> Any:
        for each in type(onto).REMEMBERED:
            setattr(onto, each, self._made(content[each], getattr(onto, each, None)))
        return onto


def _plain(x: Any, arrays: list[np.ndarray]) -> Any:
    """Something as JSON, its arrays beside it."""
    if x is None or isinstance(x, bool | int | str) or type(x) is float:
        return x
    if isinstance(x, np.ndarray | np.generic):
        if x.dtype.hasobject:
            raise TypeError("must be numbers, got an array of objects")
        arrays.append(np.asarray(x))
        return {"array" if isinstance(x, np.ndarray) else "scalar": len(arrays) - 1}
    if isinstance(x, dict):
        return {"dict": [[_plain(k, arrays), _plain(y, arrays)] for k, y in x.items()]}
    if hasattr(type(x), "REMEMBERED"):
        return {"remembered": {name: _plain(getattr(x, name), arrays) for name in type(x).REMEMBERED}}
    if names := _fields(type(x)):
        named = {name: _plain(getattr(x, name), arrays) for name in names}
        return {"record": [f"{type(x).__module__}:{type(x).__qualname__}", named]}
    if isinstance(x, list | tuple):
        return {"list" if isinstance(x, list) else "tuple": [_plain(y, arrays) for y in x]}
    raise TypeError(f"must be numbers, texts, arrays or records, got {type(x).__qualname__}")


def _fields(kind: Any) -> tuple[str, ...]:
    """Names of a record's fields; none of what is no record of kedfem, or one that does something when it is made."""
    if not (isinstance(kind, type) and kind.__module__.startswith("kedfem.")):
        return ()
    if issubclass(kind, tuple):
        return tuple(getattr(kind, "_fields", ()))
    if not is_dataclass(kind) or hasattr(kind, "__post_init__"):
        return ()
    return tuple(each.name for each in fields(kind))


def _record(name: str) -> Any:
    module, _, kind = name.partition(":")
    if not module.startswith("kedfem."):
        raise TypeError(f"must be a record of kedfem, got {name}")
    found = getattr(import_module(module), kind)
    if not _fields(found):
        raise TypeError(f"must be a record of kedfem, got {name}")
    return found
