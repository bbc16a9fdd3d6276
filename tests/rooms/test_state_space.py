"""The mechanism as a linear system: against static deflections, a march, frequencies, and the inertia at the drive."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.signal import lsim
from scipy.spatial.transform import Rotation

from kedfem.accuracy.prepared import meshed, moving
from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.errors import OutputError, SceneError
from kedfem.export import StateSpace, read_state_space, state_space, write_state_space
from kedfem.frequencies import Wanted, frequencies
from kedfem.motion.rigid import rigid_motion
from kedfem.results.recording import recording
from kedfem.scene import Scene, path_parameter, scene_from
from tests.bars import AXES, CASES, FLAT, KINDS, START, L, bar_scene
from tests.cells import ON_JOINT, Cell, scene_of
from tests.linkages import drive_rates
from tests.moving import bar, turning
from tests.moving import turned as turned_scene

Raw = dict[str, Any]
MESHES = "frequencies: meshes must be fine enough for 1 %"


def values(scene: Scene) -> dict[str, np.ndarray]:
    """All channels of a scene over time."""
    made = meshed(scene)
    steps = steps_of(scene, made.model)
    blocks = list(transient(scene, made.linkage, made.path, made.model, steps))
    every = recording(scene, made.model, along=made.path)
    return {each.channel.name: np.concatenate([each.rows(block) for block in blocks]) for each in every}


def loaded(kind: str, axis: str) -> Raw:
    """Sections: a force at the end of a bar's first part, probes there and in its middle."""
    flat = kind in FLAT
    e = np.array(AXES[axis], float) / np.linalg.norm(AXES[axis])
    start = START * [1, 1, 0] if flat else START
    middle, end = ((start + x * L * e)[: 2 if flat else 3].tolist() for x in (0.5, 1.0))
    vector = [300.0, -200.0] if flat else [300.0, -200.0, 100.0]
    probe: Raw = {"link": "arm", "at": end, "quantity": "displacement"}
    probes: Raw = {
        "end": probe,
        "own": {**probe, "frame": "link"},
        "bent": {"link": "arm", "at": middle, "quantity": "deflection"},
        "stress": {"link": "arm", "at": middle, "quantity": "stress"},
    }
    return {"loads": {"f": {"kind": "force", "link": "tip", "at": end, "vector": vector}}, "output": {"probes": probes}}


def at_rest(space: StateSpace) -> np.ndarray:
    """Outputs of constant inputs (o, i)."""
    return space.D - space.C @ np.linalg.solve(space.A, space.B)


def rows(space: StateSpace, channel: str) -> list[int]:
    return [n for n, name in enumerate(space.outputs) if name.rpartition("/")[0] == channel]


@pytest.mark.parametrize(("kind", "axis"), CASES)
def test_a_constant_load_bends_as_in_quasi_static_positions(kind: str, axis: str, tmp_path: Path) -> None:
    """Whatever modes are kept: of two the others' answer is added; a deflection is linear to what the load bends.

    In space the tip is rigid: here exactly, in positions as a very stiff link.
    """
    within = 1e-7 if kind in FLAT else 3e-6
    more = loaded(kind, axis)
    analysis = {"kind": "quasi-static", "end_time": 0.1, "step": 0.05, "accuracy": "quick"}
    got = values(bar_scene(kind, axis, tmp_path, **more, analysis=analysis))
    none = values(bar_scene(kind, axis, tmp_path, output=more["output"], analysis=analysis))
    for modes in (2, 12):
        space, warnings = state_space(bar_scene(kind, axis, tmp_path, **more), modes)
        assert all(each.startswith(MESHES) for each in warnings)  # these are coarse
        assert space.inputs == ("loads/f",)
        assert len(space.A) == 2 * modes
        for name in ("probes/end/displacement", "probes/own/displacement", "probes/stress/stress"):
            found = at_rest(space)[rows(space, name), 0]
            wanted = (got[name] - none[name])[0, : len(found)]
            assert np.abs(wanted).max() > 1e-6
            assert_allclose(found, wanted, atol=within * np.abs(wanted).max())
        found = at_rest(space)[rows(space, "probes/bent/deflection"), 0]
        wanted = (got["probes/bent/deflection"] - none["probes/bent/deflection"])[0]
        assert_allclose(found, wanted, atol=0.01 * np.abs(wanted).max())


