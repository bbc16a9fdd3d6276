"""Loads along beams: resultants, the moment within elements, as body loads, as by the oracle, rigid links."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.spatial.transform import Rotation

from kedfem.accuracy.prepared import meshed
from kedfem.accuracy.reduction import prepared
from kedfem.analysis import analyse
from kedfem.errors import SceneError
from kedfem.links.beams.beam import beam_link
from kedfem.links.beams.beam_axis import straight_axis
from kedfem.links.beams.line_weights import axis_weights
from kedfem.links.beams.section import rectangle
from kedfem.links.beams.spatial_beam import spatial_beam_link
from kedfem.links.point_rows import point_rows
from kedfem.links.record import Link, in_space
from kedfem.scene import scene_from
from tests.laws.strategies import MATERIAL
from tests.laws.test_capabilities import as_a_run
from tests.systems import against_oracle, begun, stiffened

Raw = dict[str, Any]
L, W, T = 0.5, 0.03, 0.02
SECTION = rectangle(W, T)
ASKEW = Rotation.from_rotvec([0.9, -0.7, 1.3]).as_matrix()


def link(kind: str, points: Any, R: np.ndarray = np.eye(3), **more: Any) -> Raw:  # noqa: B008
    """A polyline of steel W wide along y, T thick along z, where R is the identity."""
    shape: Raw = {"kind": "polyline", "points": (np.asarray(points, float) @ R.T).tolist(), "width": W, "thickness": T}
    if kind == "spatial":
        return {"model": "beam", "beam": kind, "material": "steel", "shape": shape | {"up": R[:, 2].tolist()}, **more}
    return {"model": "rigid" if kind == "rigid" else "beam", "material": "steel", "shape": shape, **more}


def arm(of: Raw, loads: Raw, R: np.ndarray = np.eye(3), driven: bool = True, **analysis: Any) -> Raw:  # noqa: B008
    """A link on a hinge at the origin."""
    hinge = {"kind": "revolute", "links": ["ground", "arm"], "at": [0, 0, 0], "axis": R[:, 2].tolist()}
    steps: Raw = {"end_time": 0.005, "step": 2e-4, "rho_inf": 0.8, "initial": "rest", **analysis}
    raw: Raw = {"links": {"arm": of}, "joints": {"A": hinge}, "loads": loads, "analysis": steps}
    if driven:
        return raw | {"drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 30.0}}}
    steps["initial_speeds"] = {"A": 30.0}
    return raw


def line(R: np.ndarray = np.eye(3), q: Any = (0, 300, 0), **more: Any) -> Raw:  # noqa: B008
    return {"kind": "line", "link": "arm", "vector": (R @ np.asarray(q, float)).tolist(), **more}


def wrench(raw: Raw) -> tuple[np.ndarray, np.ndarray]:
    """Force and moment about the origin of the loads on the segments of all links, as they are drawn."""
    model, force, moment = meshed(scene_from(raw)).model, np.zeros(3), np.zeros(3)
    for of, loads in zip(model.links, model.loads, strict=True):
        for load in loads:
            f = in_space(of, load.forces)
            force, moment = force + of.one @ f, moment + np.cross(of.X, f).sum(axis=0)
    return force, moment


# -- resultants ---------------------------------------------------------------------------------------------

BENT = ((0, 0, 0), (0.4, 0, 0), (0.4, 0.3, 0))
FRAME = ((0, 0, 0), (0.4, 0, 0), (0.4, 0.3, 0), (0, 0.3, 0), (0, 0, 0))
ON_BENT = {  # Σ f and Σ x × f of 300 N/m along y, by hand: length, and the middle along x
    "all": ({}, 0.7, (0.4 * 0.2 + 0.3 * 0.4) / 0.7), "round the corner": ({"between": [[0.1, 0], [0.4, 0.2]]}, 0.5, 0.31),
    "backwards": ({"between": [[0.4, 0.2], [0.1, 0]]}, 0.5, 0.31),
}  # fmt: skip


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
@pytest.mark.parametrize("drawn", ["planar", "spatial", "askew"])
@pytest.mark.parametrize("part", ON_BENT)
def test_a_load_has_the_resultant_of_its_line(part: str, drawn: str, frames: str) -> None:
    R = ASKEW if drawn == "askew" else np.eye(3)
    more, length, x = ON_BENT[part]
    more = {key: [(R @ [*P, 0]).tolist() for P in ends] for key, ends in more.items()}
    of = link("planar" if drawn == "planar" else "spatial", BENT, R, mesh={"elements": 2})
    force, moment = wrench(arm(of, {"q": line(R, **more)}, R, frames=frames))
    assert_allclose(R.T @ force, [0, 300 * length, 0], atol=1e-10)
    assert_allclose(R.T @ moment, [0, 0, 300 * length * x], atol=1e-10)


@pytest.mark.parametrize("kind", ["planar", "spatial"])
@pytest.mark.parametrize("turned", [False, True])
def test_a_load_changes_from_where_it_begins_to_where_it_ends(kind: str, turned: bool) -> None:
    """From 300 N/m at 0.1 m to 900 N/m at 0.4 m: their mean, and its middle at (300/2 + 600/3) / 600 of the way."""
    ends = [[0.1, 0], [0.4, 0]]
    more = {"vector": [0, 900], "end_vector": [0, 300]} if turned else {"end_vector": [0, 900]}
    q = line(between=ends[::-1] if turned else ends) | more
    force, moment = wrench(arm(link(kind, ((0, 0, 0), (L, 0, 0)), mesh={"elements": 3}), {"q": q}))
    assert_allclose(force[1], 600 * 0.3, rtol=1e-12)
    assert_allclose(moment[2], 600 * 0.3 * (0.1 + 0.3 * 350 / 600), rtol=1e-12)


@pytest.mark.parametrize(("between", "length"), [(None, 1.4), ([[0, 0.1], [0.1, 0]], 0.2), ([[0.1, 0], [0, 0.1]], 1.2)])
def test_a_load_goes_round_a_closed_line_in_its_direction(between: Any, length: float) -> None:
    q = line() | ({} if between is None else {"between": between})
    force, _ = wrench(arm(link("planar", FRAME, mesh={"elements": 2}), {"q": q}))
    assert_allclose(force, [0, 300 * length, 0], atol=1e-10)


def test_a_load_along_a_smooth_line_has_its_length() -> None:
    """A quarter of a circle of 0.4 m by a spline through nine points: its length to 1e-5."""
    phi = np.linspace(0, np.pi / 2, 9)
    points = 0.4 * np.stack([np.sin(phi), 1 - np.cos(phi), 0 * phi], axis=1)
    of = link("spatial", points, mesh={"elements": 2})
    of["shape"] |= {"smooth": True, "points": points.tolist()}
    half = [[0, 0], (0.4 * np.array([np.sin(np.pi / 4), 1 - np.cos(np.pi / 4)])).tolist()]
    for more, share in (({}, 1.0), ({"between": half}, 0.5)):
        force, _ = wrench(arm(of, {"q": line(**more)}))
        assert_allclose(force[1], 300 * share * 0.4 * np.pi / 2, rtol=1e-5)


@pytest.mark.parametrize(("kind", "at", "push"), [
    ("planar", [0.2, W / 2], [0, -1, 0]), ("planar", [0.2, -W / 2], [0, 1, 0]), ("spatial", [0.2, W / 2, 0], [0, -1, 0]),
    ("spatial", [0.2, 0, T / 2], [0, 0, -1]), ("spatial", [0.2, 0.004, -T / 2], [0, 0, 1]),
])  # fmt: skip
@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
def test_a_pressure_pushes_on_the_side_that_it_is_at(kind: str, at: Any, push: Any, frames: str) -> None:
    """5 kPa on the side of 0.4 m of a line that bends there, as wide as the section is across it; turns with it."""
    p = {"kind": "pressure", "link": "arm", "at": at, "pressure": 5e3}
    raw = arm(link(kind, BENT, mesh={"elements": 2}), {"p": p}, frames=frames)
    force, moment = wrench(raw)
    F = 5e3 * 0.4 * (T if push[1] else W) * np.array(push)
    assert_allclose(force, F, atol=1e-10)
    assert_allclose(moment, np.cross([0.2, 0, 0], F), atol=1e-10)
    assert all(load.follows for loads in meshed(scene_from(raw)).model.loads for load in loads)


@pytest.mark.parametrize(("load", "said"), [
    (line(between=[[0, 0], [0.3, 0.05]]), r"loads.q.between\[1\]: must lie on the axis .*, 0.05 m beside it"),
    ({"kind": "pressure", "link": "arm", "at": [0.2, 0.005], "pressure": 1.0}, r"loads.q.at: must lie on one flat side"),
    ({"kind": "pressure", "link": "arm", "at": [0.2, W / 2, T / 2], "pressure": 1.0}, r"loads.q.at: .* one on an edge"),
    ({"kind": "pressure", "link": "arm", "at": [L, 0.0], "pressure": 1.0}, r"loads.q.at: .* one on none"),
])  # fmt: skip
def test_a_load_beside_its_beam_is_refused(load: Raw, said: str) -> None:
    with pytest.raises(SceneError, match=said):
        meshed(scene_from(arm(link("spatial", ((0, 0, 0), (L, 0, 0))), {"q": load})))


@pytest.mark.parametrize("kind", ["planar", "spatial"])
@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
def test_a_load_along_all_of_a_beam_is_its_body_load(kind: str, frames: str) -> None:
    """q = A b, to rounding."""
    per_volume = {"kind": "body", "link": "arm", "vector": [30 / W / T, 500 / W / T]}
    of = link(kind, BENT, mesh={"elements": 2})
    one, other = (
        meshed(scene_from(arm(of, {"q": load}, frames=frames))).model for load in (line(q=[30, 500, 0]), per_volume)
    )
    for (here,), (there,) in zip(one.loads, other.loads, strict=True):
        assert_allclose(here.forces, there.forces, rtol=0, atol=1e-13 * np.abs(there.forces).max())


# -- within elements ----------------------------------------------------------------------------------------

CLAMPED, HINGED = "clamped", "hinged"
#: M over q L² at x/L, positive where it stretches the side that the load pushes to; where the deflection is largest,
#: and it over q L⁴/EI and q L²/κGA
STATICS: dict[str, tuple[tuple[str, str], Any, tuple[float, float, float]]] = {
    "cantilever": ((CLAMPED, ""), lambda x: -((1 - x) ** 2) / 2, (1.0, 1 / 8, 1 / 2)),
    "simply supported": ((HINGED, HINGED), lambda x: x * (1 - x) / 2, (0.5, 5 / 384, 1 / 8)),
    "clamped at both ends": ((CLAMPED, CLAMPED), lambda x: x * (1 - x) / 2 - 1 / 12, (0.5, 1 / 384, 1 / 8)),
}


def held(of: Link, ends: tuple[str, str]) -> np.ndarray:
    """Unknowns that are held: displacements at ends, of clamped ones the section too; in space not about the axis."""
    at = [np.flatnonzero(of.one)[np.linalg.norm(of.nodes - x, axis=1).argmin()] for x in ([0, 0, 0], [L, 0, 0])]
    out: list[int] = []
    for node, end in zip(at, ends, strict=True):
        if of.kind == "beam":
            out += [3 * node + k for k in {CLAMPED: (0, 1, 2), HINGED: (0, 1)}.get(end, ())]
        elif end:  # of the four functions there the last three are the gradient; of a hinge about z its z part
            out += [3 * node + k for k in range(12)] if end == CLAMPED else [3 * node, 3 * node + 1, 3 * node + 2]
            out += [3 * (node + 3) + 1] if end == HINGED else []
    return np.array(out)


@pytest.mark.parametrize("elements", [2, 6])
@pytest.mark.parametrize("nodes", [3, 4, 5])
@pytest.mark.parametrize("kind", ["planar", "spatial"])
@pytest.mark.parametrize("case", STATICS)
def test_moment_and_deflection_of_a_uniform_load_are_exact(case: str, kind: str, nodes: int, elements: int) -> None:
    """q x²/2, q L²/8, q L²/12 and q L²/24, at nodes and between; q L⁴/8EI, 5 q L⁴/384EI and q L⁴/384EI, and shear."""
    ends, M, (where, bending, shear) = STATICS[case]
    points = np.array([[0.0, 0, 0], [L, 0, 0]])
    if kind == "planar":
        of = beam_link("arm", points, SECTION, MATERIAL, elements, nodes)
    else:
        of = spatial_beam_link("arm", straight_axis(points, elements, nodes, None), SECTION, MATERIAL)
    q, E, G = 1e3, MATERIAL.youngs_modulus, MATERIAL.shear_modulus
    F = np.outer(axis_weights({"arm": of}, "q")["arm"].sum(axis=1), [0, q, 0])
    free = np.setdiff1d(np.arange(of.unknowns), held(of, ends))
    g = np.zeros(of.unknowns)
    K = of.K0.toarray()
    g[free] = np.linalg.solve(K[np.ix_(free, free)], F.ravel()[free])
    largest = q * L**2 / 8 * W / 2 / SECTION.second_moment
    for kinks in (None, points):  # by one element, and over a run of them
        for x in np.array([0, 0.17, 0.25, 0.5, 0.62, 1.0]):
            found = (point_rows(of, "probe", np.array([x * L, W / 2, 0]), kinks).stress @ g)[0]
            assert_allclose(found, M(x) * q * L**2 * W / 2 / SECTION.second_moment, atol=1e-7 * largest)
    moved = (point_rows(of, "probe", np.array([where * L, 0, 0])).value @ g.reshape(-1, 3))[1]
    wanted = bending * q * L**4 / E / SECTION.second_moment + shear * q * L**2 / (5 / 6 * G * W * T)
    # corners of a beam in space give EI/(100 E A L²) of what it does, see links.md
    assert_allclose(moved, wanted, rtol=1e-8 if kind == "planar" else 1e-6)


# -- in motion ----------------------------------------------------------------------------------------------

ENDS = [[0.07, 0.0, 0.0], [0.38, 0.0, 0.0]]
#: how tightly the solver must be the oracle, with rounding of stiff parts beside beams in space: tests/cells.py
WITHIN = {"rigid-body": 1e-8, "stiffening": 1e-8, "co-rotational": 1e-7}


def loads(kind: str, R: np.ndarray) -> Raw:
    """One that keeps its direction, one that turns and changes along a part, and a pressure."""
    dims = 2 if kind == "planar" else 3
    z = 0.0 if kind == "planar" else 40.0
    every = {
        "world": line(R, [60, 300, z], end_vector=(R @ [0, -100, -z]).tolist()),
        "link": line(R, [60, 300, z], frame="link", between=[(R @ P).tolist() for P in ENDS]),
        "pressure": {"kind": "pressure", "link": "arm", "at": (R @ [0.2, W / 2, 0]).tolist(), "pressure": 3e4},
    }
    if kind == "planar":
        for each in every.values():
            for key in ("vector", "end_vector", "at"):
                if key in each:
                    each[key] = each[key][:dims]
    return every


@pytest.mark.parametrize(("frames", "driven"), [*((x, True) for x in WITHIN), ("co-rotational", False)])
@pytest.mark.parametrize("kind", ["planar", "spatial"])
def test_a_beam_under_loads_along_it_moves_as_by_the_oracle(kind: str, driven: bool, frames: str) -> None:
    R = ASKEW if kind == "spatial" else np.eye(3)
    of = link(kind, ((0, 0, 0), (L, 0, 0)), R, mesh={"elements": 2})
    raw = arm(of, loads(kind, R), R, driven, frames="co-rotational" if frames == "co-rotational" else "rigid-body")
    made = begun(raw)
    made = as_a_run(made) if frames == "co-rotational" else stiffened(made) if frames == "stiffening" else made
    assert against_oracle(made) < WITHIN[frames]


def first_columns(raw: Raw, folder: Path) -> dict[str, np.ndarray]:
    output = {"plots": False, "picture": False, "animation": False}
    channels = analyse(scene_from(raw | {"output": output}, folder)).results.channels
    return {name: values[:, 0] for name, (_, values) in channels.items()}


@pytest.mark.parametrize("kind", ["planar", pytest.param("spatial", marks=pytest.mark.long)])
def test_the_work_of_loads_along_a_reduced_beam_is_in_its_energy(kind: str, tmp_path: Path) -> None:
    """Full and reduced to six modes alike; the audit finds the work of drive and loads in the energies."""
    found = []
    for more in ({}, {"reduction": 6}):
        of = link(kind, ((0, 0, 0), (L, 0, 0)), mesh={"elements": 6}, **more)
        ramp = {"time": [0.0, 0.02], "value": [0.0, 1.0]}
        every = {name: x | {"factor": ramp} for name, x in loads(kind, np.eye(3)).items()}
        raw = arm(of, every, end_time=0.05, step=1e-4, initial="quasi-static")
        found.append(first_columns(raw, tmp_path / str(len(found))))
    one, other = found
    assert_allclose(other["energy/strain"], one["energy/strain"], atol=2e-3 * one["energy/strain"].max())
    for each in found:
        assert np.abs(each["energy/work"]).max() > 1.0
        assert_allclose(each["energy/residual"], 0, atol=1e-3 * np.abs(each["energy/work"]).max())


# -- rigid links --------------------------------------------------------------------------------------------

BAR = {"kind": "bar", "between": [[0, 0, 0], [L, 0, 0]], "width": W, "thickness": T}
RIGID: dict[str, Raw] = {
    "bar": {"model": "rigid", "material": "steel", "shape": BAR},
    "polyline": link("rigid", ((0, 0, 0), (L, 0, 0))),
    "planar": link("planar", ((0, 0, 0), (L, 0, 0)), mesh={"elements": 2}),
}


@pytest.mark.parametrize(("kind", "frame"), [
    ("bar", "world"), ("polyline", "link"), ("planar", "world"),
    *(pytest.param(*x, marks=pytest.mark.long) for x in (("bar", "link"), ("polyline", "world"), ("planar", "link"))),
])  # fmt: skip
def test_a_drive_turns_a_link_against_a_load_along_it(kind: str, frame: str, tmp_path: Path) -> None:
    """−q a²/2 of a load that turns with the link, times cos φ of one that does not, by rigid inverse dynamics."""
    q, (a, b) = 400.0, (0.1, 0.45)
    load = line(q=[0, q, 0], frame=frame, between=[[a, 0], [b, 0]])
    raw = arm(RIGID[kind], {"q": load}, end_time=0.1, step=1e-3, initial="quasi-static")
    if kind != "planar":  # a run needs an elastic link
        raw["links"]["tip"] = link("planar", ((L, 0, 0), (L + 0.02, 0, 0)))
        raw["joints"]["B"] = {"kind": "weld", "links": ["arm", "tip"], "at": [L, 0, 0]}
    output = {"plots": False, "picture": False, "animation": False}
    results = analyse(scene_from(raw | {"output": output}, tmp_path)).results
    torque = results.channels["drive/rigid_torque"][1][:, 0]
    cosine = np.cos(results.angle) if frame == "world" else np.ones(len(torque))
    assert_allclose(torque, -q * (b**2 - a**2) / 2 * cosine, rtol=1e-9, atol=1e-9 * q)


def test_a_rigid_body_takes_a_load_between_two_points(tmp_path: Path) -> None:
    """A rigid link of mass, centre and inertia, loaded beside its joints; from 200 to 500 N/m along 0.3 m."""
    body = {"model": "rigid", "mass": 2.0, "centre": [0.2, 0.0, 0.0], "inertia": [0.01, 0.02, 0.02, 0, 0, 0]}
    q = line(q=[0, 0, 200], end_vector=[0, 0, 500], between=[[0.1, 0.2, 0.1], [0.4, 0.2, 0.1]])
    raw = arm(body, {"q": q}, np.array([[0, 0, 1.0], [1, 0, 0], [0, 1, 0]]), driven=False, frames="co-rotational")
    raw["analysis"].pop("initial_speeds")
    raw["joints"]["A"]["axis"] = [1, 0, 0]
    force, moment = wrench(raw)
    assert_allclose(force, [0, 0, 350 * 0.3], atol=1e-9)
    middle = (200 / 2 + 300 / 3) / 350 * 0.3
    assert_allclose(moment, np.cross([0.1 + middle, 0.2, 0.1], force), atol=1e-9)


def test_prepared_scenes_keep_loads_on_reduced_beams() -> None:
    """On modes as on the beam: the same work on each of them."""
    of = link("spatial", ((0, 0, 0), (L, 0, 0)), mesh={"elements": 6}, reduction=6)
    scene = scene_from(arm(of, {"q": line()}))
    (full,), (made,) = (x.model.loads for x in (meshed(scene), prepared(scene)[0]))
    reduced = prepared(scene)[0].model.links[0]
    assert reduced.Q is not None
    assert_allclose(made[0].forces, reduced.Q.T @ full[0].forces, atol=1e-9)
