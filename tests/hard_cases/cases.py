"""The registry of hard cases: each is either right to a stated tolerance, or refused with a message that says why.

`test_table.py` asserts every outcome; ``python -m tests.hard_cases`` writes them to docs/hard-cases.md.
To add a module of cases, name it in MODULES.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module

from kedfem.errors import KedfemError

MODULES = ("space",)


@dataclass(frozen=True, slots=True)
class Right:
    """An answer beside its reference: what is compared, the error and the tolerance, in the same unit."""

    what: str
    error: float
    tolerance: float


@dataclass(frozen=True, slots=True)
class Refused:
    """A refusal: what was tried, the message, and the words that it must have."""

    what: str
    message: str
    words: str


Outcome = Right | Refused


@dataclass(frozen=True, slots=True)
class Case:
    """A function that returns outcomes, and its name in the table; long: not in the default run."""

    name: str
    outcomes: Callable[[], Sequence[Outcome]]
    long: bool


_registered: list[Case] = []


def case(
    name: str, *, long: bool = False
) -> Callable[[Callable[[], Sequence[Outcome]]], Callable[[], Sequence[Outcome]]]:
    """Register a function as a case."""

    def registered(outcomes: Callable[[], Sequence[Outcome]]) -> Callable[[], Sequence[Outcome]]:
        _registered.append(Case(name, outcomes, long))
        return outcomes

    return registered


def refused(what: str, attempt: Callable[[], object], words: str) -> Refused:
    """The refusal of what is attempted; an empty message if it goes through."""
    try:
        attempt()
    except KedfemError as error:
        return Refused(what, str(error), words)
    return Refused(what, "", words)


def all_cases() -> list[Case]:
    """All cases of MODULES, in their order."""
    for module in MODULES:
        import_module(f"{__package__}.{module}")
    return list(_registered)
