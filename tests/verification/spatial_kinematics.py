"""Rigid linkages with slots, blocks, crosses and sleeves, against closed forms: see `kinematics`."""

from collections.abc import Callable, Sequence

import numpy as np

from tests.linkages import Z, body, linkage_scene, motion_at, place
from tests.spatial_linkages import (
    X,
    Y,
    double_cardan,
    inverted_slider_crank,
    offset_cardan,
    oldham,
    quick_return,
    universal_cardan,
)

from .cases import Row, case
from .kinematics import TURN, Curve, T, angle_of, errors, in_time

# central differences of order 8, e.g. Fornberg, Math. Comp. 51 (1988) 699, table 1
FIRST = np.array([1 / 280, -4 / 105, 1 / 5, -4 / 5, 0, 4 / 5, -1 / 5, 4 / 105, -1 / 280])
SECOND = np.array([-1 / 560, 8 / 315, -1 / 5, 8 / 5, -205 / 72, 8 / 5, -1 / 5, 8 / 315, -1 / 560])
H = 0.01  # rad: truncation H⁸ f⁽¹⁰⁾/3150 ~ 1e-13, rounding 1e-16/H² ~ 1e-12
BY_DIFFERENCES = 1e-10  # of the greatest value, where the closed form is differentiated so


def by_angle(f: Callable[[np.ndarray], np.ndarray], phi: np.ndarray) -> Curve:
    """A closed form at drive angles, with its two derivatives by differences of order 8."""
    y = np.array([f(phi + k * H) for k in range(-4, 5)])
    return y[4], np.tensordot(FIRST, y, 1) / H, np.tensordot(SECOND, y, 1) / H**2


def polar(z: np.ndarray, z1: np.ndarray, z2: np.ndarray) -> Curve:
    """Angle of a complex number that depends on the drive, and its derivatives: Im log z."""
    q = z1 / z
    return np.unwrap(np.angle(z)), q.imag, (z2 / z - q**2).imag


def swinging(r: float, d: float, drawn: float, block: bool, model: str) -> list[Row]:
    """Arm angle: that of the pin, z = i d + r exp(i φ), seen from the arm's pivot."""
    z0 = 1j * d + r * np.exp(1j * drawn)
    got, drive = angle_of(quick_return(r, d, drawn, block), "arm", Z, float(np.angle(z0)))
    z = r * np.exp(1j * (drawn + drive[0]))
    return errors("arm angle", got, in_time(polar(1j * d + z, 1j * z, -z), drive), model)


@case("Quick-return", "closed form of any textbook: the arm points at the crank's pin, tan θ = (d + r sin φ)/(r cos φ)")
def quick_returns() -> list[Row]:
    """Crank 0.1 m, pivots 0.25 m apart: the arm swings (shaper); 0.06 m apart: it revolves (Whitworth)."""
    return [
        *swinging(0.1, 0.25, 0.4, False, "shaper: 2 links, 2 revolutes, a slot"),
        *swinging(0.1, 0.25, 0.4, True, "shaper: 3 links, 3 revolutes, a block that slides on the arm"),
        *swinging(0.1, 0.06, 0.4, False, "Whitworth: 2 links, 2 revolutes, a slot"),
    ]


@case("Inverted slider-crank", "closed form of any textbook: the rod passes through the block's pivot at all times")
def rod_through_a_block() -> list[Row]:
    """Crank 0.1 m, pivots 0.3 m apart, reference position at 1.2 rad, a full revolution by a cycloidal law."""
    r, d, drawn = 0.1, 0.3, 1.2
    start = float(np.angle(d - r * np.exp(1j * drawn)))
    got, drive = angle_of(inverted_slider_crank(r, d, drawn), "rod", Z, start)
    z = r * np.exp(1j * (drawn + drive[0]))
    return errors("rod angle", got, in_time(polar(d - z, -1j * z, z), drive), "3 links, 3 revolutes, a slide")


def cardan_shaft(cosine: float, phi: np.ndarray) -> Curve:
    """tan φ2 = tan φ1 / cosine, continuous over all turns, and its derivatives by φ1."""
    sin, cos = np.sin(phi), np.cos(phi)
    D = 1 - (1 - cosine**2) * cos**2
    angle = phi + np.arctan2((1 - cosine) * sin * cos, cosine * cos**2 + sin**2)
    return angle, cosine / D, -2 * cosine * (1 - cosine**2) * sin * cos / D**2


@case("Cardan joint, a universal joint", "closed form of any textbook: tan φ2 = tan φ1 / cos β")
def one_universal_joint() -> list[Row]:
    """Shafts at 35° and at 80°, a full revolution by a cycloidal law."""
    rows = []
    for degrees in (35, 80):
        beta = np.radians(degrees)
        joints = universal_cardan(beta)
        got, drive = angle_of(joints, "shaft2", joints["D"][4], 0.0)
        wanted = in_time(cardan_shaft(np.cos(beta), drive[0]), drive)
        rows += errors("driven shaft", got, wanted, f"{degrees}°: 2 links, 2 revolutes, a universal joint")
    return rows


