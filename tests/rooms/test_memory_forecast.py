"""What does not fit in the free memory is refused from its count alone, before it is made or assembled."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

from kedfem.dynamics.matrices import cholesky
from kedfem.dynamics.stepping import cost, levels
from kedfem.dynamics.stepping.levels import level_steps
from kedfem.errors import MeshError, SolveError
from kedfem.links import build
from kedfem.mesh import link
from kedfem.mesh import memory_forecast as room
from kedfem.mesh.memory_forecast import FACTOR_BYTES, LINK_BYTES, check_memory
from kedfem.scene import scene_from


def arm(**changes: Any) -> Any:
    shape = {"kind": "bar", "between": [[0, 0], [1, 0]], "width": 0.2, "thickness": 0.1}
    raw = {
        "links": {"arm": {"material": "steel", "shape": shape, **changes}},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]}},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 1}},
        "analysis": {"revolutions": 1},
    }
    return scene_from(raw)


def test_five_million_unknowns_are_refused_before_they_are_meshed(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bar of 1.3 million hexahedra: neither nodes nor matrices are made."""
    monkeypatch.setattr(room, "free_memory", lambda: 64e9)
    for never in ("swept_mesh", "checked_mesh"):
        monkeypatch.setattr(link, never, lambda *_: pytest.fail("was meshed"))
    monkeypatch.setattr(build, "solid_link", lambda *_: pytest.fail("was assembled"))
    with pytest.raises(MeshError) as caught:
        build.bare_link(arm(mesh={"elements": [330, 70, 18]}), "arm")
    assert str(caught.value) == (
        "links.arm: must fit in the free memory of 64 GB, got about 4,989,600 unknowns, which take at least 270 GB "
        "(matrices 24.9, their factor 245); take larger elements (mesh.size, mesh.elements, mesh.unknowns): at most "
        "about 1,800,000 unknowns would fit"
    )


def test_too_many_unknowns_asked_for_are_refused_before_they_are_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """In the search for a mesh of so many no solid is made that does not fit."""
    monkeypatch.setattr(room, "free_memory", lambda: 2e8)
    swept, most = link.swept_mesh, 60_000  # unknowns

    def never_large(*given: Any) -> Any:
        mesh = swept(*given)
        assert 3 * len(mesh.points) < most
        return mesh

    monkeypatch.setattr(link, "swept_mesh", never_large)
    shape = {"kind": "plate_link", "between": [[0, 0], [1, 0]], "width": 0.1, "thickness": 0.02, "bore_diameter": 0.05}
    with pytest.raises(MeshError, match=r"links\.arm: must fit in the free memory of 0\.2 GB, got about"):
        build.bare_link(arm(shape=shape, mesh={"unknowns": 400_000}), "arm")


def test_the_forecast_is_below_the_count_that_is_made(monkeypatch: pytest.MonkeyPatch) -> None:
    """Nobody is refused whose mesh would have fitted; the count is near for large meshes."""
    for element in ("hex8", "hex20", "hex27", "tet10"):
        said: list[float] = []
        monkeypatch.setattr(link, "check_memory", lambda where, count, *_, said=said: said.append(count))
        made = link.link_mesh("arm", arm(element=element, mesh={"elements": [20, 12, 10]}).links["arm"], Path())
        assert said[1] == 3 * len(made.points)
        assert 0.75 * said[1] < said[0] <= said[1]


@pytest.mark.parametrize(
    ("kind", "plane", "fits"), [("solid", False, False), ("rigid", False, True), ("plane", True, True)]
)
def test_what_is_not_factored_or_flat_takes_less(
    monkeypatch: pytest.MonkeyPatch, kind: str, plane: bool, fits: bool
) -> None:
    N = 1e6
    monkeypatch.setattr(room, "free_memory", lambda: LINK_BYTES * N + 0.5 * FACTOR_BYTES * N**1.5)
    if fits:
        check_memory("links.arm", N, kind != "rigid", plane)
    else:
        with pytest.raises(MeshError, match="must fit in the free memory"):
            check_memory("links.arm", N, kind != "rigid", plane)


def test_links_that_fit_alone_but_not_together_are_refused_before_they_are_factored(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    from kedfem.accuracy.prepared import meshed

    scene = arm(mesh={"elements": [4, 1, 1]})
    model = meshed(scene).model
    need = cost.factor_bytes(model)
    monkeypatch.setattr(levels, "free_memory", lambda: 0.9 * need)
    monkeypatch.setattr(levels, "steps_of", lambda *_: pytest.fail("was factored"))
    with pytest.raises(SolveError, match=r"links: must have factors that fit in the free memory"):
        level_steps(scene, model)


def test_a_factor_that_fills_in_more_than_was_forecast_is_refused_before_its_numbers_are(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A thick block's is larger than a plate's of as many unknowns; CHOLMOD's own count of it is asked."""
    n = 12
    row = sp.diags_array([-1.0, 2.1, -1.0], offsets=[-1, 0, 1], shape=(n, n))
    A = sp.csr_array(sp.kronsum(sp.kronsum(row, row), row))
    factor = cholesky.Cholesky(A, "block").factor
    size = cholesky.laid_out(factor, n**3)  # with zeros where its blocks are full
    assert 0.6 * size < 8 * len(cholesky.cholmod.getfactor(factor)) <= size
    monkeypatch.setattr(cholesky, "SLOW", n**3)
    monkeypatch.setattr(cholesky, "free_memory", lambda: 1.01 * size)
    cholesky.Cholesky(A, "block")
    monkeypatch.setattr(cholesky, "free_memory", lambda: 0.5 * size)
    monkeypatch.setattr(cholesky.cholmod, "numeric", lambda *_: pytest.fail("was factored"))
    with pytest.raises(SolveError, match=r"block: must have a factor that fits .* about 1,100 unknowns would fit"):
        cholesky.Cholesky(A, "block")


def test_a_long_factorisation_is_told_with_unknowns_and_memory(monkeypatch: pytest.MonkeyPatch) -> None:
    from kedfem.accuracy.prepared import meshed

    model = meshed(arm(mesh={"elements": [4, 1, 1]})).model
    assert cost.factor_words(model) == "factor"
    monkeypatch.setattr(cost, "TRIED", 10)
    words = cost.factor_words(model)
    assert words.startswith(f"factor: {model.unknowns:,} unknowns, about ")
    assert np.isfinite(float(words.split()[-2]))