RAMP: Raw = {"over": "time", "at": [0.0, 0.004]}
STEP = 2e-5


def swinging(frame: str = "world") -> Raw:
    """Two planar beams, the first on a drive that all but rests: a spring with a damper, a motor, a force at the end."""
    probe: Raw = {"link": "two", "at": [0.5, 0.1], "frame": frame}
    kinds = ("displacement", "velocity", "acceleration")
    return {
        "links": {"one": bar("beam", (0, 0), (0.3, 0), 2), "two": bar("beam", (0.3, 0), (0.5, 0.1), 2)},
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "one"], "at": [0, 0]},
            "B": {"kind": "revolute", "links": ["one", "two"], "at": [0.3, 0]},
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 1e-9}},
        "springs": {"b": {"kind": "torsion", "joint": "B", "stiffness": 900.0, "damping": 1.0}},
        "motors": {"m": {"joint": "B", "torque": {**RAMP, "value": [0.0, 0.02]}}},
        "loads": {
            "f": {
                "kind": "force",
                "link": "two",
                "at": [0.5, 0.1],
                "vector": [0.1, 0.2],
                "factor": {**RAMP, "value": [0.0, 1.0]},
            }
        },
        "damping": {"alpha": 3.0, "beta": 2e-5},
        "output": {"probes": {kind: {**probe, "quantity": kind} for kind in kinds}},
        "analysis": {"end_time": 0.06, "step": STEP, "initial": "rest", "accuracy": "quick", "frames": "co-rotational"},
    }


