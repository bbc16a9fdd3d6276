"""Elastic motion where it is difficult: docs/theory/errors.md (Hard cases) lists what these cases find."""

from contextlib import suppress
from typing import Any

import meshio
import numpy as np
import pytest
from numpy.testing import assert_allclose

from kedfem.accuracy.histories import Histories, histories, relative_errors, worst
from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.reduction import prepared
from kedfem.accuracy.resolution import resolution, resolution_warnings, stability_warning
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.errors import SolveError
from kedfem.links.build import bare_link
from kedfem.mesh import SolidMesh, mesh_quality
from kedfem.scene import scene_from
from tests import scenes
from tests.rooms.test_dynamics import four_bar
from tests.scenes import bar, constant_speed, material

E, RHO, L = 2.1e11, 7850.0, 0.5


@pytest.fixture(autouse=True)
def _no_cache(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("KEDFEM_CACHE", "off")


def arm(model: str, elements: list[int], *, height: float = 0.01, nu: float = 0.3, **analysis: Any) -> dict[str, Any]:
    """A cantilever with a drive that stands still but for a hair, under its weight, and a probe at its tip."""
    mesh = {"elements": elements[0] if model == "beam" else elements[: 2 if model == "plane" else 3]}
    return scenes.arm(
        bar(L, height, height, model=model, mesh=mesh),
        constant_speed(1e-6),
        gravity=[0, -9.81, 0],
        materials={"steel": material(RHO, E, nu)},
        analysis={"initial": "quasi-static", "end_time": 0.1, "step": 1e-3, **analysis},
        output={"probes": {"tip": {"link": "arm", "at": [L, 0], "quantity": "displacement"}}},
    )


def reduced(raw: dict[str, Any], modes: int | str = "modal") -> dict[str, Any]:
    return {**raw, "links": {name: {**link, "reduction": modes} for name, link in raw["links"].items()}}


def run(raw: dict[str, Any]) -> Histories:
    return histories(prepared(scene_from(raw))[0])


def tip(found: Histories) -> np.ndarray:
    return found.channels["probes/tip/displacement"][1][:, 1]


def sag(height: float) -> float:
    """ρ g A L⁴ / (8 E I), Euler-Bernoulli."""
    return -RHO * 9.81 * L**4 * 12 / (8 * E * height**2)


@pytest.mark.parametrize(("model", "elements"), [("beam", [10]), ("solid", [40, 1, 1]), ("plane", [40, 1])])
def test_a_link_500_times_as_long_as_high(model: str, elements: list[int]) -> None:
    """Stiffness along it is 3e6 times that across: bending must not drown in rounding, nor lock."""
    raw = arm(model, elements, height=L / 500)
    full, small = run(raw), run(reduced(raw))
    assert_allclose(tip(full), sag(L / 500), rtol=2e-3)
    assert_allclose(tip(small), tip(full), rtol=1e-3)  # as asked for
    few = prepared(scene_from(reduced(raw, modes=12)))  # too few for a solid: shear locks, and the estimate shows
    error = worst(relative_errors(histories(few[0]), full))
    assert few[1] is not None
    assert error < 1e-3 or 0.5 < worst(few[1].estimate) / error < 2


def test_a_nearly_incompressible_link() -> None:
    """ν = 0.499, hex20: the reduced link is as stiff as its full one, and both bend as a beam."""
    raw = arm("solid", [24, 2, 2], nu=0.499)
    full, small = run(raw), run(reduced(raw))
    assert_allclose(tip(full), sag(0.01), rtol=1e-2)  # what is left of locking
    assert_allclose(tip(small), tip(full), rtol=1e-3)


def test_badly_shaped_elements(tmp_path: Any) -> None:
    """Inner nodes of a cantilever moved to the edge of what the quality gate lets through: reduced is full."""
    raw = arm("solid", [10, 2, 2], height=0.05)
    raw["links"]["arm"]["element"] = "hex27"
    link = bare_link(scene_from(raw), "arm")
    X, rng = link.X.copy(), np.random.default_rng(3)
    corners = np.unique(link.cells[:, :8])
    inner = corners[np.all((X[corners] > [1e-9, -0.0249, -0.0249]) & (X[corners] < [L - 1e-9, 0.0249, 0.0249]), axis=1)]
    X[inner] += rng.uniform(-1, 1, (len(inner), 3)) * [0.017, 0.013, 0.013]
    cells = link.cells[:, :8]
    quality = mesh_quality(SolidMesh(X, cells)).least
    assert 0.1 < quality < 0.35
    used, numbers = np.unique(cells, return_inverse=True)
    meshio.write(tmp_path / "arm.vtu", meshio.Mesh(X[used], [("hexahedron", numbers.reshape(cells.shape))]))
    raw["links"]["arm"] = {"material": "steel", "shape": {"kind": "mesh", "file": "arm.vtu"}}
    full, small = (histories(prepared(scene_from(each, tmp_path))[0]) for each in (raw, reduced(raw)))
    assert worst(relative_errors(small, full)) < 1e-3


def test_far_more_functions_than_a_link_needs() -> None:
    """Those beyond what its loads excite are rounding; the answer is still that of the full link."""
    raw = arm("solid", [12, 1, 1])
    full = run(raw)
    for functions in (40, 80, 400):
        assert_allclose(tip(run(reduced(raw, modes=functions))), tip(full), rtol=1e-6)


def test_a_load_put_on_at_once_swings_to_twice_its_static_deflection() -> None:
    """Undamped, one mode: a mass of 20 kg at the tip of an arm of 0.4 kg; F L³/(3 E I) and the arm's own share."""
    for model, elements in (("beam", [6]), ("solid", [12, 1, 1])):
        raw = arm(model, elements)
        raw["gravity"] = [0, 0, 0]
        raw["bodies"] = {"tip": {"kind": "point_mass", "link": "arm", "at": [L, 0], "mass": 20.0}}
        raw["loads"] = {"F": {"kind": "force", "link": "arm", "at": [L, 0], "vector": [0, -1, 0], "frame": "world"}}
        raw["analysis"] = {"initial": "rest", "end_time": 0.4, "step": 5e-4, "rho_inf": 1.0}
        static = -(L**3) * 12 / (3 * E * 0.01**4)
        full, small = run(raw), run(reduced(raw))
        assert_allclose(tip(full).min(), 2 * static, rtol=1e-2)
        assert_allclose(tip(small), tip(full), rtol=0, atol=2e-3 * abs(static))


def resonant(reduced_link: bool) -> tuple[Histories, float]:
    """A mass at the tip of an arm that turns at 1/√2 of its first circular frequency ω, ζ = 0.05; and ω."""
    raw = arm("beam", [6])
    raw["bodies"] = {"tip": {"kind": "point_mass", "link": "arm", "at": [L, 0], "mass": 20.0}}
    if reduced_link:
        raw = reduced(raw)
    found = resolution(meshed(scene_from(raw)))
    assert found is not None
    first = float(found.first[0])
    raw["drive"]["motion"]["speed"] = 2 * np.pi * first / np.sqrt(2)
    raw["damping"] = {"ratio": 0.05, "frequencies": [first, 10 * first]}
    raw["analysis"] = {"revolutions": 40, "steps_per_revolution": 360, "initial": "rest"}
    raw["output"]["probes"]["tip"]["frame"] = "link"
    return run(raw), 2 * np.pi * first


def test_resonance_has_the_amplitude_of_theory() -> None:
    """Seen from the arm that turns at Ω: m u'' + 2 ζ ω m u' + m (ω² − Ω²) u = m g cos Ω t, resonant where ω² = 2 Ω².

    Then u = g / (2 ζ ω Ω), ten times the static deflection and more; Coriolis' force acts along the stiff direction.
    """
    (full, omega), (small, _) = resonant(False), resonant(True)
    u = tip(full)[full.time > full.time[-1] * 0.95]
    assert_allclose((u.max() - u.min()) / 2, 9.81 / (2 * 0.05 * omega * omega / np.sqrt(2)), rtol=0.03)
    assert worst(relative_errors(small, full)) < 2e-3


def growth(rho_inf: float, steps: int, per_turn: int, said: str = "") -> tuple[float, float]:
    """Largest displacement out of the plane among early and late steps [m], and what a warning says of it."""
    raw = four_bar("bar", revolutions=steps / per_turn, steps_per_revolution=per_turn, rho_inf=rho_inf)
    for link in raw["links"].values():
        link["mesh"] = {"elements": [3, 1, 1]}
    raw["damping"] = {"beta": 1e-4}
    scene = scene_from(raw)
    warned = stability_warning(scene)
    assert bool(warned) == bool(said)
    assert all(said in text for text in warned)
    ready = meshed(scene)
    solver, out = steps_of(scene, ready.model), []
    with suppress(SolveError):  # beyond any size: what came before shows the growth
        for block in transient(scene, ready.linkage, ready.path, ready.model, solver):
            out.extend(np.max([np.abs(link.u[..., 2]).max(axis=1) for link in block.links], axis=0))
    return max(out[1 : min(1280, len(out) // 4)]), max(out[-1024:])


@pytest.mark.parametrize(("rho_inf", "per_turn"), [(0.95, 180), (0.9, 90)])
def test_twenty_thousand_damped_steps_stay_bounded(rho_inf: float, per_turn: int) -> None:
    first, last = growth(rho_inf, 20_000, per_turn)
    assert 0 < last < 1.1 * first


@pytest.mark.parametrize(
    ("rho_inf", "per_turn", "said"),
    [
        (1.0, 120, "analysis.rho_inf = 1"),
        (0.95, 120, "take 5236 steps instead of"),
        (0.9, 60, "too long for rho_inf = 0.9"),
    ],
)
def test_vibration_grows_in_damped_links_that_turn_too_far_in_a_step(rho_inf: float, per_turn: int, said: str) -> None:
    """By 1 − ρ∞ and more: a limit of the scheme that a warning shows, not of the mechanism."""
    first, last = growth(rho_inf, 4000, per_turn, said)
    assert last > 100 * first


def test_a_step_that_is_far_too_long_is_reported() -> None:
    raw = arm("beam", [6])
    raw["analysis"] = {"initial": "rest", "end_time": 1.0, "step": 0.02}
    ready = meshed(scene_from(raw))
    said = resolution_warnings(resolution(ready))
    assert len(said) == 1
    assert "steps in a period: vibration is not resolved" in said[0]
