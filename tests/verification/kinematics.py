"""Rigid linkages against closed forms, driven by a law with acceleration: positions, speeds and accelerations."""

from collections.abc import Sequence

import numpy as np

from kedfem.scene import drive_angle
from tests.linkages import (
    RISE,
    RSSR_CRANK,
    RSSR_PIVOT,
    RSSR_ROCKER,
    JointTable,
    bennett,
    body,
    cardan,
    four_bar,
    linkage_scene,
    motion_at,
    place,
    revolute_loop,
    rssr,
    rssr_points,
    slider_crank,
    spatial_slider_crank,
    turned,
)
from tests.spatial_linkages import universal_rssr, universal_slider_crank

from .cases import Row, case

T = np.linspace(0.0, 1.0, 241)
TURN = {**RISE, "angle": 2 * np.pi}
CAP = 1e-12  # of the greatest value: rounding, times the linkage's worst condition number (about 100)
Curve = tuple[np.ndarray, np.ndarray, np.ndarray]  # a quantity and two derivatives


def in_time(curve: Curve, drive: Curve) -> Curve:
    """Derivatives by time from those by the drive angle, by the chain rule."""
    (y, y1, y2), (_, speed, acceleration) = curve, drive
    return y, y1 * speed, y2 * speed**2 + y1 * acceleration


def errors(name: str, got: Curve, wanted: Curve, model: str, cap: float = CAP) -> list[Row]:
    """Greatest errors over the motion, relative to the greatest value of each derivative."""
    what = (name, f"speed of the {name}", f"acceleration of the {name}")
    return [
        Row(f"{q}, greatest error over a revolution", 0.0, float(np.abs(g - w).max() / np.abs(w).max()), cap, model)
        for q, g, w in zip(what, got, wanted, strict=True)
    ]


def implicit(f1: np.ndarray, fy: np.ndarray, f11: np.ndarray, f1y: np.ndarray, fyy: np.ndarray) -> Sequence[np.ndarray]:
    """y' and y'' of f(x, y) = 0 from its partial derivatives."""
    y1 = -f1 / fy
    return y1, -(f11 + 2 * f1y * y1 + fyy * y1**2) / fy


def angle_of(
    joints: JointTable, name: str, axis: Sequence[float], drawn: float, other: str | None = None,
    law: dict[str, object] = TURN,
) -> tuple[Curve, Curve]:  # fmt: skip
    """Angle of a link about an axis drawn in another one (the ground), with rates; and the drive's."""
    scene = linkage_scene(joints, motion=law)
    m = motion_at(scene, T)
    i, j = body(scene, name), 0 if other is None else body(scene, other)
    a = m.R[:, j] @ np.asarray(axis)
    # both bodies turn about the common axis a only: (ω_i − ω_j)·a' = 0
    rates = [np.einsum("tk,tk->t", x[:, i] - x[:, j], a) for x in (m.omega, m.alpha)]
    return (drawn + turned(m, i, np.asarray(axis), j), *rates), drive_angle(scene.drive.motion, T)


@case("Four-bar", "R. L. Norton, Design of Machinery: position, velocity and acceleration of the pin-jointed four-bar")
def planar_four_bar() -> list[Row]:
    """The linkage of Nath and Ghosh (1980), reference position at 60°, a full revolution by a cycloidal law."""
    a, b, c, d = 0.3048, 0.9144, 0.762, 0.9144
    joints = four_bar(a, b, c, d, np.pi / 3)
    B, C, D = (joints[k][3] for k in "BCD")
    start = [np.arctan2(v[1], v[0]) for v in (C - B, C - D)]
    z = (0.0, 0.0, 1.0)
    (coupler, drive), (rocker, _) = (
        angle_of(joints, name, z, drawn) for name, drawn in zip(("coupler", "rocker"), start, strict=True)
    )
    t2 = np.pi / 3 + drive[0]
    diagonal = np.array([d, 0.0])[:, None] - a * np.array([np.cos(t2), np.sin(t2)])
    s = np.hypot(*diagonal)
    across = np.arccos((b**2 + s**2 - c**2) / (2 * b * s))
    t3 = np.unwrap(np.arctan2(diagonal[1], diagonal[0]) + across)
    t4 = np.unwrap(np.arctan2(a * np.sin(t2) + b * np.sin(t3), a * np.cos(t2) + b * np.cos(t3) - d))
    w3 = a * np.sin(t4 - t2) / (b * np.sin(t3 - t4))
    w4 = a * np.sin(t2 - t3) / (c * np.sin(t4 - t3))
    A_, B_, D_, E_ = c * np.sin(t4), b * np.sin(t3), c * np.cos(t4), b * np.cos(t3)
    C_ = a * np.cos(t2) + b * w3**2 * np.cos(t3) - c * w4**2 * np.cos(t4)
    F_ = -a * np.sin(t2) - b * w3**2 * np.sin(t3) + c * w4**2 * np.sin(t4)
    det = A_ * E_ - B_ * D_
    wanted3 = in_time((t3, w3, (C_ * D_ - A_ * F_) / det), drive)
    wanted4 = in_time((t4, w4, (C_ * E_ - B_ * F_) / det), drive)
    model = "3 links, 4 revolutes"
    return errors("coupler angle", coupler, wanted3, model) + errors("rocker angle", rocker, wanted4, model)


