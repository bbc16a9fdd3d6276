"""Co-rotational frames: the force of a frame, segments of a link, and what steps with them keep."""

from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.dynamics.frames import Deformed, deformation, frame_force, frames_of, rotation
from kedfem.links.beams.beam import beam_link
from kedfem.links.beams.beam_axis import straight_axis
from kedfem.links.beams.beam_segments import beam_segments, space_segments
from kedfem.links.beams.section import rectangle
from kedfem.links.beams.spatial_beam import spatial_beam_link
from kedfem.links.record import Link
from kedfem.links.segments import Segments, segmented
from kedfem.scene import Material
from tests.laws.strategies import examples
from tests.runs import Ran, ran
from tests.scenes import arm, constant_speed
from tests.verification.mechanisms import four_bar
from tests.verification.meshes import mapped_link, mapped_plane

SOFT = Material(density=1000, youngs_modulus=1e9, poisson_ratio=0.3)
LINE = np.array([[0.0, 0, 0], [1.0, 0, 0]])
ENDS = np.array([[0.0, 0, 0], [1.0, 0, 0]])
SECTION = rectangle(0.05, 0.04)
seeds = st.integers(0, 2**32 - 1)


def segments(kind: str, count: int = 2) -> tuple[Link, Segments]:
    """A cantilever of 1 m × 0.05 m × 0.04 m along x, whole and cut."""
    if kind == "beam":
        link = beam_link("arm", LINE, SECTION, SOFT, count)
        return link, beam_segments(link, SOFT)
    if kind == "spatial_beam":
        axis = straight_axis(LINE, count, 3, None)
        link = spatial_beam_link("arm", axis, SECTION, SOFT)
        return link, space_segments(link, axis, SOFT)
    if kind == "plane":
        link = mapped_plane((12, 2), lambda r, s: (r, 0.05 * (s - 0.5)), 0.04, SOFT)
    else:
        nodes = 10 if kind == "tetrahedra" else 20
        link = mapped_link((12, 1, 1), lambda r, s, t: (r, 0.05 * (s - 0.5), 0.04 * (t - 0.5)), SOFT, nodes)
    return link, segmented(link, SOFT, count, ENDS, ())


PARTS = {kind: segments(kind)[1].parts[0] for kind in ("beam", "plane", "solid", "tetrahedra", "spatial_beam")}
KINDS = list(PARTS)


def places(link: Link) -> np.ndarray:
    X = link.X[:, : link.d]
    return X * [1, 1, 0] if link.kind == "beam" else X


def bent(link: Link, rng: np.random.Generator) -> np.ndarray:
    """A position with strains of some tenths."""
    across = 0.05 if link.kind in {"solid", "plane"} else link.size
    return places(link) + 0.15 * across * rng.uniform(-1, 1, (link.n, link.d))


def turn(link: Link, rng: np.random.Generator) -> tuple[np.ndarray, float]:
    """A rotation (d, d) of a link's rows, and its angle if the link is planar."""
    angle = float(rng.uniform(-3, 3))
    axis = np.array([0.0, 0, 1]) if link.planar else rng.standard_normal(3)
    R = Rotation.from_rotvec(angle * axis / np.linalg.norm(axis)).as_matrix()
    return R[: link.d, : link.d], angle


def moved(link: Link, y: np.ndarray, R: np.ndarray, angle: float, shift: np.ndarray) -> np.ndarray:
    """A position turned and shifted as a whole."""
    out = y @ R.T
    out[:, : 2 if link.planar else 3] += np.outer(link.one, shift[: 2 if link.planar else 3])
    if link.kind == "beam":
        out[:, 2] += angle * link.one
    return np.asarray(out)