def test_it_moves_as_a_march_of_the_equation() -> None:
    """Of all modes, small forces: displacements, rates and angle over six periods, with every kind of damping."""
    scene = scene_from(swinging())
    got = values(scene)
    space, _ = state_space(scene, modes=100)
    assert space.inputs == ("loads/f", "motors/m/torque")
    assert space.input_units == ("1", "N m")
    count = len(got["motors/m/angle"])
    t = STEP * np.arange(count)
    amounts = np.minimum(t / RAMP["at"][1], 1.0)[:, None] * [1.0, 0.02]
    y = lsim((space.A, space.B, space.C, space.D), amounts, t)[1]
    peak = {}
    for name, columns in (
        ("probes/displacement/displacement", 2),
        ("probes/velocity/velocity", 2),
        ("motors/m/angle", 1),
    ):
        numbers = rows(space, name) or [space.outputs.index(name)]
        wanted = got[name].reshape(count, -1)[:, :columns]
        peak[name] = np.abs(wanted).max()
        assert_allclose(y[:, numbers], wanted, atol=3e-4 * peak[name], err_msg=name)
    assert peak["probes/displacement/displacement"] > 1e-6
    assert np.diag(space.A[len(space.A) // 2 :, len(space.A) // 2 :]).max() < -3.0


@pytest.mark.parametrize("frame", ["world", "link"])
def test_rates_are_those_of_displacements(frame: str) -> None:
    """C of a rate is C A, of an acceleration C A², its D is C A B."""
    space, _ = state_space(scene_from(swinging(frame)), modes=5)
    u, v, a = (rows(space, f"probes/{x}/{x}") for x in ("displacement", "velocity", "acceleration"))
    A, B, C, D = space.A, space.B, space.C, space.D
    for found, wanted in (
        (C[v], C[u] @ A),
        (C[a], C[u] @ A @ A),
        (D[a], C[u] @ A @ B),
        (C[[space.outputs.index("motors/m/speed")]], C[[space.outputs.index("motors/m/angle")]] @ A),
    ):
        assert_allclose(found, wanted, atol=1e-9 * np.abs(wanted).max())
    assert not D[v].any()
    assert space.output_units[a[0]] == "m/s^2"


@pytest.mark.parametrize("turn", [[0.0, 0.0, 0.0], [0, 0, np.pi / 2], [0, -np.pi / 2, 0], [0.7, -0.4, 1.1]])
@pytest.mark.parametrize(("joint", "law"), [(joint, law) for law, joints in ON_JOINT.items() for joint in joints])
def test_a_drive_that_lets_go_moves_all_inertia_that_it_moves(joint: str, law: str, turn: list[float]) -> None:
    """A motion without strain is driven as Σ ∫ |dx/dφ|² dm of the rigid-body motion is."""
    raw = scene_of(Cell(joint, "rigid-body", True, "beams in space", law))
    del raw["loads"]
    scene = scene_from(turned_scene(raw, Rotation.from_rotvec(turn).as_matrix(), (0.3, -0.2, 0.5)))
    space, _ = state_space(scene, 4, free=True)
    slides = joint in {"prismatic", "slot"} or law == "drive of the travel"
    assert space.inputs == ("drive/force" if slides else "drive/torque",)
    assert space.outputs == (("drive/travel" if slides else "drive/angle"), "drive/speed")
    assert space.frequencies[0] == 0.0
    assert space.frequencies[1] > 1.0
    linkage, along = moving(scene)
    motion = rigid_motion(linkage, along, np.zeros(1), path_parameter(scene, np.zeros(1)))
    model = elastic_model(scene, linkage, along=along)
    (v,), (omega,) = drive_rates(linkage, along, np.zeros(1))
    inertia = 0.0
    for link, body in zip(model.links, model.bodies, strict=True):
        x = link.X @ motion.R[0, body].T
        moved = link.one[:, None] * v[body] + np.cross(omega[body], x)
        inertia += sum(float(moved[:, c] @ (m @ moved[:, c])) for c, m in enumerate(link.mass))
    m = len(space.frequencies)
    assert space.C[0, 0] * space.B[m, 0] == pytest.approx(1 / inertia, rel=1e-5)


def test_stiffening_changes_frequencies_as_told_by_frequencies(tmp_path: Path) -> None:
    raw = {
        "links": {"arm": bar("beam", (0, 0), (0.8, 0), 6)},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]}},
        "drive": turning("1500 rpm"),
        "output": {"probes": {"p": {"link": "arm", "at": [0.8, 0], "quantity": "displacement"}}},
        "loads": {"f": {"kind": "force", "link": "arm", "at": [0.8, 0], "vector": [0, 1.0]}},
        "analysis": {"revolutions": 1, "steps_per_revolution": 90, "accuracy": "quick", "stiffening": True},
    }
    scene = scene_from(raw)
    told = frequencies(scene, Wanted(modes=3, positions=1), tmp_path / "f")
    stiff, _ = state_space(scene, 3)
    soft, _ = state_space(scene_from({**raw, "analysis": {**raw["analysis"], "stiffening": False}}), 3)
    assert_allclose(stiff.frequencies, told.values[0], rtol=1e-9)
    assert stiff.frequencies[0] > 1.02 * soft.frequencies[0]
    ends = np.sort(np.abs(np.linalg.eigvals(stiff.A)))[::2] / (2 * np.pi)
    assert_allclose(ends, stiff.frequencies, rtol=1e-6)


@pytest.mark.parametrize("stiffening", [False, True])
def test_what_stiffens_a_released_drive_is_told(stiffening: bool) -> None:
    """A hanging arm under its weight has the frequency of a pendulum, √(1.5 g/L) of a thin one, with stiffening alone."""
    raw = {
        "gravity": [0, -9.81, 0], "links": {"arm": bar("beam", (0, 0), (0, -0.8), 6)},
        "joints": {"A": {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0]}},
        "drive": turning("1 rpm"),
        "analysis": {"revolutions": 1, "steps_per_revolution": 90, "accuracy": "quick", "stiffening": stiffening},
    }  # fmt: skip
    space, told = state_space(scene_from(raw), 3, free=True)
    assert space.frequencies[0] == pytest.approx(np.sqrt(1.5 * 9.81 / 0.8) / (2 * np.pi) if stiffening else 0.0, rel=1e-2)
    assert [x for x in told if "as a stiffness, lowest frequency 0.68" in x] == [told[-1]][: int(stiffening)]