def slider_x(joints: JointTable) -> tuple[Curve, Curve]:
    """x of a slider's point with rates, and the drive's."""
    scene = linkage_scene(joints, motion=TURN, sliders=("slider",))
    m = motion_at(scene, T)
    x, v, a = (q[:, 0] for q in place(m, body(scene, "slider"), np.asarray(joints["guide"][3])))
    return (x, v, a), drive_angle(scene.drive.motion, T)


@case("Slider-crank", "closed form of any textbook: x = r cos φ + √(l² − r² sin² φ)")
def planar_slider_crank() -> list[Row]:
    """Crank 0.1 m, rod 0.3 m, reference position at 40°, a full revolution by a cycloidal law."""
    r, rod, drawn = 0.1, 0.3, np.radians(40)
    got, drive = slider_x(slider_crank(r, rod, drawn))
    sin, cos = np.sin(drawn + drive[0]), np.cos(drawn + drive[0])
    s = np.sqrt(rod**2 - (r * sin) ** 2)
    first = -r * sin - r**2 * sin * cos / s
    second = -r * cos - r**2 * (cos**2 - sin**2) / s - r**4 * (sin * cos) ** 2 / s**3
    return errors("slider", got, in_time((r * cos + s, first, second), drive), "3 links, 3 revolutes, a slide")


@case("Spatial slider-crank", "E. J. Haug, Computer-Aided Kinematics and Dynamics of Mechanical Systems (1989)")
def slider_crank_in_space() -> list[Row]:
    """Crank 0.08 m about an axis along x at y = 0.1, z = 0.12; rod 0.3 m; slider on x: x² = l² − y_B² − z_B².

    A ball at the crank; at the slider a universal joint, or its cross as a body, so that the rod cannot rotate
    about itself.
    """
    drawn = 0.3
    crossed = "4 links, 3 revolutes, a ball, a slide"
    universal = "3 links, a revolute, a ball, a universal joint, a slide"
    return [
        *_slider_in_space(spatial_slider_crank(drawn), drawn, crossed),
        *_slider_in_space(universal_slider_crank(drawn), drawn, universal),
    ]


def _slider_in_space(joints: JointTable, drawn: float, model: str) -> list[Row]:
    got, drive = slider_x(joints)
    sin, cos = np.sin(drawn + drive[0]), np.cos(drawn + drive[0])
    w = 0.1**2 + 0.12**2 + 0.08**2 + 0.16 * (0.12 * cos - 0.1 * sin)
    w1, w2 = 0.16 * (-0.12 * sin - 0.1 * cos), 0.16 * (-0.12 * cos + 0.1 * sin)
    x = np.sqrt(0.3**2 - w)
    wanted = in_time((x, -w1 / (2 * x), -w2 / (2 * x) - w1**2 / (4 * x**3)), drive)
    return errors("slider", got, wanted, model)


@case("Cardan joint", "closed form of any textbook: tan φ2 = tan φ1 / cos β")
def universal_joint() -> list[Row]:
    """Shafts at 35°, a full revolution by a cycloidal law; four revolutes through one point: three times redundant."""
    beta = np.radians(35)
    joints = cardan(beta)
    got, drive = angle_of(joints, "shaft2", joints["D"][4], 0.0)
    sin, cos, cb, sb = np.sin(drive[0]), np.cos(drive[0]), np.cos(beta), np.sin(beta)
    D = 1 - (sb * cos) ** 2
    value = np.unwrap(np.arctan2(sin, cb * cos))
    wanted = in_time((value, cb / D, -2 * cb * sb**2 * sin * cos / D**2), drive)
    return errors("driven shaft", got, wanted, "3 links, 4 revolutes")


