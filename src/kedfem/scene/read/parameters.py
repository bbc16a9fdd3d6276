"""`[parameters]` of a scene, and numbers that are expressions of them."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from kedfem.errors import Fault, Where
from kedfem.scene.checks.hints import members, replaced
from kedfem.scene.records.expressions import evaluated, plain_number
from kedfem.scene.records.units import NUMBER, OVERFLOW, UNIT, Evaluated, unit_registry
from kedfem.scene.records.wording import shown

SIGN = "="
"""First character of an expression."""
MOST_CHAINED = 30  # parameters that depend on each other


class FollowsError(ValueError):
    """A fault that follows from another one, which is reported at its own place."""


class Parameters(Mapping[str, Any]):
    """Quantities of parameters by name, evaluated on access; each fault is reported once, at its own place.

    Parameters
    ----------
    raw : the given `parameters` of the scene
    """

    def __init__(self, raw: object) -> None:
        self._raw = dict(raw) if isinstance(raw, Mapping) else {}
        self._found: dict[str, Any] = {}
        self._failed: dict[str, str] = {}
        self._pending: list[str] = []

    def __iter__(self) -> Iterator[str]:
        return iter(self._raw)

    def __len__(self) -> int:
        return len(self._raw)

    def __contains__(self, name: object) -> bool:
        return name in self._raw

    def __getitem__(self, name: str) -> Any:
        if name in self._failed:
            raise FollowsError
        if name in self._pending:
            circle = " → ".join([*self._pending[self._pending.index(name) :], name])
            raise ValueError(f"it must not be defined by itself: {circle}")
        if name not in self._found:
            if len(self._pending) >= MOST_CHAINED:
                wanted = f"must not be defined by each other more than {MOST_CHAINED} deep"
                raise ValueError(f"parameters {wanted}")
            self._pending.append(name)
            try:
                self._found[name] = self._quantity(self._raw[name])
            except ValueError as reason:
                echo, got = isinstance(reason, FollowsError), shown(self._raw[name])
                self._failed[name] = "" if echo else f"must be {WANTED}, got {got}: {reason}"
                raise FollowsError from None
            finally:
                self._pending.pop()
        return self._found[name]

    def faults(self) -> list[Fault]:
        """The faults of all parameters."""
        for name in self:
            try:
                self[name]
            except ValueError:
                continue
        return [Fault(("parameters", str(name)), message) for name, message in self._failed.items() if message]

    def _quantity(self, value: object) -> Any:
        if isinstance(value, str):
            number = NUMBER.fullmatch(value)
            if not value.startswith(SIGN) and not (number and (not number[2] or UNIT.fullmatch(number[2]))):
                raise ValueError("an expression begins with =")
            return evaluated(value.removeprefix(SIGN), self)
        if isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < OVERFLOW:
            return unit_registry().Quantity(float(value), "")
        raise ValueError("it is neither")


WANTED = "a number, a text of a number and a unit, or an expression"


def with_expressions(raw: Mapping[str, Any], hint: Any) -> tuple[dict[str, Any], list[Fault], set[Where]]:
    """A raw scene with its expressions evaluated, and faults.

    Returns
    -------
    A changed copy: numbers in place of expressions without a unit, `Evaluated` texts in place of others; expressions with
    a fault are unchanged. The faults. The places of faults that follow from those of parameters.
    """
    echoes: set[Where] = set()
    known = Parameters(raw.get("parameters"))
    faults = known.faults()

    def of(where: Where, value: Any, kind: Any) -> Any:
        if not isinstance(value, str) or not value.startswith(SIGN) or where[:1] == ("parameters",):
            return value
        if set(members(kind)) - {type(None)} == {str}:
            return value
        try:
            quantity = evaluated(value.removeprefix(SIGN), known)
        except FollowsError:
            echoes.add(where)
            return value
        except ValueError as reason:
            faults.append(Fault(where, f"must be an expression, got {shown(value)}: {reason}"))
            return value
        number = plain_number(quantity)
        if number is not None:
            return number
        text = Evaluated(value)
        text.quantity = quantity
        return text

    return replaced(raw, hint, of), faults, echoes