@case(
    "Double Cardan joint",
    "parallel shafts, forks of the middle shaft in line: constant velocity; crossed: tan φ3 = tan φ1 / cos² β",
)
def two_universal_joints() -> list[Row]:
    """Shafts at 35°; the middle one has no support but its two universal joints."""
    cb = np.cos(np.radians(35))
    rows = []
    for crossed, cosine in ((False, 1.0), (True, cb**2)):
        got, drive = angle_of(double_cardan(np.radians(35), crossed), "shaft2", X, 0.0)
        model = f"forks {'crossed' if crossed else 'in line'}: 3 links, 2 revolutes, 2 universal joints"
        rows += errors("driven shaft", got, in_time(cardan_shaft(cosine, drive[0]), drive), model)
    return rows


@case(
    "Oldham coupling",
    "closed form of any textbook: constant velocity; the disc's centre circles twice per revolution between the shafts",
)
def oldham_coupling() -> list[Row]:
    """Shafts 0.04 m apart, reference position at 0.5 rad; the disc slides on both, or on one flank of the second's
    groove."""
    e, drawn = 0.04, 0.5
    rows = []
    for tongue in ("prismatic", "planar"):
        joints = oldham(e, drawn, tongue)
        model = f"3 links, 2 revolutes, a slide, a {'second slide' if tongue == 'prismatic' else 'planar joint'}"
        got, drive = angle_of(joints, "shaft2", Z, drawn)
        rows += errors("driven shaft", got, in_time((drawn + drive[0], *np.outer([1, 0], np.ones_like(T))), drive), model)
        scene = linkage_scene(joints, motion=TURN)
        centre = place(motion_at(scene, T), body(scene, "disc"), np.asarray(joints["B"][3]))
        z = e * np.exp(2j * (drawn + drive[0])) / 2
        for name, part, middle in (("x", np.real, e / 2), ("y", np.imag, 0.0)):
            curve = in_time((part(z) + middle, part(2j * z), part(-4 * z)), drive)
            seen = tuple(q[:, "xy".index(name)] for q in centre)
            rows += errors(f"{name} of the disc's centre", seen, curve, model)
    return rows


def turning(axis: Sequence[float], angle: np.ndarray) -> np.ndarray:
    """Rotations (T, 3, 3) about a unit vector."""
    u = np.asarray(axis, float)
    W = np.cross(np.eye(3), u)
    s, c = np.sin(angle)[:, None, None], np.cos(angle)[:, None, None]
    return np.eye(3) + s * W + (1 - c) * (W @ W)


@case(
    "RCCC",
    "A. T. Yang, F. Freudenstein, Application of dual-number quaternion algebra to the analysis of spatial mechanisms, "
    "J. Appl. Mech. 31 (1964) 300: turns are those of the spherical linkage of the same twists; slides close the loop",
)
def revolute_and_three_cylinders() -> list[Row]:
    """A Cardan joint of 35° with offset axes: the shaft rotates as without the offset, and slides."""
    beta = np.radians(35)
    joints = offset_cardan(beta)
    out = np.asarray(joints["D"][4])
    got, drive = angle_of(joints, "shaft2", out, 0.0)
    model = "3 links, a revolute, 3 cylindrical joints"
    rows = errors("driven shaft", got, in_time(cardan_shaft(np.cos(beta), drive[0]), drive), model)
    A, B, C, D = (np.asarray(joints[k][3]) for k in "ABCD")
    y, z = np.array(Y), np.array(Z)

    def slide(phi: np.ndarray) -> np.ndarray:
        """Travel of the second shaft: the loop's vectors, three slides unknown."""
        R1, R3 = turning(X, phi), turning(out, cardan_shaft(np.cos(beta), phi)[0])
        y1, z3 = R1 @ y, R3 @ z
        R2 = np.stack([y1, z3, np.cross(y1, z3)], axis=2) @ np.stack([y, z, np.cross(y, z)])
        known = (D - A) - R1 @ (B - A) - R2 @ (C - B) - R3 @ (D - C)
        slides = np.stack([y1, z3, np.broadcast_to(-out, y1.shape)], axis=2)
        return np.asarray(np.linalg.solve(slides, known[..., None])[:, 2, 0])

    scene = linkage_scene(joints, motion=TURN)
    x, v, a = place(motion_at(scene, T), body(scene, "shaft2"), D)
    wanted = in_time(by_angle(slide, drive[0]), drive)
    return rows + errors("slide", ((x - D) @ out, v @ out, a @ out), wanted, model, BY_DIFFERENCES)
