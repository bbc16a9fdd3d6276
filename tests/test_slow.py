"""The lists of tests that the default run, and `.ci/run`, leave out."""

import subprocess
import sys
from pathlib import Path

import pytest

from tests.slow import ASIDE, KEPT, LIST, STUDIES, listed, slowest

LOG = """
3.00s call     tests/a.py::test_one[some, thing]
0.50s setup    tests/a.py::test_one[some, thing]
2.00s call     tests/b.py::test_two
1.00s teardown tests/b.py::test_two
2.50s call     tests/b.py::test_three
"""


def test_the_slowest_are_left_out_until_the_rest_is_quick() -> None:
    assert slowest(LOG, 9.0) == []
    assert slowest(LOG, 6.0) == ["tests/a.py::test_one[some, thing]"]
    assert slowest(LOG, 2.5) == ["tests/a.py::test_one[some, thing]", "tests/b.py::test_two"]


def test_random_mechanisms_stay() -> None:
    dear = f"9.00s call     {KEPT}[0]\n"
    assert slowest(LOG + dear, 9.0) == [
        "tests/a.py::test_one[some, thing]",
        "tests/b.py::test_three",
        "tests/b.py::test_two",
    ]


@pytest.mark.long
def test_all_that_are_listed_exist() -> None:
    """A test that has another name now would be in the default run, and nobody would see it."""
    asked = [sys.executable, "-m", "pytest", "--collect-only", "-q", "-m", ""]
    found = subprocess.run(asked, cwd=Path(__file__).parents[1], check=True, capture_output=True, text=True)
    lists = [listed(each) for each in (ASIDE, LIST, STUDIES)]
    assert set().union(*lists) - set(found.stdout.splitlines()) == set()
    assert len(set().union(*lists)) == sum(map(len, lists))
