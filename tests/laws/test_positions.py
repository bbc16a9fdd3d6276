"""Positions without vibration, static and quasi-static: closed forms, all directions, kinds of links and frames."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_bvp

from kedfem.accuracy.plan import ready_to_step
from kedfem.analysis import analyse
from kedfem.dynamics.stepping.levels import level_steps
from kedfem.dynamics.stepping.start import motion_of
from kedfem.dynamics.system.starts import deflected
from kedfem.errors import SceneError, SolveError
from kedfem.kinematics import kinematics
from kedfem.results import read_results
from kedfem.scene import scene_from, time_grid
from kedfem.scene.questions.modelling import unsupported
from tests.cells import Cell, scene_of
from tests.laws.test_limits import AXES
from tests.moving import bar, beam_in_space, channels, inverted, ran, turning
from tests.spatial_joints import rigid_in_space

Raw = dict[str, Any]
G, E, D, RHO = 9.81, 2e11, 0.02, 7850.0
INERTIA, AREA = np.pi * D**4 / 64, np.pi * D**2 / 4
L = 0.4
MATERIALS = {"steel": {"youngs_modulus": E, "poisson_ratio": 0.3, "density": RHO}}


def across(n: np.ndarray) -> np.ndarray:
    """A direction across another."""
    d = np.cross(n, [0.3, 0.5, 0.9])
    return np.asarray(d / np.linalg.norm(d))


def rod(n: np.ndarray, along: int = 8) -> Raw:
    """A round rod of length L across a direction, from the origin."""
    return beam_in_space((0, 0, 0), L * across(n), along, n)


def values(raw: Raw) -> dict[str, np.ndarray]:
    return channels(*ran({"materials": MATERIALS, **raw}))


@pytest.mark.parametrize("axis", AXES)
def test_a_loaded_cantilever_bends_as_in_closed_form(axis: str) -> None:
    """F L³/3EI + F L/κGA at its end, which its wall bears; no time is asked for."""
    n, force = AXES[axis], 10.0
    joint = {"kind": "weld", "links": ["rod", "ground"], "at": [0, 0, 0]}
    end = {"link": "rod", "at": (L * across(n)).tolist()}
    got = values({
        "links": {"rod": rod(n)}, "joints": {"W": joint}, "analysis": {"kind": "static"},
        "loads": {"F": {"kind": "force", **end, "vector": (force * n).tolist()}},
        "output": {"probes": {"end": {**end, "quantity": "travel"}}},
    })  # fmt: skip
    shear = E / 2.6 * AREA * 6 * 1.3 / (7 + 6 * 0.3)  # Cowper's κ of a round section
    bent = force * L**3 / (3 * E * INERTIA) + force * L / shear
    assert len(got["probes/end/travel"]) == 2
    shortened = 0.6 * bent**2 / L  # of a slender one
    assert_allclose(got["probes/end/travel"] @ n, bent, rtol=2e-5)
    assert_allclose(got["probes/end/travel"] @ across(n), -shortened, rtol=2e-2)
    assert_allclose(got["joints/W/force"], [-force * n] * 2, atol=1e-8 * force)


def elastica(load: float) -> tuple[float, float]:
    """Shortening and deflection of the end of a cantilever, by its length, under P L²/EI across it: EI θ'' = −P cos θ."""

    def slopes(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.stack([y[1], -load * np.cos(y[0]), np.cos(y[0]), np.sin(y[0])])

    def ends(a: np.ndarray, b: np.ndarray) -> np.ndarray:
        return np.array([a[0], b[1], a[2], a[3]])

    x = np.linspace(0, 1, 41)
    y = solve_bvp(slopes, ends, x, np.stack([0 * x, 0 * x, x, 0 * x]), tol=1e-10).y
    return float(y[2, -1] - 1), float(y[3, -1])


def test_a_cantilever_bends_as_the_elastica() -> None:
    """Loads that grow from position to position, each found from the one before."""
    thin = {"kind": "bar", "between": [[0, 0], [1, 0]], "width": 0.002, "thickness": 0.02}
    most, EI = 0.2, E * 0.02 * 0.002**3 / 12
    got = values({
        "links": {"rod": {"model": "beam", "material": "steel", "shape": thin, "mesh": {"elements": 8}}},
        "joints": {"W": {"kind": "weld", "links": ["rod", "ground"], "at": [0, 0]}},
        "loads": {"P": {"kind": "force", "link": "rod", "at": [1, 0], "vector": [0, most * EI], "frame": "world",
                        "factor": {"over": "time", "at": [0, 1], "value": [0, 1]}}},
        "output": {"probes": {"end": {"link": "rod", "at": [1, 0], "quantity": "travel"}}},
        "analysis": {"kind": "static", "end_time": 1.0, "step": 0.25},
    })["probes/end/travel"]  # fmt: skip
    for k in range(1, 5):
        assert_allclose(got[k, :2], elastica(k / 4 * most), atol=1e-5)


@pytest.mark.parametrize("axis", AXES)
@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
def test_a_turned_rod_sags_by_its_weight_in_each_position(axis: str, frames: str) -> None:
    """w L⁴/8EI cos φ, a torque of m g L/2 cos φ: whatever the speed."""
    n, d = AXES[axis], across(AXES[axis])
    up = np.cross(n, d)
    got = values({
        "gravity": (-G * up).tolist(), "links": {"rod": rod(n)},
        "joints": {"A": {"kind": "revolute", "links": ["rod", "ground"], "at": [0, 0, 0], "axis": n.tolist()}},
        "drive": turning("3000 rpm"), "analysis": {"kind": "static", "steps_per_revolution": 8, "frames": frames},
        "output": {"probes": {"end": {"link": "rod", "at": (L * d).tolist(), "quantity": "displacement",
                                      "frame": "world"}}},
    })  # fmt: skip
    phi = 2 * np.pi * np.arange(9) / 8
    w = RHO * AREA * G
    sag = w * L**4 / (8 * E * INERTIA)
    assert_allclose(got["drive/torque"][:, 0], 0.5 * w * L**2 * np.cos(phi), atol=1e-4 * w * L**2)
    tangent = -np.outer(np.sin(phi), d) + np.outer(np.cos(phi), up)
    across_it = (got["probes/end/displacement"] * tangent).sum(axis=1)
    assert_allclose(across_it, -sag * np.cos(phi), atol=5e-3 * sag)  # shear: 0.4 %


@pytest.mark.parametrize("axis", AXES)
def test_a_rod_on_a_spring_turns_until_moments_balance(axis: str) -> None:
    """k θ = F L cos θ, without a drive; the rod bends besides, by F cos θ L³/3EI."""
    n, d = AXES[axis], across(AXES[axis])
    k, F, theta = 20.0, 3.0, 0.0
    for _ in range(60):
        bends = F * np.cos(theta) * L**2 / (3 * E * INERTIA)
        theta = F * L * (np.cos(theta) - bends * np.sin(theta)) / k
    end = values({
        "links": {"rod": rod(n, 2)},
        "joints": {"A": {"kind": "revolute", "links": ["rod", "ground"], "at": [0, 0, 0], "axis": n.tolist()}},
        "springs": {"k": {"kind": "torsion", "joint": "A", "stiffness": k}},
        "loads": {"F": {"kind": "force", "link": "rod", "at": (L * d).tolist(), "frame": "world",
                        "vector": (F * np.cross(n, d)).tolist()}},
        "analysis": {"kind": "static"},
        "output": {"probes": {"end": {"link": "rod", "at": (L * d).tolist(), "quantity": "position"}}},
    })["probes/end/position"][-1]  # fmt: skip
    bends = F * np.cos(theta) * L**2 / (3 * E * INERTIA)
    assert np.arctan2(end @ np.cross(n, d), end @ d) == pytest.approx(theta + bends, abs=2e-6)
    assert bends > 10 * 2e-6


@pytest.mark.parametrize("axis", AXES)
def test_a_rigid_rod_on_a_spring_does_not_deflect(axis: str) -> None:
    """k θ = F L cos θ, and its end goes by L sin θ; a structure has no step that could make it softer."""
    n, d = AXES[axis], across(AXES[axis])
    k, F, theta = 500.0, 3.0, 0.0
    for _ in range(60):
        theta = F * L * np.cos(theta) / k
    got = values({
        "links": {"rod": rigid_in_space(np.zeros(3), L * d)},
        "joints": {"A": {"kind": "revolute", "links": ["rod", "ground"], "at": [0, 0, 0], "axis": n.tolist()}},
        "springs": {"k": {"kind": "torsion", "joint": "A", "stiffness": k}},
        "loads": {"F": {"kind": "force", "link": "rod", "at": (L * d).tolist(), "vector": (F * np.cross(n, d)).tolist()}},
        "analysis": {"kind": "static"},
        "output": {"probes": {"end": {"link": "rod", "at": (L * d).tolist(), "quantity": "travel"}}},
    })  # fmt: skip
    assert_allclose(got["springs/k/angle"][-1], theta, rtol=1e-10)  # rounding: 1e-12
    assert got["probes/end/travel"][-1] @ np.cross(n, d) == pytest.approx(L * np.sin(theta), rel=2e-6)


@pytest.mark.parametrize("kind", ["static", "quasi-static"])
def test_rigid_links_are_as_rigid_in_positions_far_apart(kind: str) -> None:
    """Of a beam with a rigid rod at its end: both frames agree where loads are small, minutes between positions too."""

    def end(frames: str, speed: float) -> np.ndarray:
        links = {"arm": bar("beam", [0, 0], [0.2, 0], 1), "rod": bar("rigid", [0.2, 0], [0.4, 0])}
        at = {"link": "rod", "at": [0.4, 0]}
        return values({
            "links": links, "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]},
                                       "W": {"kind": "weld", "links": ["arm", "rod"], "at": [0.2, 0]}},
            "loads": {"F": {"kind": "force", **at, "vector": [0, 50]}},
            "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": speed}},
            "analysis": {"kind": kind, "revolutions": 2 / 72, "frames": frames},
            "output": {"probes": {"end": {**at, "quantity": "displacement", "frame": "world"}}},
        })["probes/end/displacement"]  # fmt: skip

    wanted = end("rigid-body", 1e-3)
    for speed in (1e-3, 0.1):
        assert_allclose(end("co-rotational", speed), wanted, atol=1e-3 * np.abs(wanted).max())


KINDS = [
    (model, kind, frames)
    for model in ("beam", "plane", "solid")
    for kind in ("prismatic", "slot")
    for frames in ("rigid-body", "co-rotational")
    if kind == "prismatic" or model == "beam"
]


@pytest.mark.parametrize(("model", "kind", "frames"), KINDS)
def test_a_quasi_static_motion_so_slow_that_it_has_no_inertia_is_static(model: str, kind: str, frames: str) -> None:
    """And static positions do not depend on the drive's speed."""
    raw = inverted(model, kind, initial=None, revolutions=1, steps_per_revolution=4, frames=frames)
    raw |= {"gravity": [0, -G]}
    probe = {"link": "arm", "at": [0.5, 0], "quantity": "displacement"}
    raw["output"] = {"probes": {"end": probe}}
    found = []
    for name, speed, turns in (("static", 600, 1), ("static", 1, 0.25), ("quasi-static", 0.01, 0.25)):
        raw["analysis"] |= {"kind": name, "revolutions": turns}
        raw["drive"] = turning(f"{speed} rpm")
        found.append(values(raw))
    within = 1e-6 if kind == "prismatic" else 1e-5  # places along a slot go with its travel; (ω/ω₁)² is 1e-12
    for name in ("probes/end/displacement", "drive/torque", "joints/S/force", "joints/B/force"):
        size = np.abs(found[0][name]).max()
        assert size > 1e-9
        near = within * size
        assert_allclose(found[1][name], found[0][name][:2], atol=near)
        assert_allclose(found[2][name], found[0][name][:2], atol=near)
        assert_allclose(found[2][name], found[1][name], atol=1e-6 * size)
        assert_allclose(found[0][name][0], found[0][name][-1], atol=1e-6 * size)  # a whole revolution