def test_a_constant_load_is_answered_alike_whatever_modes_are_kept() -> None:
    """Twelve arms of nearly one length, so that what is left out is hardly stiffer than what is kept."""
    links: Raw = {"hub": bar("beam", (0, 0), (0.1, 0), 1)}
    joints: Raw = {"A": {"kind": "revolute", "links": ["ground", "hub"], "at": [0, 0]}}
    for k, length in enumerate(1.0 + 0.01 * np.arange(12)):
        end = length * np.array([np.cos(np.pi * k / 6), np.sin(np.pi * k / 6)]) + [0.1, 0]
        links[f"arm{k}"] = bar("beam", (0.1, 0), end.tolist(), 3)
        joints[f"W{k}"] = {"kind": "weld", "links": ["hub", f"arm{k}"], "at": [0.1, 0]}
    at = links["arm0"]["shape"]["between"][1]
    raw = {
        "links": links, "joints": joints, "drive": turning("60 rpm"),
        "loads": {"f": {"kind": "force", "link": "arm0", "at": at, "vector": [0, 1.0]}},
        "output": {"probes": {"p": {"link": "arm0", "at": at, "quantity": "displacement"}}},
        "analysis": {"revolutions": 1, "steps_per_revolution": 90, "accuracy": "quick"},
    }  # fmt: skip
    few, many = (at_rest(state_space(scene_from(raw), modes)[0])[1, 0] for modes in (1, 14))
    assert few == pytest.approx(many, rel=1e-10)
    bending = 1 / (3 * 2.1e11 * 0.02 * 0.03**3 / 12)  # of an arm that is held
    assert bending < many < 1.5 * bending


@pytest.mark.parametrize("ending", [".npz", ".mat"])
def test_files_are_read_back_alike(ending: str, tmp_path: Path) -> None:
    space, _ = state_space(scene_from(swinging()), 3)
    write_state_space(space, tmp_path / f"s{ending}")
    again = read_state_space(tmp_path / f"s{ending}")
    for name in StateSpace.__slots__:
        assert np.array_equal(getattr(space, name), getattr(again, name)), name
    with pytest.raises(OutputError, match="must be a state space that kedfem wrote, got No such file"):
        read_state_space(tmp_path / f"none{ending}")


def test_loads_on_what_the_drive_holds_are_named(tmp_path: Path) -> None:
    """A rigid crank that the drive carries takes a load to the drive: nothing moves."""
    raw = scene_of(Cell("revolute", "rigid-body", True, "planar beams"))
    raw["links"]["crank"] |= {"model": "rigid", "mesh": {"elements": [1, 1, 1]}}
    name = next(x for x in raw["links"] if x != "crank")
    at = raw["joints"]["J"]["at"]
    raw["output"] = {"probes": {"p": {"link": name, "at": at, "quantity": "displacement"}}}
    if raw["links"][name]["model"] == "rigid":
        pytest.fail("the other link bends")
    _, warnings = state_space(scene_from(raw, tmp_path), 2)
    assert tuple(each for each in warnings if not each.startswith(MESHES)) == (
        "state space: input loads/f has no effect: the drive or the ground fixes what it acts on",
    )


def test_what_cannot_be_asked(tmp_path: Path) -> None:
    raw, undriven = swinging(), {"drive": None, "damping": {}, "output": {}}
    for more, options, said in (
        ({}, {"modes": 0}, r"--modes: must be at least 1, got 0"),
        (undriven, {"at": 0.1}, r"--at: must be 0 without a drive, got 0.1 s"),
        (undriven, {"free": True}, r"--free: must be combined with a drive to release, got a scene without one"),
        ({"loads": {}, "motors": {}}, {}, r"--state-space: must have an input, got a scene without loads and motors"),
        ({"motors": {}, "output": {}}, {}, r"--state-space: must have an output, got a scene without probes"),
    ):
        with pytest.raises(SceneError, match=said):
            state_space(scene_from({**raw, **more}, tmp_path), **options)  # type: ignore[arg-type]
    scene = bar_scene("beam", "x", tmp_path, **loaded("beam", "x"))
    with pytest.raises(SceneError, match=r"--at: must be within the analysis, 0 to 0.1 s, got -1 s"):
        state_space(scene, at=-1)
    assert list(KINDS)