@case("Bennett linkage", "G. T. Bennett, A new mechanism, Engineering 76 (1903): a/sin α = b/sin β, four skew revolutes")
def bennett_linkage() -> list[Row]:
    """a = 0.3 m, α = 40°, β = 75°: tan(θ1/2) tan(θ2/2) = sin((β+α)/2) / sin((β−α)/2); a full revolution,
    over-constrained."""
    t1 = 1.0
    joints, t2, K = bennett(np.radians(40), np.radians(75), t1)
    got, drive = angle_of(joints, "link2", joints["B"][4], t2, "link1")
    s, c = np.sin((t1 + drive[0]) / 2), np.cos((t1 + drive[0]) / 2)
    D = s**2 + (K * c) ** 2
    value = np.unwrap(2 * np.arctan2(K * c, s))
    wanted = in_time((value, -K / D, K * s * c * (1 - K**2) / D**2), drive)
    return errors("second joint angle", got, wanted, "3 links, 4 revolutes")


@case(
    "Bricard linkage, trihedral",
    "R. Bricard, Leçons de cinématique II (1927); Y. Chen, Z. You, T. Tarnai, Threefold-symmetric Bricard linkages for "
    "deployable structures, Int. J. Solids Structures 42 (2005) 2287: cos θ + cos φ + cos θ cos φ = 0 at twists of 90°",
)
def bricard() -> list[Row]:
    """Six skew revolutes, all lengths 0.3 m, twists ±90°; driven from θ = 0.6 rad by 1 rad, over-constrained."""
    t1, right = 0.6, np.pi / 2
    t2 = np.arccos(-np.cos(t1) / (1 + np.cos(t1)))
    joints = revolute_loop(np.full(6, 0.3), np.array([right, -right] * 3), np.array([t1, t2] * 3))
    got, drive = angle_of(joints, "link2", joints["B"][4], t2, "link1", law={**RISE, "angle": 1.0})
    s, c = np.sin(t1 + drive[0]), np.cos(t1 + drive[0])
    y = np.arccos(-c / (1 + c))
    sy, cy = np.sin(y), np.cos(y)
    rates = implicit(-s * (1 + cy), -sy * (1 + c), -c * (1 + cy), s * sy, -cy * (1 + c))
    return errors("second joint angle", got, in_time((y, *rates), drive), "5 links, 6 revolutes")


@case(
    "RSSR", "R. S. Hartenberg, J. Denavit, Kinematic Synthesis of Linkages (1964): constant distance of the ball centres"
)
def spatial_four_bar() -> list[Row]:
    """Crank 0.1 m about z, rocker 0.25 m about x; one ball is a universal joint, so that the coupler cannot rotate
    about itself."""
    drawn = 1.0
    crossed, universal = "4 links, 4 revolutes, a ball", "3 links, 2 revolutes, a ball, a universal joint"
    return [*_rocker_in_space(rssr(drawn), drawn, crossed), *_rocker_in_space(universal_rssr(drawn), drawn, universal)]


def _rocker_in_space(joints: JointTable, drawn: float, model: str) -> list[Row]:
    got, drive = angle_of(joints, "rocker", (1.0, 0.0, 0.0), drawn)
    phi, r = drive[0], RSSR_ROCKER
    length2 = ((np.subtract(*rssr_points(np.zeros(()), np.asarray(drawn)))) ** 2).sum()
    w = rssr_points(phi, phi)[0] - RSSR_PIVOT
    C = ((w**2).sum(axis=1) + r**2 - length2) / (2 * r)  # w_y cos ψ + w_z sin ψ = C
    mid, half = np.arctan2(w[:, 2], w[:, 1]), np.arccos(C / np.hypot(w[:, 1], w[:, 2]))
    psi = min((np.unwrap(mid + s * half) for s in (1, -1)), key=lambda y: abs(np.angle(np.exp(1j * (y[0] - drawn)))))
    psi = psi + 2 * np.pi * np.round((drawn - psi[0]) / (2 * np.pi))
    P, Q = rssr_points(phi, psi)
    zero = np.zeros_like(phi)
    P1, P2 = RSSR_CRANK * np.stack([-np.sin(phi), np.cos(phi), zero], axis=1), P * -1
    Q1, Q2 = r * np.stack([zero, -np.sin(psi), np.cos(psi)], axis=1), RSSR_PIVOT - Q

    def dot(x: np.ndarray, y: np.ndarray) -> np.ndarray:
        return np.einsum("tk,tk->t", x, y)

    d = P - Q
    rates = implicit(dot(d, P1), -dot(d, Q1), dot(P1, P1) + dot(d, P2), -dot(P1, Q1), dot(Q1, Q1) - dot(d, Q2))
    return errors("rocker angle", got, in_time((psi, *rates), drive), model)