@pytest.mark.parametrize("joint", ["universal", "screw"])
def test_rigid_links_beside_elastic_ones_balance_too(joint: str) -> None:
    """A drive that hardly moves: static and quasi-static are one; also what is soft beside rigid links."""
    raw = scene_of(Cell(joint, "rigid-body", True, "rigid", "loads"))
    del raw["analysis"]["initial"]
    raw["analysis"] |= {"end_time": 5e-4, "step": 5e-4}
    raw["drive"]["motion"]["speed"] = 1e-6
    found = []
    for kind in ("static", "quasi-static"):
        raw["analysis"]["kind"] = kind
        ready, blocks = ran(raw)
        found.append((blocks[0].links, channels(ready, blocks)))
    (u, forces), (v, others) = found
    size = max(np.abs(link.u).max() for link in u)
    for one, other in zip(u, v, strict=True):
        assert_allclose(one.u, other.u, atol=1e-6 * size)  # 2e-8 found
    names = [name for name in forces if name.endswith("/force")]
    largest = max(np.abs(forces[name]).max() for name in names)
    near = 5e-4 * largest  # rounding of stiff links: 2e-5 found
    for name in names:
        assert_allclose(forces[name][0], others[name][0], atol=near)


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
def test_a_quasi_static_motion_begins_as_a_march_with_that_start_does(frames: str) -> None:
    """Two routes to one state: deflections and forces with the inertia of the rigid-body motion."""
    raw = inverted("beam", initial="quasi-static", revolutions=4e-4, steps_per_revolution=7200, frames=frames)
    raw["output"] = {"probes": {"end": {"link": "arm", "at": [0.5, 0], "quantity": "displacement"}}}
    raw |= {"gravity": [0, -G], "drive": turning("600 rpm")}
    marched = values(raw)
    raw["analysis"] |= {"kind": "quasi-static"}
    del raw["analysis"]["initial"]
    found = values(raw)
    for name in ("probes/end/displacement", "drive/torque", "joints/S/force"):
        size = np.abs(marched[name]).max()
        assert_allclose(found[name][0], marched[name][0], atol=1e-7 * size)
        assert_allclose(found[name], marched[name], atol=2e-2 * size)  # it hardly vibrates