def force(link: Link, y: np.ndarray, R: np.ndarray | None = None, angle: float = 0.0) -> tuple[np.ndarray, float]:
    """Internal force of all frames, which are near R, and the strain energy."""
    total, energy, zero = np.zeros_like(y), 0.0, np.zeros_like(y)
    for frame in frames_of(link):
        Q, a = rotation(link, frame.fit, y, angle)
        f, e = frame_force(link, frame, Deformed(Q, a, deformation(link, y, Q, a), zero), y, 0.0)
        total, energy = total + f, energy + e
    return total, energy


# -- the force of a frame -----------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=examples(10))
@given(seed=seeds)
def test_force_is_the_gradient_of_the_strain_energy(kind: str, seed: int) -> None:
    """By central differences along random directions, whose error is of order 1e-10."""
    rng, link = np.random.default_rng(seed), PARTS[kind]
    y = bent(link, rng)
    f = force(link, y)[0]
    for _ in range(3):
        direction = rng.standard_normal(y.shape)
        e = 1e-5 * link.size
        slope = (force(link, y + e * direction)[1] - force(link, y - e * direction)[1]) / (2 * e)
        size = np.linalg.norm(f) * np.linalg.norm(direction)
        assert_allclose(np.vdot(f, direction), slope, rtol=0, atol=1e-6 * size)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=examples(10))
@given(seed=seeds)
def test_a_turn_of_the_whole_turns_the_force_and_keeps_the_energy(kind: str, seed: int) -> None:
    rng, link = np.random.default_rng(seed), PARTS[kind]
    y, (R, angle) = bent(link, rng), turn(link, rng)
    f, energy = force(link, y)
    got, again = force(link, moved(link, y, R, angle, rng.standard_normal(3)), R, angle)
    assert again == pytest.approx(energy, rel=1e-9)
    assert_allclose(got, f @ R.T, rtol=0, atol=1e-9 * np.abs(f).max())


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=examples(10))
@given(seed=seeds)
def test_force_has_neither_resultant_nor_moment_about_the_deformed_shape(kind: str, seed: int) -> None:
    rng, link = np.random.default_rng(seed), PARTS[kind]
    y = bent(link, rng)
    f = force(link, y)[0]
    k = 2 if link.planar else 3
    largest = np.abs(f[:, :k]).max() * np.abs(y).max()
    assert_allclose(link.one @ f[:, :k], 0, atol=1e-10 * np.abs(f[:, :k]).max())
    moment = np.zeros(3)
    moment[2 if link.planar else slice(None)] = _moment(y, f, k)
    if link.kind == "beam":
        moment[2] += link.one @ f[:, 2]
    assert_allclose(moment, 0, atol=1e-10 * largest)


def _moment(y: np.ndarray, f: np.ndarray, k: int) -> Any:
    cross = y[:, 0] * f[:, 1] - y[:, 1] * f[:, 0]
    return np.cross(y, f).sum(axis=0) if k == 3 else cross.sum()


# -- segments of a link -------------------------------------------------------------------------------------


def tip_deflection(whole: Segments | Link, load: np.ndarray) -> np.ndarray:
    """Mean displacement of the end face of a cantilever under a load there, segments joined at their cuts."""
    parts, cuts = ((whole,), ()) if isinstance(whole, Link) else (whole.parts, whole.cuts)
    first = np.concatenate([[0], np.cumsum([part.unknowns for part in parts])])
    K = sp.block_diag([part.K0 for part in parts]).tocsr()
    rows = []
    for cut in cuts:
        a, b = cut.segments
        blocks = [None] * len(parts)
        for number, weights, sign in ((a, cut.weights[0], 1.0), (b, cut.weights[1], -1.0)):
            blocks[number] = sp.kron(sp.csr_array(sign * weights), sp.eye_array(parts[number].d))
        height = len(cut.points) * parts[a].d
        rows.append(
            [sp.csr_array((height, part.unknowns)) if x is None else x for x, part in zip(blocks, parts, strict=True)]
        )
    C = sp.block_array(rows).tocsr() if rows else sp.csr_array((0, first[-1]))
    ends = [end_weights(parts[0], 0.0), end_weights(parts[-1], 1.0)]
    held = np.concatenate([first[0] + d for d in [np.flatnonzero(_held(parts[0]))]])
    free = np.setdiff1d(np.arange(first[-1]), held)
    F = np.zeros(first[-1])
    tip = np.outer(ends[1], load[: parts[-1].d])
    F[first[-2] :] = tip.ravel()
    K, C = K[free][:, free], C[:, free]
    A = sp.block_array([[K, C.T], [C, None]]).tocsc() if C.shape[0] else K.tocsc()
    x = np.zeros(first[-1])
    x[free] = sp.linalg.spsolve(A, np.concatenate([F[free], np.zeros(C.shape[0])]))[: len(free)]
    return np.asarray(ends[1] @ x[first[-2] :].reshape(-1, parts[-1].d))


