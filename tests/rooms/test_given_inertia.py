"""Rigid links given by mass, centre and inertia: as those of a shape, as a pendulum, in every direction."""

from itertools import pairwise
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from kedfem.accuracy.histories import histories, is_judged
from kedfem.accuracy.prepared import meshed
from kedfem.errors import SceneError
from kedfem.kinematics import rigid_links
from kedfem.scene import Scene, inertia_tensor, scene_from

STEEL, WIDTH, THICKNESS = 7850.0, 0.02, 0.01
OBLIQUE = Rotation.from_rotvec([0.5, -1.0, 0.3]).as_matrix()
SIX = [0, 1, 2, 0, 1, 2], [0, 1, 2, 1, 2, 0]


def six(J: np.ndarray) -> list[float]:
    return J[SIX].tolist()


def bar(a: list[float], b: list[float], model: str) -> dict[str, Any]:
    shape = {"kind": "polyline", "points": [a, b], "width": WIDTH, "thickness": THICKNESS}
    return {"material": "steel", "shape": shape, "model": model}


def numbers(a: list[float], b: list[float]) -> dict[str, Any]:
    """The same bar by its numbers; its width lies in the xy plane."""
    P, Q = (np.array([*x, 0.0][:3]) for x in (a, b))
    length = np.linalg.norm(Q - P)
    e = (Q - P) / length
    across = np.cross([0.0, 0.0, 1.0], e)
    across /= np.linalg.norm(across)
    w, t = across, np.cross(e, across)
    m = STEEL * length * WIDTH * THICKNESS
    spread = (length**2 * np.outer(e, e) + WIDTH**2 * np.outer(w, w) + THICKNESS**2 * np.outer(t, t)) / 12
    J = m * (np.trace(spread) * np.eye(3) - spread)
    return {"model": "rigid", "mass": m, "centre": ((P + Q) / 2).tolist(), "inertia": six(J)}


def four_bar(crank: Any, coupler: Any) -> dict[str, Any]:
    A, B, C, D = [0.0, 0.0], [0.1, 0.0], [0.35, 0.2], [0.4, 0.0]
    joints = {"A": ("ground", "crank", A), "B": ("crank", "coupler", B), "C": ("coupler", "rocker", C),
              "D": ("rocker", "ground", D)}  # fmt: skip
    return {
        "links": {"crank": crank(A, B), "coupler": coupler(B, C), "rocker": bar(C, D, "beam")},
        "joints": {name: {"kind": "revolute", "links": [a, b], "at": at} for name, (a, b, at) in joints.items()},
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 40.0}},
        "analysis": {"revolutions": 0.2, "steps_per_revolution": 360, "initial": "quasi-static"},
    }  # fmt: skip


def rssr(coupler: Any) -> dict[str, Any]:
    """Crank about z, rocker about x; a ball at the crank, a cross at the rocker."""
    origin, P, pivot = [0.0, 0.0, 0.0], [0.1, 0.0, 0.0], [0.3, -0.1, 0.25]
    Q = [0.3, -0.1 + 0.25 * np.cos(1.0), 0.25 + 0.25 * np.sin(1.0)]
    arm = np.cross(np.subtract(Q, P), [0, 0, 1])
    axes = [arm.tolist(), np.cross(arm, np.subtract(Q, P)).tolist()]
    return {
        "links": {"crank": bar(origin, P, "beam"), "coupler": coupler(P, Q), "rocker": bar(Q, pivot, "beam")},
        "joints": {
            "A": {"kind": "revolute", "links": ["ground", "crank"], "at": origin, "axis": "z"},
            "B": {"kind": "spherical", "links": ["crank", "coupler"], "at": P},
            "C": {"kind": "universal", "links": ["coupler", "rocker"], "at": Q, "axes": axes},
            "D": {"kind": "revolute", "links": ["rocker", "ground"], "at": pivot, "axis": "x"},
        },
        "drive": {"joint": "A", "motion": {"kind": "constant_speed", "speed": 20.0}},
        "analysis": {"revolutions": 0.1, "steps_per_revolution": 360, "initial": "quasi-static"},
    }


def channels(raw: dict[str, Any]) -> dict[str, np.ndarray]:
    every = histories(meshed(scene_from(raw))).channels
    return {name: x for name, (_, x) in every.items() if is_judged(name)}


