"""What all records of the scene share."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Mapping
from typing import Annotated, Any, Self

from pydantic import AfterValidator, BaseModel, ConfigDict, StringConstraints, ValidationError
from pydantic_core import InitErrorDetails

from kedfem.errors import Fault
from kedfem.scene.records.units import fault
from kedfem.scene.records.wording import shown

LONGEST, LONGEST_FILE = 100, 255  # names become parts of file names
NAME = re.compile(r"[^\W_](?:[\w \-]*\w)?")


class Record(BaseModel):
    """A frozen record of the scene that refuses unknown keys."""

    model_config = ConfigDict(
        frozen=True,
        extra="forbid",
        validate_by_name=True,
        validate_by_alias=True,
    )

    def fill(self, **values: Any) -> Self:
        """Put in defaults that depend on other keys; for the validators of a record under construction."""
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


def checked_file(name: str) -> str:
    """A path without control characters, none of its parts too long for a disk."""
    if control := [character for character in name if unicodedata.category(character) == "Cc"]:
        raise fault(f"must be a path without control characters, got {control[0]!r}")
    longest = max(len(part.encode()) for part in name.replace("\\", "/").split("/"))
    if longest > LONGEST_FILE:
        raise fault(f"must be a path of names of at most {LONGEST_FILE} bytes, got one of {longest}")
    return name


def checked_line(text: str) -> str:
    """One line without control characters."""
    if control := [character for character in text if unicodedata.category(character) == "Cc"]:
        raise fault(f"must be a line without control characters, got {control[0]!r}")
    return text


Name = Annotated[str, AfterValidator(checked_name)]
FileName = Annotated[str, StringConstraints(min_length=1), AfterValidator(checked_file)]
Line = Annotated[str, AfterValidator(checked_line)]


def plain(value: Any) -> Any:
    """A scene given as records, tuples or arrays, as the dicts and lists that a TOML file would give."""
    if isinstance(value, BaseModel):
        return plain(value.model_dump(by_alias=True, exclude_none=True))
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(item) for item in value]
    return plain(value.tolist()) if hasattr(value, "tolist") else value


def refuse(faults: list[Fault]) -> None:
    """Raise all faults of a record under validation at once, each at its place in it; none: no error."""
    if faults:
        details = [InitErrorDetails(type=fault(x.message), loc=x.where, input=None) for x in faults]
        raise ValidationError.from_exception_data("scene", details)