def end_weights(link: Link, x: float) -> np.ndarray:
    here = np.flatnonzero((np.abs(link.X[:, 0] - x) < 1e-9) & (link.one != 0))
    w = np.zeros(link.n)
    w[here] = 1 / len(here)
    return w


def _held(link: Link) -> np.ndarray:
    if link.kind == "spatial_beam":
        out = np.zeros((link.n, 3), bool)
        out[:3] = True  # u, p, q of the first node
        return out.ravel()
    here = np.abs(link.X[:, 0]) < 1e-9
    return np.repeat(here, link.d)


@pytest.mark.parametrize("kind", ["beam", "spatial_beam"])
def test_segments_of_a_beam_in_rigid_body_frames_are_the_whole_beam(kind: str) -> None:
    link, cut = segments(kind, 5)
    for load in (np.array([1.0, 0, 0]), np.array([0.0, 1, 0])):
        assert_allclose(tip_deflection(cut, load), tip_deflection(link, load), rtol=1e-8, atol=1e-12)
    assert_allclose(sum(part.m1.sum() for part in cut.parts), link.m1.sum(), rtol=1e-12)


@pytest.mark.parametrize(
    ("kind", "wanted"),
    [
        ("plane", {2: 3e-6, 6: 1.3e-5, 12: 1.5e-4}),
        ("solid", {2: 2e-6, 6: 8e-5, 12: 1.4e-3}),
        ("tetrahedra", {2: 6e-5, 6: 3e-4, 12: 6e-4}),
    ],
)
def test_cuts_of_meshed_links_make_them_hardly_softer(kind: str, wanted: dict[int, float]) -> None:
    """Affine-fitted cuts let both sides warp apart: softer, as docs/theory/corotational.md says; 12 layers."""
    link = segments(kind, 1)[0]
    across = np.array([0.0, 1, 0])
    whole = tip_deflection(link, across)[1]
    for count, cap in wanted.items():
        softer = tip_deflection(segments(kind, count)[1], across)[1] / whole - 1
        assert 0 < softer < cap, count


# -- steps --------------------------------------------------------------------------------------------------

ALLOY = {"density": 2800, "youngs_modulus": 7e10, "shear_modulus": 2.7e10}


def elbow(model: str, load: float, corotational: bool = True, **analysis: Any) -> dict[str, Any]:
    """A bent arm on a drive that all but stands still, a force on its tip put on within a few ms."""
    shape = {"kind": "polyline", "points": [[0, 0], [0.3, 0], [0.3, 0.2]], "width": 0.01, "thickness": 0.01}
    link = {"material": "m", "shape": shape, "model": "beam", "beam": model, "mesh": {"elements": 2}}
    if model in {"plane", "solid"}:
        out = [[0, -0.005], [0.305, -0.005], [0.305, 0.2], [0.295, 0.2], [0.295, 0.005], [0, 0.005]]
        del link["beam"]
        link |= {"model": model, "shape": {"kind": "extrusion", "outline": out, "thickness": 0.01}}
        link["mesh"] = {"size": 0.01}
    factor = {"time": [0, 5e-3], "value": [0, 1]}
    force = {"kind": "force", "link": "arm", "at": [0.3, 0.2], "vector": [0.6 * load, load], "factor": factor}
    frames = {"frames": "co-rotational"} if corotational else {}
    return arm(
        link,
        constant_speed(1e-4),
        materials={"m": ALLOY},
        loads={"F": force},
        analysis={"end_time": 0.02, "step": 2e-4, "initial": "rest", **frames, **analysis},
    )