def test_positions_of_what_rests_are_no_dearer_than_others(monkeypatch: pytest.MonkeyPatch) -> None:
    """Rates that are rounding, and that no damper feels, are not looked for again: five balances a position."""
    balances = []
    found = deflected.equilibrium
    monkeypatch.setattr(deflected, "equilibrium", lambda *args: balances.append(None) or found(*args))
    raw = inverted("beam", initial=None, revolutions=None, steps_per_revolution=None)
    raw["analysis"] = {"kind": "quasi-static", "end_time": 2e-3, "step": 1e-3}
    values(raw | {"gravity": [0, -G], "drive": turning("1e-9 rpm")})
    assert len(balances) == 3 * 5


def test_a_whole_run_has_positions_without_steps(tmp_path: Path) -> None:
    """A plan, its mesh's error, stresses: neither an error of steps nor an account of energy, which sums over them."""
    raw = inverted("beam", initial=None, revolutions=None, steps_per_revolution=None)
    raw["analysis"] = {"kind": "static"}
    raw["links"]["arm"]["mesh"] = {"elements": 8}
    raw |= {"gravity": [0, -G], "output": {"plots": False, "picture": False}}
    scene = scene_from(raw, tmp_path)
    run = analyse(scene)
    assert time_grid(scene).steps == 72
    assert len(run.results.time) == 73
    assert run.results.status == "complete"
    assert run.balance is None
    assert not [x for x in run.warnings if "step" in x]
    assert run.budget is not None
    assert {share.source for share in run.budget.shares} >= {"mesh"}
    assert "step" not in {share.source for share in run.budget.shares}
    assert max(run.budget.together.values()) < 0.01
    energies = [name for name in run.results.channels if name.startswith("energy/")]
    assert energies == ["energy/strain"]
    assert run.peak is not None
    assert run.peak.stress > 1e5
    moved = read_results(kinematics(scene).folder / "results.h5")
    assert np.abs(moved.channels["links/arm/angular_velocity"][1]).max() > 1.0


