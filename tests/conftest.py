"""For all tests: array shapes are checked as they run, nothing needs a display or is kept, random tests repeat in CI."""

import os
from collections import Counter
from collections.abc import Callable
from functools import wraps
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
FIRST = 20  # calls of a function in a test whose arrays are checked: to check all takes longer than the tests
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
    """jaxtyping's decorator, for classes, and for the first calls of functions that take or return arrays.

    It costs some 50 µs a call."""

    def decorated(x: Any) -> Any:
        if isinstance(x, FunctionType):
            hints = x.__annotations__.values()
            if not any(isinstance(hint, str) or of_arrays(hint) for hint in hints):
                return x
            checked = jaxtyped(typechecker=typechecker)(x)

            @wraps(x)
            def first(*args: Any, **kwargs: Any) -> Any:
                CALLS[x] += 1
                return (checked if CALLS[x] <= FIRST else x)(*args, **kwargs)

            return first
        return jaxtyped(typechecker=typechecker)(x)

    return decorated


def of_arrays(hint: object) -> bool:
    """Whether an annotation stands for an array, one or None, or so many of them."""
    if get_origin(hint) in (UnionType, Union, tuple):
        kinds = set(get_args(hint)) - {NoneType}
        return bool(kinds) and all(of_arrays(kind) for kind in kinds)
    return isinstance(hint, type) and issubclass(hint, AbstractArray)


jaxtyping.jaxtyped = jaxtyped_arrays  # what its hook puts on everything
install_import_hook(ALL, "tests.conftest.shapes_checked")  # before the first import of kedfem


def pytest_runtest_setup() -> None:
    """The first calls are those of each test."""
    CALLS.clear()


@pytest.hookimpl(tryfirst=True)  # before -m chooses
def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark tests of laws and numbers that are no long studies, which .ci/run repeats with other BLAS and numba kernels;
    then those that the default run leaves out as they are slow, some of which other kernels or .ci/run leave out too."""
    lists = {"aside": listed(ASIDE), "slow": listed(LIST), "study": listed(STUDIES)}
    for item in items:
        if item.path.parent.name in NUMERICAL and not item.get_closest_marker("long"):
            item.add_marker("kernels")
        for mark, names in lists.items():
            if item.nodeid in names:
                item.add_marker(mark)
                item.add_marker("long")