def shaped(a: list[float], b: list[float]) -> dict[str, Any]:
    return bar(a, b, "rigid")


@pytest.mark.parametrize("frames", ["rigid-body", "co-rotational"])
def test_a_four_bar_of_links_by_numbers_is_that_of_rigid_bars(frames: str) -> None:
    """A crank that the drive carries, and a coupler that moves freely."""
    found, wanted = four_bar(numbers, numbers), four_bar(shaped, shaped)
    for raw in (found, wanted):
        raw["analysis"]["frames"] = frames
    here, there = channels(found), channels(wanted)
    assert here.keys() == there.keys()
    for name, x in there.items():
        assert_allclose(here[name], x, rtol=0, atol=1e-6 * np.abs(x).max(), err_msg=name)


def light(a: list[float], b: list[float], kind: str = "polyline") -> dict[str, Any]:
    made = shaped(a, b) | {"material": "light"}
    if kind == "bar":
        made["shape"] = {"kind": "bar", "between": [a, b], "width": WIDTH, "thickness": THICKNESS}
    return made


LIGHT = {"light": {"density": STEEL * 1e-9, "youngs_modulus": 2.1e11, "poisson_ratio": 0.3}}


def test_a_body_on_a_planar_line_of_next_to_no_mass_moves_as_a_bar() -> None:
    """The line's own modes are as stiff as they are heavy: forces were 20 % off."""
    raw, whole = four_bar(shaped, light), numbers([0.1, 0.0], [0.35, 0.2])
    body = {key: whole[key] for key in ("mass", "centre", "inertia")}
    raw["bodies"] = {"b": {"kind": "rigid_body", "link": "coupler", "at": whole["centre"], **body}}
    here, there = channels(raw | {"materials": LIGHT}), channels(four_bar(shaped, shaped))
    for name, x in there.items():
        assert_allclose(here[name], x, rtol=0, atol=1e-6 * np.abs(x).max(), err_msg=name)


@pytest.mark.parametrize("kind", ["line", "bar", "line in space"])
def test_a_point_mass_on_next_to_no_mass_is_refused(kind: str) -> None:
    """Forces were 10 % off; with a line of 1e-5 of its mass they are those of one of 1e-3 but for that mass."""
    raw = (
        rssr(light)
        if kind == "line in space"
        else four_bar(shaped, lambda a, b: light(a, b, "bar" if kind == "bar" else "polyline"))
    )
    joints = raw["joints"]
    middle = (np.array([*joints["B"]["at"], 0.0][:3]) + np.array([*joints["C"]["at"], 0.0][:3])) / 2
    raw["bodies"] = {"b": {"kind": "point_mass", "link": "coupler", "at": middle.tolist(), "mass": 0.5}}
    raw["materials"] = LIGHT
    with pytest.raises(SceneError, match=r"^links\.coupler: a rigid link must have mass in more than one place"):
        meshed(scene_from(raw))

    def with_density(share: float) -> dict[str, np.ndarray]:
        return channels(raw | {"materials": {"light": LIGHT["light"] | {"density": STEEL * share}}})

    lighter, heavier = with_density(1e-5), with_density(1e-3)
    for name, x in heavier.items():
        if name.endswith(("force", "torque")):
            assert np.abs(lighter[name] - x).max() < 5e-3 * np.abs(x).max(), name


@pytest.mark.long
@pytest.mark.parametrize("R", [np.eye(3), OBLIQUE], ids=["along the axes", "oblique"])
def test_a_coupler_in_space_by_numbers_is_that_of_a_rigid_bar(R: np.ndarray) -> None:
    def in_space(raw: dict[str, Any]) -> dict[str, np.ndarray]:
        for link in raw["links"].values():
            if "shape" in link:
                link["shape"]["points"] = [(R @ x).tolist() for x in link["shape"]["points"]]
                link["shape"]["up"] = (R @ [0.0, 0.0, 1.0]).tolist()
            else:
                link |= {
                    "centre": (R @ link["centre"]).tolist(),
                    "inertia": six(R @ inertia_tensor(link["inertia"]) @ R.T),
                }
        for joint in raw["joints"].values():
            joint["at"] = (R @ joint["at"]).tolist()
            if "axes" in joint:
                joint["axes"] = [(R @ x).tolist() for x in joint["axes"]]
            if "axis" in joint:
                joint["axis"] = (R @ np.eye(3)["xyz".index(joint["axis"])]).tolist()
        return channels(raw)

    here, there = in_space(rssr(numbers)), in_space(rssr(shaped))
    for name, x in there.items():
        if name.endswith(("force", "torque")):
            assert_allclose(here[name], x, rtol=0, atol=5e-4 * np.abs(x).max(), err_msg=name)


