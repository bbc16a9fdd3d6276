"""Every row of the registry against its reference, with an absolute cap on its error."""

import pytest

from .cases import Case, all_cases

PARAMETERS = [pytest.param(c, id=c.name, marks=pytest.mark.long if c.long else ()) for c in all_cases()]


@pytest.mark.parametrize("case", PARAMETERS)
def test_kedfem_meets_the_reference(case: Case):
    rows = case.rows()
    assert rows
    missed = [
        f"{row.quantity}: {row.reference:.8g} wanted, {row.got:.8g} got, error {row.error:.3g} > {row.cap:g}"
        for row in rows
        if not abs(row.error) <= row.cap  # so that a nan is a miss
    ]
    assert not missed, "\n".join(missed)
