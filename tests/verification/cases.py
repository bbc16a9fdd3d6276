"""The registry of verification cases: published or analytic numbers, and what kedfem finds instead.

A case is a function that returns rows. Its decorator gives it a name and a source:

    @case("NAFEMS FV32", "NAFEMS: The Standard NAFEMS Benchmarks (1990), test FV32")
    def tapered_membrane() -> list[Row]: ...

`test_published.py` asserts every row; ``python -m tests.verification`` writes them to docs/verification.md.
To add a module of cases, name it in MODULES.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from importlib import import_module

MODULES = (
    "vibrations",
    "single_links",
    "statics",
    "planes",
    "spatial_beams",
    "space_statics",
    "histories",
    "rotation",
    "stiffening",
    "kinematics",
    "spatial_kinematics",
    "mechanisms",
    "multibody",
    "rigid_body_frames",
    "corotational",
    "cad",
    "concentrations",
)


@dataclass(frozen=True, slots=True)
class Row:
    """One number beside its reference.

    quantity : what it is, with its unit
    reference, got : published (or exact) and kedfem's value; a reference of 0 makes the error absolute
    cap : greatest error that passes: relative, or absolute if the reference is 0
    model : mesh and unknowns
    """

    quantity: str
    reference: float
    got: float
    cap: float
    model: str = ""

    @property
    def error(self) -> float:
        """Signed error: relative, or absolute if the reference is 0."""
        return self.got - self.reference if self.reference == 0 else self.got / self.reference - 1


@dataclass(frozen=True, slots=True)
class Case:
    """A function that returns rows, its name in the table and its source; long: not in the default run."""

    name: str
    source: str
    rows: Callable[[], Sequence[Row]]
    long: bool


_registered: list[Case] = []


def case(
    name: str, source: str, *, long: bool = False
) -> Callable[[Callable[[], Sequence[Row]]], Callable[[], Sequence[Row]]]:
    """Register a function as a case."""

    def registered(rows: Callable[[], Sequence[Row]]) -> Callable[[], Sequence[Row]]:
        _registered.append(Case(name, source, rows, long))
        return rows

    return registered


def all_cases() -> list[Case]:
    """All cases of MODULES, in their order."""
    for module in MODULES:
        import_module(f"{__package__}.{module}")
    return list(_registered)
