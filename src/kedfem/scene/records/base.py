"""Base class of all records of the scene, and checks of names."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, StringConstraints, ValidationError, model_validator
from pydantic_core import InitErrorDetails

from kedfem.errors import Fault
from kedfem.scene.records.units import fault
from kedfem.scene.records.wording import shown

LONGEST, LONGEST_FILE = 100, 255  # names become parts of file names
NAME = re.compile(r"[^\W_](?:[\w \-]*\w)?")


class Record(BaseModel):
    """A frozen record of the scene that refuses unknown keys.

    exactly_one, at_least_one : keys of which so many must be given, and the words of the message for the first
    only_with : pairs of a key and another key that it needs
    """

    exactly_one: ClassVar[tuple[tuple[str, ...], str]] = ((), "")
    at_least_one: ClassVar[tuple[tuple[str, ...], str]] = ((), "")
    only_with: ClassVar[tuple[tuple[str, str], ...]] = ()
    model_config = ConfigDict(
        frozen=True, extra="forbid", validate_by_name=True, validate_by_alias=True, defer_build=True
    )

    @model_validator(mode="after")
    def _goes_together(self) -> Self:
        for keys, wanted in (self.exactly_one, self.at_least_one):
            given = [key for key in keys if getattr(self, key) is not None]
            if keys and not given:
                got = "neither" if len(keys) == 2 else "none of them"
                refuse([Fault(keys[:1], f"is required{wanted}, got {got}")])
            if len(given) > 1 and keys == self.exactly_one[0]:
                refuse([Fault((given[1],), f"cannot be combined with {given[0]}, got both")])
        refuse([
            Fault((key,), f"must be combined with {other}, got it alone") for key, other in self.only_with
            if getattr(self, other) is None and getattr(self, key) != type(self).model_fields[key].default
        ])  # fmt: skip
        return self

    def fill(self, **values: Any) -> Self:
        """Fill in defaults that depend on other keys; for validators of a record under construction."""
        for key, value in values.items():
            object.__setattr__(self, key, value)
        return self


def checked_name(name: str) -> str:
    """A name of a part of the scene: letters, digits, ``_``, ``-`` and inner spaces."""
    if not NAME.fullmatch(name):
        raise fault(f"must be a name of letters, digits, '_', '-' and inner spaces, got {shown(name)}")
    if len(name) > LONGEST:
        raise fault(f"must be a name of at most {LONGEST} letters, got one of {len(name)}: {shown(name)}")
    return name


def printable(text: str, what: str = "a line") -> str:
    """A text without control characters."""
    if control := [character for character in text if unicodedata.category(character) == "Cc"]:
        raise fault(f"must be {what} without control characters, got {control[0]!r}")
    return text


def checked_file(name: str) -> str:
    """A path without control characters, whose parts are short enough for a file system."""
    printable(name, "a path")
    longest = max(len(part.encode()) for part in name.replace("\\", "/").split("/"))
    if longest > LONGEST_FILE:
        raise fault(f"must be a path of names of at most {LONGEST_FILE} bytes, got one of {longest}")
    return name


Name = Annotated[str, AfterValidator(checked_name)]
FileName = Annotated[str, StringConstraints(min_length=1), AfterValidator(checked_file)]
Line = Annotated[str, AfterValidator(printable)]


@dataclass(frozen=True, slots=True)
class NameOf:
    """Table of the scene to whose entries the names in a field refer, or the ground."""

    section: str
    what: str
    ground: bool = False


LinkName = Annotated[str, NameOf("links", "a link")]
EndName = Annotated[str, NameOf("links", "a link", ground=True)]
JointName = Annotated[str, NameOf("joints", "a joint")]
MaterialName = Annotated[str, NameOf("materials", "a material")]


def plain(value: Any) -> Any:
    """Convert records, tuples and arrays to the dicts and lists that a TOML file would give."""
    if isinstance(value, BaseModel):
        return plain(value.model_dump(by_alias=True, exclude_none=True))
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return plain(value.tolist()) if hasattr(value, "tolist") else value


def refuse(faults: list[Fault]) -> None:
    """Raise all faults of a record under validation at once, each at its place; without faults do nothing."""
    if faults:
        details = [InitErrorDetails(type=fault(x.message), loc=x.where, input=None) for x in faults]
        raise ValidationError.from_exception_data("scene", details)
