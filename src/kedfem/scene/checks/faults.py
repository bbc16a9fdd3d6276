"""Errors of pydantic as faults of a scene: what is required, what was given."""

from __future__ import annotations

from typing import Any

from pydantic import ValidationError
from pydantic_core import ErrorDetails

from kedfem.errors import Fault, Where
from kedfem.scene.checks.hints import kind_of, kinds_with, known_keys, length_of, marks, models, options, walked
from kedfem.scene.records.units import Quantity
from kedfem.scene.records.wording import either, one_of, shown, unknown_key

WANTED = {
    "model_type": "must be a table of keys", "model_attributes_type": "must be a table of keys",
    "dict_type": "must be a table of keys", "tuple_type": "must be a list", "string_type": "must be a text",
    "string_too_short": "must be a text that is not empty", "bool_type": "must be true or false",
    "int_type": "must be a whole number", "int_from_float": "must be a whole number",
    "invalid_key": "must be a key that is a text",
}  # fmt: skip


def record_faults(error: ValidationError, hint: Any, raw: Any, prefix: Where = ()) -> list[Fault]:
    """Faults that pydantic found in raw input of a type at a place in the scene."""
    found = (described(detail, hint, raw).under(*prefix) for detail in error.errors(include_url=False))
    return list(dict.fromkeys(found))  # missing values of one list are one fault


def described(detail: ErrorDetails, hint: Any, raw: Any) -> Fault:
    """The fault for one of pydantic's errors."""
    where, here, _ = walked(detail["loc"], hint, raw)
    _, _, holder = walked(detail["loc"][:-1], hint, raw)
    if where and isinstance(where[-1], int) and isinstance(holder, (str, int, float)):
        where = where[:-1]  # one number stands for several
    if where and detail["type"] == "missing" and isinstance(where[-1], int):
        _, above, _ = walked(detail["loc"][:-1], hint, raw)
        return Fault(where[:-1], f"must hold {length_of(above)} values, got {len(detail['input'])}")
    if detail["type"] in {"union_tag_not_found", "union_tag_invalid"}:
        return Fault((*where, "kind"), kind_message(here, detail["input"]))
    if detail["type"] == "extra_forbidden":
        _, above, inside = walked(detail["loc"][:-1], hint, raw)
        known = known_keys(above, inside)
        if len(where) > 1 and where[-1] in known_keys(hint, raw) and where[-1] not in known:
            wanted = f"unknown key, {where[-1]!r} belongs to the scene itself, before its first table"
            return Fault(where, wanted)
        key = str(where[-1])
        return Fault(where, unknown_key(key, known, kinds_with(key, above)))
    return Fault(where, message(detail, here))


def message(detail: ErrorDetails, hint: Any) -> str:
    """The message for one of pydantic's errors about input of a type."""
    ctx, got = detail.get("ctx", {}), detail["input"]
    match detail["type"]:
        case "kedfem":
            text = str(ctx["message"])
        case "missing":
            text = f"is required{choice(hint)}, got nothing"
        case "literal_error":
            text = one_of(options(hint), got)
        case "greater_than_equal":
            text = f"must be at least {ctx['ge']}, got {shown(got)}"
        case "less_than_equal":
            text = f"must be at most {ctx['le']}, got {shown(got)}"
        case "too_short" | "too_long":
            bound = f"at least {ctx['min_length']}" if "min_length" in ctx else f"at most {ctx['max_length']}"
            text = f"must hold {bound}, got {ctx['actual_length']}"
        case kind:
            text = f"{WANTED.get(kind, detail['msg'])}, got {shown(got)}"
    return text


def kind_message(hint: Any, got: Any) -> str:
    """The message about the `kind` of input that may be one of several records."""
    kinds = [kind for model in models(hint) if (kind := kind_of(model))]
    if isinstance(got, dict) and "kind" in got:
        return one_of(kinds, got["kind"])
    return f"is required, {either(kinds)}, got nothing"


def choice(hint: Any) -> str:
    """The words to choose from, or the unit, as they follow 'is required'."""
    if options(hint):
        return f", {either(options(hint))}"
    brackets = {quantity.bracket for quantity in marks(hint, Quantity)}
    return brackets.pop() if len(brackets) == 1 else ""
