"""Errors that a user of kedfem can meet, each with its place."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

Where = tuple[str | int, ...]
"""The keys, and positions in lists, that lead to a place in a scene."""


def place(where: Where) -> str:
    """A place in a scene as text: ``links.crank.shape.between[1]``."""
    text = ""
    for part in where:
        text += f"[{part}]" if isinstance(part, int) else f".{part}" if text else part
    return text


@dataclass(frozen=True, slots=True)
class Fault:
    """What is wrong in a scene.

    where : its place; empty where it is of no key
    message : what was wanted, what was got
    """

    where: Where
    message: str

    def __str__(self) -> str:
        """One line for the user."""
        return f"{place(self.where)}: {self.message}" if self.where else self.message

    def under(self, *above: str | int) -> Fault:
        """The same of a part of something that stands at a place."""
        return Fault((*above, *self.where), self.message)


class KedfemError(Exception):
    """Base of all errors that kedfem raises on purpose; its text is written for the user."""


class SceneError(KedfemError):
    """The scene cannot be accepted: its faults are all that is wrong; a text is a fault of no key."""

    def __init__(self, faults: Iterable[Fault | str] | str) -> None:
        given = [faults] if isinstance(faults, str) else faults
        self.faults = tuple(dict.fromkeys(Fault((), x) if isinstance(x, str) else x for x in given))
        super().__init__("\n".join(map(str, self.faults)))


class MeshError(KedfemError):
    """A link cannot be meshed, or its mesh is not good enough."""


class MotionError(KedfemError):
    """The linkage cannot be assembled, locks, or moves freely without a drive."""


class SolveError(KedfemError):
    """The elastic solution cannot start or go on."""


class OutputError(KedfemError):
    """Results cannot be written or read."""


class PictureError(OutputError):
    """A picture cannot be drawn; the results are what they are without it."""