@pytest.mark.parametrize("axis", AXES)
def test_what_nothing_loads_is_told(axis: str, tmp_path: Path) -> None:
    """What rounding leaves there is reported neither as a stress nor as an error."""
    joint = {"kind": "weld", "links": ["rod", "ground"], "at": [0, 0, 0]}
    raw = {
        "links": {"rod": rod(AXES[axis])}, "joints": {"W": joint}, "analysis": {"kind": "static"},
        "output": {"plots": False, "picture": False, "animation": False},
    }  # fmt: skip
    run = analyse(scene_from(raw, tmp_path))
    assert [text.split(":")[0] for text in run.warnings] == ["no link is stressed at all"]
    assert run.results.status == "complete"
    loaded = analyse(scene_from({**raw, "gravity": [0, 0, -G]}, tmp_path))
    assert not any("stressed at all" in text for text in loaded.warnings)


def floating(springs: dict[str, Any]) -> dict[str, Any]:
    """Two rods on a hinge with each other, none of them on the ground; two forces on them balance each other."""

    def rod(a: float, b: float) -> dict[str, Any]:
        shape = {"kind": "bar", "between": [[a, 0], [b, 0]], "width": 0.02, "thickness": 0.02}
        return {"model": "beam", "material": "steel", "mesh": {"elements": 1}, "shape": shape}

    pulls = {"one": (0, -10.0), "two": (1, 10.0)}
    loads = {n: {"kind": "force", "link": n, "at": [x, 0], "vector": [f, 0]} for n, (x, f) in pulls.items()}
    hinge = {"kind": "revolute", "links": ["one", "two"], "at": [0.5, 0]}
    return {
        "links": {"one": rod(0, 0.5), "two": rod(0.5, 1)}, "joints": {"B": hinge}, "loads": loads, "springs": springs,
        "analysis": {"kind": "static"},
    }  # fmt: skip


