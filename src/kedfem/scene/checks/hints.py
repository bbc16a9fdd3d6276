"""The types of the scene's keys, by place, for messages and for the reference of keys."""

from __future__ import annotations

import types
from collections.abc import Callable, Iterator, Mapping
from functools import cache
from typing import Annotated, Any, Literal, Union, get_args, get_origin

from pydantic import BaseModel
from pydantic.fields import FieldInfo

from kedfem.errors import Where
from kedfem.scene.records.points import AxisPoints, construction_of, is_construction
from kedfem.scene.records.shapes import with_kind
from kedfem.scene.records.units import Quantity


def members(hint: Any) -> tuple[Any, ...]:
    """The alternatives of a type, without annotations.

    They are not cached: to Python, choices of the same words in another order are equal.
    """
    if get_origin(hint) is Annotated:
        return members(get_args(hint)[0])
    if get_origin(hint) in {Union, types.UnionType}:
        return tuple(each for part in get_args(hint) for each in members(part))
    return (hint,)


@cache
def models(hint: Any) -> tuple[type[BaseModel], ...]:
    """The records among the alternatives of a type."""
    return tuple(x for x in members(hint) if isinstance(x, type) and issubclass(x, BaseModel))


def options(hint: Any) -> list[Any]:
    """The fixed words or numbers among the alternatives of a type."""
    return [word for part in members(hint) if get_origin(part) is Literal for word in get_args(part)]


@cache
def kind_of(model: type[BaseModel]) -> str | None:
    """The value of the `kind` key of a record that is one of several; else None."""
    field = model.model_fields.get("kind")
    one = field is not None and len(get_args(field.annotation)) == 1
    return str(field.default) if field is not None and one and isinstance(field.default, str) else None


def length_of(hint: Any) -> int:
    """The number of values in a type that is a list of fixed length."""
    return max((len(get_args(part)) for part in members(hint) if get_origin(part) is tuple), default=0)


def field_hint(field: FieldInfo) -> Any:
    """The type of a field with its annotations."""
    hint: Any = field.annotation
    for extra in field.metadata:
        hint = Annotated[hint, extra]
    return hint


@cache
def keys(model: type[BaseModel]) -> dict[str, FieldInfo]:
    """The keys of a record as written in a scene, and their fields."""
    return {field.alias or name: field for name, field in model.model_fields.items()}


@cache
def key_hints(model: type[BaseModel]) -> dict[str, Any]:
    """The types of a record's keys."""
    return {key: field_hint(field) for key, field in keys(model).items()}


@cache
def marks(hint: Any, kind: Any) -> frozenset[Any]:
    """Annotations of one class in a type, such as its quantities, or the table whose entry it names."""
    own = get_args(hint)[1:] if get_origin(hint) is Annotated else ()
    found = frozenset(extra for extra in own if isinstance(extra, kind))
    return found.union(*(marks(part, kind) for part in get_args(hint) if not isinstance(part, (str, int))))


def construction(hint: Any, raw: Mapping[str, Any]) -> type[BaseModel] | None:
    """The record of a table that constructs a point or an axis; None if it constructs neither."""
    if not marks(hint, Quantity) or (models(hint) and not is_construction(raw)):
        return None
    tuples = (part for part in members(hint) if get_origin(part) is tuple)
    units = {frozenset(x.unit for x in marks(part, Quantity)) for part in tuples}
    if units == {frozenset({"m"})}:
        return construction_of(raw)
    return AxisPoints if units == {frozenset({"1"})} else None


def below(hint: Any, part: str | int, raw: Any) -> Any:
    """The type of a key or item of input of a type; None if it has no such key."""
    if hint is None:
        return None
    for member in members(hint):
        inner = get_args(member)
        if get_origin(member) is dict and isinstance(part, str):
            return inner[1]
        if get_origin(member) is tuple and isinstance(part, int):
            return inner[0] if inner[-1] is Ellipsis or part >= len(inner) else inner[part]
    if isinstance(raw, Mapping) and (constructed := construction(hint, raw)) is not None:
        hint = constructed
    for model in models(hint):
        wanted = with_kind(raw).get("kind") if isinstance(raw, dict) else None
        if part in keys(model) and (kind_of(model) in [None, wanted]):
            return key_hints(model)[str(part)]
    return None


def walk(raw: Any, hint: Any, where: Where = ()) -> Iterator[tuple[Where, Any, Any]]:
    """Place, value and type of raw input and of all that it contains, tables and lists before their contents."""
    yield where, raw, hint
    items = raw.items() if isinstance(raw, Mapping) else enumerate(raw) if isinstance(raw, list) else ()
    for key, value in items:
        yield from walk(value, below(hint, key, raw), (*where, key))


def replaced(raw: Any, hint: Any, of: Callable[[Where, Any, Any], Any], where: Where = ()) -> Any:
    """A copy of raw input with values replaced by a function of place, value and type; unchanged values are searched."""
    made = of(where, raw, hint)
    if made is raw and isinstance(raw, Mapping):
        return {key: replaced(x, below(hint, key, raw), of, (*where, key)) for key, x in raw.items()}
    if made is raw and isinstance(raw, list):
        return [replaced(x, below(hint, k, raw), of, (*where, k)) for k, x in enumerate(raw)]
    return made


def walked(loc: Where, hint: Any, raw: Any) -> tuple[Where, Any, Any]:
    """Place of an error of pydantic without names of union members, and the type and the raw input there."""
    where: list[str | int] = []
    for part in loc:
        known = {kind_of(model) for model in models(hint)} - {None}
        if part == "[key]" or (len(known) > 1 and part in known):
            continue
        hint = below(hint, part, raw)
        if isinstance(part, int) and isinstance(raw, Mapping):
            continue  # a table stands for a list of one
        where.append(part)
        try:
            raw = raw[part]
        except (KeyError, IndexError, TypeError):
            raw = None
    return tuple(where), hint, raw


def known_keys(hint: Any, raw: Any) -> list[str]:
    """The keys that raw input of a type may have; if there are several kinds, those of its own kind."""
    kind = with_kind(raw).get("kind") if isinstance(raw, dict) else None
    made = construction(hint, raw) if isinstance(raw, Mapping) else None
    hint = made or hint
    return [key for model in models(hint) if kind_of(model) in [None, kind] for key in keys(model)]


def kinds_with(key: str, hint: Any) -> list[str]:
    """The kinds, among several records of a type, that have a key."""
    return [kind for model in models(hint) if (kind := kind_of(model)) and key in keys(model)]
