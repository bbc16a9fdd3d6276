"""Undriven mechanisms of rigid links given by mass, centre and inertia, from libraries of multibody benchmarks."""

from typing import Any

import numpy as np
from scipy.integrate import solve_ivp

from tests.moving import channels, ran

from .cases import Row, case

G = 9.81
Vector = np.ndarray


def rigid(mass: float, centre: Vector, inertia: Vector) -> dict[str, Any]:
    """A link by its mass, centre [m] and tensor of inertia about the centre (3, 3) [kg m²]."""
    pairs = (0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (2, 0)
    return {"model": "rigid", "mass": mass, "centre": centre.tolist(), "inertia": [float(inertia[x]) for x in pairs]}


def hinge(one: str, other: str, at: Vector, axis: Any = (0, 0, 1)) -> dict[str, Any]:
    return {"kind": "revolute", "links": [one, other], "at": at.tolist(), "axis": list(axis)}


def moved(raw: dict[str, Any], end: float, step: float, rho_inf: float, **more: Any) -> dict[str, np.ndarray]:
    """Channels of a scene that moves by itself."""
    times = {"end_time": end, "step": step, "rho_inf": rho_inf, "frames": "co-rotational", "accuracy": "quick"}
    return channels(*ran({**raw, "analysis": times | more}))


@case(
    "Andrews' squeezing mechanism",
    "F. Mazzia, C. Magherini, Test Set for Initial Value Problem Solvers, release 2.4 (2008), problem Andrews; data: "
    "E. Hairer, G. Wanner, Solving Ordinary Differential Equations II (1996), VII.7",
    long=True,
)
def squeezer() -> list[Row]:
    """Seven bodies in a plane, a constant torque and a spring; the crank makes two and a half revolutions in 0.03 s."""
    mass = [0.04325, 0.00365, 0.02373, 0.00706, 0.07050, 0.00706, 0.05498]
    inertia = [2.194e-6, 4.410e-7, 5.255e-6, 5.667e-7, 1.169e-5, 5.667e-7, 1.912e-5]
    origin, A, B, C = np.array([[0, 0], [-0.06934, -0.00227], [-0.03635, 0.03273], [0.014, 0.072]])
    names = ("β", "Θ", "γ", "Φ", "δ", "Ω", "ε")
    b, th, g, ph, de, om, ep = drawn = np.array([
        -0.06171389001427645, 0.0, 0.4552798191630704, 0.2226683901658859, 0.4873649795438426, -0.2226683901658859,
        1.230547444549821,
    ])  # fmt: skip
    wanted = [15.81077119629904, -15.75637105984298, 0.04082224013073101, -0.5347301163226948, 0.5244099658805304,
              0.5347301163226948, 1.048080741042263]  # fmt: skip

    def along(angle: float) -> Vector:
        return np.array([np.cos(angle), np.sin(angle)])

    def across(angle: float) -> Vector:
        return np.array([np.sin(angle), -np.cos(angle)])

    F, H_, G_ = 7e-3 * along(b), A + 4e-2 * across(ep), A + 4e-2 * along(de)
    E = F - 28e-3 * along(b + th)
    centres = [
        92e-5 * along(b), F - 115e-4 * along(b + th), B + 1874e-5 * across(g) + 1043e-5 * along(g),
        G_ + (2e-2 - 1421e-5) * across(ph + de), A + 2308e-5 * along(de) - 916e-5 * across(de),
        H_ + (2e-2 - 1421e-5) * along(om + ep), A + 1228e-5 * across(ep) - 449e-5 * along(ep),
    ]  # fmt: skip
    spring = B + 2e-2 * along(g) + 18e-3 * across(g)
    bodies = zip(mass, centres, inertia, strict=True)
    links = {f"K{k}": rigid(m, np.append(at, 0), J * np.eye(3)) for k, (m, at, J) in enumerate(bodies, start=1)}
    joints = {
        "O": hinge("K1", "ground", origin), "F": hinge("K2", "K1", F), "B": hinge("K3", "ground", B),
        "A5": hinge("K5", "ground", A), "A7": hinge("K7", "ground", A), "E3": hinge("K3", "K2", E),
        "E4": hinge("K4", "K2", E), "E6": hinge("K6", "K2", E), "G": hinge("K5", "K4", G_), "H": hinge("K7", "K6", H_),
    }  # fmt: skip
    ends = [{"link": "K3", "at": spring.tolist()}, {"link": "ground", "at": C.tolist()}]
    found = moved({
        "gravity": [0, 0], "links": links, "joints": joints, "motors": {"m": {"joint": "O", "torque": 0.033}},
        "springs": {"s": {"kind": "spring", "between": ends, "stiffness": 4530.0, "free_length": 0.07785}},
    }, 0.03, 5e-6, 0.99)  # fmt: skip
    turned = {name: found[f"joints/{name}/angle"][-1, 0] for name in joints}
    second = turned["O"] + turned["F"]
    rotations = [
        turned["O"], turned["F"], turned["B"], second + turned["E4"] - turned["A5"], turned["A5"],
        second + turned["E6"] - turned["A7"], turned["A7"],
    ]  # fmt: skip
    got = drawn + rotations
    return [Row(f"{n} at 0.03 s [rad]", w, x, 1e-4, "6,000 steps") for n, w, x in zip(names, wanted, got, strict=True)]


@case(
    "Stiff flyball governor",
    "after M. González et al., A collaborative benchmarking framework for multibody system dynamics, Eng. with Computers "
    "26 (2010), problem A05: Lagrange's equations of its three coordinates, integrated to 1e-11",
    long=True,
)
def governor() -> list[Row]:
    """A freely rotating shaft, two hinged rods with balls, and a slider that stiff springs and dampers connect to
    them."""
    K, C, long, start, end = 8e5, 4e4, 0.5, np.pi / 6, 2.0
    rod, ball, slider = 0.3, 5.0, 3.0
    axial, mass = rod * 2e-4 / 12, rod + ball
    off = (rod * 0.5 + ball) / mass
    square = rod * (1 + 1e-4) / 12 + rod * (0.5 - off) ** 2 + ball * (1 - off) ** 2
    about, inner = square + mass * off**2, axial + slider * 0.02 / 12

    def spin_inertia(angle: float) -> float:
        return float(inner + 2 * (about * np.sin(angle) ** 2 + axial * np.cos(angle) ** 2))

    momentum = 2 * np.pi * spin_inertia(start)

    def rates(_: float, y: Vector) -> list[float]:
        angle, rate, down, speed, _ = y
        s, c = np.sin(angle), np.cos(angle)
        way = np.array([long * s, down - long * c])
        size = np.linalg.norm(way)
        by_angle, by_down = (way @ [long * c, long * s]) / size, way[1] / size
        pull = K * (size - long) + C * (by_angle * rate + by_down * speed)
        spin = momentum / spin_inertia(angle)
        bent = (2 * spin**2 * (about - axial) * s * c - 2 * mass * off * G * s - 2 * pull * by_angle) / (2 * about)
        return [rate, bent, speed, G - 2 * pull * by_down / slider, spin]

    wanted = solve_ivp(rates, (0, end), [start, 0, np.cos(start), 0, 0], "LSODA", rtol=1e-11, atol=1e-12).y[:, -1]
    top, at = np.array([0, 0, 1.0]), np.array([0, 0, 1 - np.cos(start)])
    links = {
        "shaft": rigid(rod, top / 2, np.diag([square, square, axial])),
        "slider": rigid(slider, at, slider * 0.02 / 12 * np.eye(3)),
    }
    joints: dict[str, Any] = {
        "S": hinge("shaft", "ground", np.zeros(3)),
        "T": {"kind": "prismatic", "links": ["slider", "shaft"], "at": at.tolist(), "axis": [0, 0, -1]},
    }
    springs: dict[str, Any] = {}
    for name, side in (("one", 1.0), ("two", -1.0)):
        e = np.array([side * np.sin(start), 0, -np.cos(start)])
        links[name] = rigid(mass, top + off * e, square * np.eye(3) + (axial - square) * np.outer(e, e))
        joints[f"H {name}"] = hinge(name, "shaft", top, (0, -side, 0))
        ends = [{"link": name, "at": (top + long * e).tolist()}, {"link": "slider", "at": at.tolist()}]
        springs[name] = {"kind": "spring", "between": ends, "stiffness": K, "damping": C, "free_length": long}
    raw = {"gravity": [0, 0, -G], "links": links, "joints": joints, "springs": springs}
    found = moved(raw, end, 5e-4, 0.9, initial_speeds={"S": 2 * np.pi})
    arms = [start + found[f"joints/H {name}/angle"][-1, 0] for name in ("one", "two")]
    shaft = found["joints/S/angle"][-1, 0]
    return [
        Row("angle of the first rod at 2 s [rad]", wanted[0], arms[0], 1e-5, "4,000 steps"),
        Row("angle of the second rod [rad]", wanted[0], arms[1], 1e-5, "4,000 steps"),
        Row("revolutions of the shaft", wanted[4] / (2 * np.pi), shaft / (2 * np.pi), 1e-5, "4,000 steps"),
    ]


def windows(count: int, link: Any) -> dict[str, Any]:
    """Four-bars of equal links side by side, upright: links and joints."""
    links, joints = {}, {}
    for k in range(count + 1):
        links[f"v{k}"] = link(np.array([k, 0.0, 0]), np.array([k, 1.0, 0]))
        joints[f"A{k}"] = hinge(f"v{k}", "ground", np.array([k, 0.0, 0]))
    for k in range(count):
        links[f"h{k}"] = link(np.array([k, 1.0, 0]), np.array([k + 1, 1.0, 0]))
        for name, n in (("B", k), ("C", k + 1)):
            joints[f"{name}{k}"] = hinge(f"h{k}", f"v{n}", np.array([n, 1.0, 0]))
    return {"gravity": [0, -G], "links": links, "joints": joints}


def falling(count: int, end: float) -> float:
    """Angle of upright links after they fell from 1 rad/s, all parallel: one equation of a pendulum [rad]."""
    inertia, weight = (count + 1) / 3 + count, ((count + 1) / 2 + count) * G

    def rates(_: float, y: Vector) -> list[float]:
        return [y[1], weight * np.sin(y[0]) / inertia]

    return float(solve_ivp(rates, (0, end), [0, 1.0], rtol=1e-12, atol=1e-12).y[0, -1])


@case(
    "N-four-bar falling through its singular positions",
    "M. González et al., ibid., problem A02 (N = 2, 10 s): closed form of the parallel branch",
    long=True,
)
def four_bars() -> list[Row]:
    """Five links of 1 m and 1 kg; where all are collinear, each loop could change its branch.
    Slightly elastic links with damping stay on the branch, at order 2 in the step; the remaining error of the angle is
    due to their elasticity. Rigid links conserve energy.
    """
    end, steps = 10.0, (2e-3, 1e-3, 5e-4, 2.5e-4)

    def bar(a: Vector, b: Vector) -> dict[str, Any]:
        shape = {"kind": "bar", "between": [a[:2].tolist(), b[:2].tolist()], "width": 0.03, "thickness": 0.03}
        return {"material": "m", "model": "beam", "shape": shape, "mesh": {"elements": 1}}

    def stiff(a: Vector, b: Vector) -> dict[str, Any]:
        e = b - a
        return rigid(1.0, (a + b) / 2, (np.eye(3) - np.outer(e, e)) / 12)

    steel = {"m": {"density": 1 / 0.03**2, "youngs_modulus": 2e11, "poisson_ratio": 0.3}}
    elastic = {**windows(2, bar), "materials": steel, "damping": {"beta": 1e-4}}
    runs = [moved(elastic, end, step, 0.8, initial_speeds={"A0": -1.0}) for step in steps]
    left = [np.abs(run["energy/residual"]).max() for run in runs]
    angle = -runs[-1]["joints/A0/angle"][-1, 0]
    free = moved(windows(2, stiff), end, 1e-3, 0.999, initial_speeds={"A0": -1.0})
    drift = np.abs(free["energy/residual"]).max() / free["energy/kinetic"].max()
    orders = np.log2(np.divide(left[:-1], left[1:]))
    return [
        Row("angle at 10 s, elastic [rad]", falling(2, end), angle, 2e-4, "beam3, 40,000 steps"),
        Row("order of the residual energy, 1 to 0.25 ms", 2.0, float(orders[1:].mean()), 0.05, "beam3"),
        Row("energy lost by rigid links, of the largest kinetic", 0.0, float(drift), 1e-4, "1 ms, ρ∞ = 0.999"),
    ]
