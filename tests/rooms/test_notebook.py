"""The bar of notebooks: what it shows of a stage, how often, and what is said where there is no notebook."""

import sys
from types import SimpleNamespace

import pytest

from kedfem.errors import OutputError
from kedfem.notebook import bar, progress


def test_a_bar_shows_what_is_counted_and_escapes_names() -> None:
    assert bar("steps", 3, 10, 1.2) == '<progress value="3" max="10"></progress> steps 3 of 10 (1 s)'
    assert bar("a < b", 0, 0, 0) == "<progress ></progress> a &lt; b  (0 s)"


def test_every_stage_and_every_end_is_shown_but_not_every_step(monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[str] = []
    handle = SimpleNamespace(update=shown.append)
    page = SimpleNamespace(HTML=str, display=lambda text, display_id: handle)
    monkeypatch.setitem(sys.modules, "IPython.display", page)  # type: ignore[arg-type]
    with progress() as watch:
        watch("mesh", 0, 0)
        for done in range(2001):
            watch("steps", done, 2000)
    assert "mesh" in shown[0]
    assert "steps 0 of 2000" in shown[1]
    assert "steps 2000 of 2000" in shown[-2]
    assert shown[-1].startswith("done after")
    assert len(shown) < 50  # at most ten a second, not 2000


def test_an_error_is_not_told_as_done(monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[str] = []
    page = SimpleNamespace(HTML=str, display=lambda text, display_id: SimpleNamespace(update=shown.append))
    monkeypatch.setitem(sys.modules, "IPython.display", page)  # type: ignore[arg-type]
    with pytest.raises(ZeroDivisionError), progress():
        1 / 0  # noqa: B018
    assert shown[-1].startswith("stopped after")


def test_without_a_notebook_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "IPython.display", None)  # type: ignore[arg-type]
    with pytest.raises(OutputError, match="no IPython; pip install jupyterlab"), progress():
        pass
