"""Every outcome of the registry: right to its tolerance, or refused in the words that say why."""

import pytest

from .cases import Case, Right, all_cases
from .table import page

PARAMETERS = [pytest.param(c, id=c.name, marks=pytest.mark.long if c.long else ()) for c in all_cases()]


@pytest.mark.parametrize("case", PARAMETERS)
def test_a_hard_case_is_right_or_refused(case: Case) -> None:
    outcomes = case.outcomes()
    assert outcomes
    for each in outcomes:
        if isinstance(each, Right):
            assert each.error <= each.tolerance, each.what  # so that a nan is a miss
        else:
            assert each.words in each.message, each.what


def test_the_page_tells_both_kinds_of_outcome() -> None:
    quick = [case for case in all_cases() if not case.long][:2]
    text = page(quick)
    assert "right: error" in text
    assert "refused: joints." in text