MASS, CENTRE = 2.0, np.array([0.05, -0.3, 0.02])
INERTIA = np.array([[0.02, 0.004, -0.003], [0.004, 0.015, 0.0], [-0.003, 0.0, 0.03]])


def pendulum(R: np.ndarray, **link: Any) -> dict[str, Any]:
    """One hinge about the third axis, weight along the first, a centre that is on neither axis."""
    made = {"model": "rigid", "mass": MASS, "centre": (R @ CENTRE).tolist(), "inertia": six(R @ INERTIA @ R.T)}
    hinge = {"kind": "revolute", "links": ["ground", "p"], "at": [0, 0, 0], "axis": R[:, 2].tolist()}
    return {
        "links": {"p": {key: x for key, x in (made | link).items() if x is not None}},
        "joints": {"H": hinge},
        "gravity": (R @ [9.81, 0.0, 0.0]).tolist(),
        "analysis": {"end_time": 0.4, "step": 1e-3, "initial": "quasi-static"},
    }


@pytest.mark.parametrize(
    "R", [np.eye(3), np.eye(3)[[1, 2, 0]], np.eye(3)[[2, 0, 1]], OBLIQUE], ids=["z", "y", "x", "oblique"]
)
def test_a_pendulum_is_that_of_its_equation(R: np.ndarray) -> None:
    x, y = CENTRE[:2]
    about = INERTIA[2, 2] + MASS * (x * x + y * y)

    def acceleration(angle: np.ndarray) -> np.ndarray:
        return -MASS * 9.81 * (x * np.sin(angle) + y * np.cos(angle)) / about

    run = histories(meshed(scene_from(pendulum(R))))
    angle, rate = solve_ivp(
        lambda t, s: [s[1], acceleration(s[0])], (0, 0.4), [0, 0], rtol=1e-10, atol=1e-12, t_eval=run.time
    ).y
    c = np.stack([x * np.cos(angle) - y * np.sin(angle), x * np.sin(angle) + y * np.cos(angle)])
    alpha = acceleration(angle)
    wanted = MASS * (np.stack([-alpha * c[1], alpha * c[0]]) - rate**2 * c - [[9.81], [0.0]])
    found = run.channels["joints/H/force"][1] @ R
    size = np.linalg.norm(wanted, axis=0).max()
    assert np.abs(np.linalg.norm(found[:, :2], axis=1) - np.linalg.norm(wanted, axis=0)).max() < 5e-3 * size


def total(scene: Scene) -> tuple[float, np.ndarray, np.ndarray]:
    """Mass, centre and second moments of a scene's one link with what it carries."""
    link = meshed(scene).model.links[0]
    M, X, one = link.mass[0], link.X, link.one
    mass = float(one @ (M @ one))
    return mass, X.T @ (M @ one) / mass, X.T @ (M @ X)


@pytest.mark.parametrize(
    "inertia", [INERTIA, np.diag([0.02, 0.02, 0.04]), np.diag([1e-4, 1e-4, 1e-4])], ids=["full", "disc", "small"]
)
def test_mass_centre_and_inertia_are_those_given(inertia: np.ndarray) -> None:
    """Where the line's share cannot be taken off, as of a flat disc, within 1e-4."""
    mass, centre, second = total(scene_from(pendulum(np.eye(3), inertia=six(inertia))))
    assert_allclose(mass, MASS, rtol=1e-12)
    assert_allclose(centre, CENTRE, atol=1e-12)
    wanted = np.trace(inertia) / 2 * np.eye(3) - inertia + MASS * np.outer(CENTRE, CENTRE)
    assert_allclose(second, wanted, rtol=0, atol=1e-4 * np.abs(wanted).max())


def test_a_centre_on_the_only_hinge_is_taken() -> None:
    raw = pendulum(np.eye(3), centre=[0.0, 0.0, 0.0])
    mass, centre, _ = total(scene_from(raw))
    assert_allclose([mass, *centre], [MASS, 0, 0, 0], atol=1e-12)