def tip(made: Ran) -> np.ndarray:
    return made.displaced("arm", [0.3, 0.2])


@pytest.mark.parametrize("kind", ["planar", "plane", pytest.param("solid", marks=pytest.mark.long)])
def test_small_loads_leave_the_linear_answer_and_the_difference_grows_with_their_square(kind: str) -> None:
    changes = {"analysis": {"end_time": 0.012, "step": 4e-4}} if kind == "solid" else {}
    apart, linear = [], 0.0
    for load in (1, 2, 4):
        rigid_body, free = (tip(ran(merged(elbow(kind, load, follow), changes))) for follow in (False, True))
        apart.append(np.abs(free - rigid_body).max())
        linear = np.abs(rigid_body).max()
    assert apart[-1] < 0.03 * linear
    order = np.diff(np.log2(apart))
    assert np.all(order > 1.95)
    assert np.all(order < 2.1)


def merged(raw: dict[str, Any], changes: dict[str, dict[str, Any]]) -> dict[str, Any]:
    return raw | {key: raw[key] | value for key, value in changes.items()}


def slow_four_bar(factor: float, follow: bool) -> dict[str, Any]:
    """The source's four-bar at 60 rpm, E and G multiplied, half a revolution; settled by its damping."""
    raw: dict[str, Any] = four_bar(
        {
            "revolutions": 0.5,
            "steps_per_revolution": 720,
            "initial": "quasi-static",
            **({"frames": "co-rotational"} if follow else {}),
        },
        {"mesh": {"elements": 3}},
        materials={"alloy": {"density": 2796, "youngs_modulus": factor * 7.031e10, "shear_modulus": factor * 2.712e10}},
        drive={"joint": "A", "motion": {"kind": "ramp", "speed": "60 rpm", "time": 0.3}},
        damping={"ratio": 0.3, "frequencies": [20, 200]},
    ).model_dump(mode="json", exclude_unset=True)
    return raw


def test_stiff_links_leave_the_linear_answer_and_the_difference_falls_with_the_square_of_their_stiffness() -> None:
    apart = []
    for factor in (0.25, 1, 4):
        rigid_body, free = (ran(slow_four_bar(factor, follow)) for follow in (False, True))
        at = free.ready.scene.joints["C"].at
        d = free.displaced("rocker", at) - rigid_body.displaced("rocker", at)
        apart.append(float(np.sqrt(np.mean(d**2))))
    order = np.diff(np.log(apart)) / np.log(4)
    assert np.all(order < -1.9)
    assert np.all(order > -2.1)


@pytest.mark.parametrize("kind", ["spatial", "rigid"])
def test_the_same_whichever_way_the_whole_scene_is_turned(kind: str) -> None:
    """A bent arm on a hinge that falls under gravity and a spring: all points and vectors turned at random."""
    straight = ran(pendulum(kind, np.eye(3)))
    R = Rotation.from_rotvec([0.9, -0.7, 1.3]).as_matrix()
    turned = ran(pendulum(kind, R))
    path = straight.position("arm", [0.3, 0.2, 0.1])
    assert np.ptp(path, axis=0).max() > 0.01
    assert_allclose(turned.position("arm", R @ [0.3, 0.2, 0.1]), path @ R.T, rtol=0, atol=1e-5)