def test_links_that_nothing_connects_with_the_ground_are_refused_before_a_balance_is_sought(tmp_path: Path) -> None:
    with pytest.raises(SceneError) as refused:
        analyse(scene_from(floating({}), tmp_path))
    assert [fault.where for fault in refused.value.faults] == [("links", "one"), ("links", "two")]
    assert "must be connected with the ground in a static analysis" in str(refused.value)
    ends = [{"link": "ground", "at": [0, 1]}, {"link": "two", "at": [1, 0]}]
    assert unsupported(scene_from(floating({"s": {"kind": "spring", "between": ends, "stiffness": 10.0}}))) == ()


def test_where_the_least_load_has_no_balance_no_larger_one_is_sought(monkeypatch: pytest.MonkeyPatch) -> None:
    """One search for the whole load, one for the least part of it; there were six."""
    sought: list[float] = []
    whole = deflected.direct_balance

    def counted(now: Any, *given: Any) -> Any:
        sought.append(float(np.abs(now.F).max()))
        return whole(now, *given)

    monkeypatch.setattr(deflected, "direct_balance", counted)
    with pytest.raises(SolveError):
        values(HANGING)
    assert len(sought) == 1


HANGING: dict[str, Any] = {
    "gravity": [0, -G],
    "links": {"rod": {"model": "beam", "material": "steel", "mesh": {"elements": 2},
                      "shape": {"kind": "bar", "between": [[0, 0], [1, 0]], "width": 0.02, "thickness": 0.02}}},
    "joints": {"A": {"kind": "revolute", "links": ["rod", "ground"], "at": [0, 0]}},
    "analysis": {"kind": "static"},
}  # fmt: skip


def test_what_nothing_holds_is_told_in_words() -> None:
    with pytest.raises(SolveError, match="must balance at each position of a static analysis, got no balance at t = 0 s"):
        values(HANGING)


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
@pytest.mark.parametrize("kind", ["prismatic", "slot"])
def test_a_balance_does_not_depend_on_where_its_search_begins(kind: str, frames: str) -> None:
    """Deflections of some 0.1 mm from guesses that open the joints by as much."""
    raw = inverted("beam", kind, initial=None, revolutions=1, steps_per_revolution=4, frames=frames)
    raw |= {"gravity": [0, -G]}
    raw["analysis"] |= {"kind": "static", "extrapolation_levels": 1}
    scene = scene_from(raw)
    _, made, _ = ready_to_step(scene)
    of = level_steps(scene, made.model)[0].ready
    motion, time = motion_of(scene, made.linkage, made.path), 0.3 * time_grid(scene).end
    wanted = deflected.static(of, motion, time)
    rng = np.random.default_rng(5)
    size = np.abs(wanted.u).max()
    for _ in range(3):
        guess = wanted._replace(u=size * rng.standard_normal(wanted.u.shape))
        assert_allclose(deflected.static(of, motion, time, near=guess).u, wanted.u, atol=1e-7 * size)