def test_rigid_motion_knows_their_masses() -> None:
    assert list(rigid_links(scene_from(four_bar(numbers, numbers)))) == ["crank", "coupler", "rocker"]


def test_three_values_are_principal_moments_along_x_y_z() -> None:
    three, six = (scene_from(pendulum(np.eye(3), inertia=x)) for x in ([1, 2, 2.5], [1, 2, 2.5, 0, 0, 0]))
    assert three.bodies == six.bodies


@pytest.mark.parametrize("inertia", [{}, {"inertia": [1, 2, 2.5]}], ids=["six", "three"])
def test_a_pattern_turns_their_inertia(inertia: dict[str, Any]) -> None:
    raw = pendulum(np.eye(3), **inertia)
    link, hinge = raw["links"].pop("p"), raw["joints"].pop("H")
    raw["patterns"] = {
        "four": {"count": 4, "about": "x", "rotation": "90 deg", "links": {"p": link}, "joints": {"H": hinge}}
    }
    scene = scene_from(raw)
    R = Rotation.from_rotvec([np.pi / 2, 0, 0]).as_matrix()
    bodies = list(scene.bodies.values())
    assert len(bodies) == 4
    for one, other in pairwise(bodies):
        assert_allclose(R @ np.array(one.centre), other.centre, atol=1e-12)
        turned = R @ inertia_tensor(one.inertia) @ R.T
        assert_allclose(turned, inertia_tensor(other.inertia), atol=1e-12)


@pytest.mark.parametrize(
    ("given", "told"),
    [
        ({"mass": None}, r"^links\.p\.mass: is required for a rigid link given by mass, .* \[kg\], got 0$"),
        ({"centre": None}, r"^links\.p\.centre: is required for .* \[m\], got nothing$"),
        ({"inertia": None}, r"^links\.p\.inertia: is required for .* \[kg\*m\^2\], got nothing$"),
        ({"inertia": [1, 1, 5, 0, 0, 0]}, r"^links\.p\.inertia: must have principal moments .* got 1, 1 and 5$"),
        ({"inertia": [1, 1]}, r"^links\.p\.inertia: must be three values .*, Ixx, Iyy, Izz, or six, .* got 2$"),
        ({"inertia": [1, 1, "4 kg", 0, 0, 0]}, r"^links\.p\.inertia\[2\]: must be a moment of inertia"),
        ({"centre": [0.1]}, r"^links\.p\.centre: must be a point"),
        ({"material": "steel"}, r"^links\.p\.material: cannot be combined with centre and inertia, got material$"),
        ({"shape": {"kind": "bar", "between": [[0, 0], [1, 0]], "width": 0.1, "thickness": 0.1}},
         r"^links\.p\.shape: cannot be combined with centre and inertia, got shape$"),
        ({"model": "solid"}, r"^links\.p\.centre: must be given for a rigid link only, got model 'solid'"),
        ({"model": None}, r"^links\.p\.model: must be 'rigid' for a link given by its mass, .* got nothing$"),
        ({"model": None, "centre": None, "inertia": None}, r"^links\.p\.model: must be 'rigid' .* got nothing$"),
    ],
)  # fmt: skip
def test_what_is_lacking_or_impossible_is_told(given: dict[str, Any], told: str) -> None:
    with pytest.raises(SceneError, match=told):
        scene_from(pendulum(np.eye(3), **given))


@pytest.mark.parametrize(
    ("section", "told"),
    [
        ({"joints": {"H": {"kind": "revolute", "links": 5, "at": [0, 0]}}}, r"joints\.H\.links: "),
        ({"joints": {"H": {"kind": "revolute", "links": ["ground", "p"], "at": "Q"}}}, r"joints\.H\.at: "),
        ({"springs": {"s": {"kind": "spring", "between": 7, "stiffness": 1}}}, r"springs\.s\.between: "),
        ({"bodies": 3}, r"bodies: must be a table"),
        ({"points": {"C": {"from": "D", "distance": 1, "angle": 0}}}, r"points\.C\.from: must .* 'D'"),
    ],
)
def test_faults_around_them_are_told_in_words(section: dict[str, Any], told: str) -> None:
    centre = {"centre": "C"} if "points" in section else {}
    with pytest.raises(SceneError, match=told):
        scene_from(pendulum(np.eye(3), **centre) | section)