def pendulum(kind: str, R: np.ndarray) -> dict[str, Any]:
    points = [list(R @ x) for x in ([0, 0, 0], [0.3, 0, 0], [0.3, 0.2, 0.1])]
    hinge = {"kind": "revolute", "links": ["ground", "arm"], "at": points[0], "axis": list(R @ [0.3, 0.4, 1.0])}
    arm = {"material": "m", "model": "beam", "beam": "spatial", "mesh": {"elements": 2},
           "shape": {"kind": "polyline", "points": points, "width": 0.01, "thickness": 0.01}}  # fmt: skip
    if kind == "rigid":
        del arm["beam"], arm["mesh"]
        arm["model"] = "rigid"
    return {
        "gravity": list(R @ [2.0, -9.0, 3.0]),
        "materials": {"m": ALLOY},
        "links": {"arm": arm},
        "joints": {"A": hinge},
        "springs": {"s": {"kind": "torsion", "joint": "A", "stiffness": 0.05, "damping": 0.002}},
        "analysis": {"end_time": 0.05, "step": 1e-3},
    }  # fmt: skip


@pytest.mark.parametrize("kind", ["planar", "plane", "solid", "rigid"])
def test_free_flight_keeps_momentum_and_the_integrators_order_of_spin_and_energy(kind: str) -> None:
    """Linear momentum to rounding; angular momentum and energy to second order of the step, from both sides."""
    lost = []
    for h in (4e-4, 2e-4):
        made = ran(flight(kind, h))
        p, energy = made.momentum, made.kinetic_energy + made.strain_energy
        assert_allclose(p[:, :3], p[[0]][:, :3].repeat(len(p), 0), rtol=0, atol=1e-11 * np.abs(p[0, :3]).max())
        spin = np.linalg.norm(p[-1, 3:] - p[0, 3:]) / np.linalg.norm(p[0, 3:])
        lost.append((spin, abs(energy[-1] / energy[0] - 1)))
    assert max(lost[0]) < 1e-3
    order = np.log2(np.array(lost[0]) / lost[1])
    assert np.all(order > 1.8)
    assert np.all(order < 2.3)


def flight(kind: str, h: float) -> dict[str, Any]:
    """A bar thrown spinning, in space if it can."""
    flat = kind in {"planar", "plane"}
    link = {"material": "m", "model": "beam" if kind in {"planar", "spatial"} else kind,
            "shape": {"kind": "bar", "between": [[0, 0], [0.5, 0]], "width": 0.01, "thickness": 0.01}}  # fmt: skip
    if link["model"] == "beam":
        link |= {"beam": kind, "mesh": {"elements": 3}}
    elif kind != "rigid":
        link |= {"mesh": {"elements": [4, 1] if flat else [4, 1, 1]}, "segments": 2}
    start = {
        "at": [0.25, 0],
        "velocity": [1, 2, 0 if flat else 0.5],
        "angular_velocity": [0, 0, 30] if flat else [5, 10, 30],
    }
    return {
        "materials": {"m": ALLOY},
        "links": {"arm": link},
        "analysis": {"end_time": 0.04, "step": h, "rho_inf": 0.9, "initial_motions": {"arm": start}},
    }


def test_joints_stay_closed_and_work_is_as_counted() -> None:
    """One factorisation per segment, at most four iterations a step, in the source's four-bar at 600 rpm."""
    raw = four_bar(
        {"revolutions": 0.5, "steps_per_revolution": 1000, "frames": "co-rotational", "initial": "rest"},
        {"mesh": {"elements": 4}},
        damping={"ratio": 0.02, "frequencies": [20, 200]},
    ).model_dump(mode="json", exclude_unset=True)  # fmt: skip
    made = ran(raw)
    assert made.solver.factorisations == len(made.ready.model.links) == 12
    assert 1 < made.iterations <= 4
    for at, (one, other) in {"B": ("crank", "coupler"), "C": ("coupler", "rocker")}.items():
        point = made.ready.scene.joints[at].at
        gap = made.position(one, point) - made.position(other, point)
        assert np.abs(gap[:101]).max() < 1e-12
