"""For all tests: array shapes are checked as they run, nothing needs a display or is kept, random tests repeat in CI."""

import os
from collections import Counter
from collections.abc import Callable
from dataclasses import is_dataclass
from functools import cache, wraps
from pathlib import Path
from types import FunctionType, NoneType, UnionType
from typing import Any, Union, get_args, get_origin

import jaxtyping
import pytest
from beartype import beartype
from hypothesis import settings
from jaxtyping import AbstractArray, install_import_hook, jaxtyped

from tests.slow import ASIDE, LIST, STUDIES, listed

os.environ.setdefault("MPLBACKEND", "Agg")
os.environ["KEDFEM_CACHE"] = "off"
settings.register_profile("here", deadline=None)
settings.register_profile("ci", deadline=None, derandomize=True, print_blob=True)
settings.load_profile("ci" if os.environ.get("CI") else "here")
PACKAGE = Path(__file__).parents[1] / "src" / "kedfem"
ALL = [
    ".".join(file.relative_to(PACKAGE.parent).with_suffix("").parts)
    for file in PACKAGE.rglob("*.py")
    if file.stem != "__init__" and not file.stem.endswith("kernel")  # numba compiles the kernels itself
]
FIRST = 3  # calls of a function in a test whose arrays are checked: to check all takes longer than the tests
CALLS = Counter[FunctionType]()
NUMERICAL = {"laws", "verification", "hard_cases"}  # folders


def shapes_checked(function: Callable[..., Any]) -> Callable[..., Any]:
    """The function, or beartype's version of it that checks arrays: mypy has seen to the other annotations.

    jaxtyping checks a call twice, the arguments alone (where it says that Any is returned), then with what was returned:
    the second time what was returned is enough, since the dimensions found are the first time's."""
    hints = function.__annotations__
    if hints.get("return") is not Any:
        hints = {"return": hints.get("return")}
    arrays = {name: hint for name, hint in hints.items() if of_arrays(hint)}
    if not arrays:
        return function
    function.__annotations__ = arrays
    return beartype(function)


def jaxtyped_arrays(typechecker: Any) -> Callable[[Any], Any]:
    """jaxtyping's decorator, for the first calls of functions with arrays, and of classes with fields of arrays.

    A checked call costs some 50 µs, and making a function's check more: it is made at the first call."""

    def decorated(x: Any) -> Any:
        if isinstance(x, type) and is_dataclass(x):
            x.__init__ = decorated(x.__init__)  # type: ignore[misc]
        if not isinstance(x, FunctionType) or not any(map(checkable, x.__annotations__.values())):
            return x
        checked = cache(lambda: jaxtyped(typechecker=typechecker)(x))

        @wraps(x)
        def first(*args: Any, **kwargs: Any) -> Any:
            CALLS[x] += 1
            return (checked() if CALLS[x] <= FIRST else x)(*args, **kwargs)

        return first

    return decorated


def checkable(hint: object) -> bool:
    """Whether an annotation may stand for arrays: of one that is still a string it is not known yet."""
    return isinstance(hint, str) or of_arrays(hint)


def of_arrays(hint: object) -> bool:
    """Whether an annotation stands for an array, one or None, or so many of them."""
    if get_origin(hint) in (UnionType, Union, tuple):
        kinds = set(get_args(hint)) - {NoneType}
        return bool(kinds) and all(of_arrays(kind) for kind in kinds)
    return isinstance(hint, type) and issubclass(hint, AbstractArray)


jaxtyping.jaxtyped = jaxtyped_arrays  # what its hook puts on everything
install_import_hook(ALL, "tests.conftest.shapes_checked")  # before the first import of kedfem


class Failures:
    """Each failure is named as it happens: a run that is ended, by a limit of its time, has no summary."""

    def __init__(self, config: pytest.Config) -> None:
        self._config = config

    @pytest.hookimpl(trylast=True)
    def pytest_runtest_logreport(self, report: pytest.TestReport) -> None:
        shown = self._config.pluginmanager.get_plugin("terminalreporter")
        if report.failed and shown is not None and "PYTEST_XDIST_WORKER" not in os.environ:
            why = [line for line in report.longreprtext.splitlines() if line.startswith("E ")]
            shown.write_line("\n" + "  ".join((report.nodeid, report.when or "", *why[:1])))


def pytest_configure(config: pytest.Config) -> None:
    """See `Failures`."""
    config.pluginmanager.register(Failures(config))


def pytest_runtest_setup() -> None:
    """The first calls are those of each test."""
    CALLS.clear()


@pytest.hookimpl(tryfirst=True)  # before -m chooses
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests of laws and numbers that are no long studies, for runs with other BLAS and numba kernels; then
    those that the default run leaves out as they are slow, some of which other kernels or .ci/run leave out too."""
    lists = {"aside": listed(ASIDE), "slow": listed(LIST), "study": listed(STUDIES)}
    for item in items:
        if item.path.parent.name in NUMERICAL and not item.get_closest_marker("long"):
            item.add_marker("kernels")
        for mark, names in lists.items():
            if item.nodeid in names:
                item.add_marker(mark)
                item.add_marker("long")
