"""Linkages with slots, blocks, crosses and sleeves, as tables of joints: see `linkages`."""

from typing import Any

import numpy as np

from tests.linkages import Z, cardan, rssr, spatial_slider_crank

Joints = dict[str, tuple[Any, ...]]
X, Y = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0)
OUT = 0.3  # Cardan shafts: from joint to joint [m]


def quick_return(r: float, d: float, angle: float, block: bool = False) -> Joints:
    """Crank r about (0, d), arm about the origin [m]; a pin of the crank slides in the arm, or a block on it."""
    pin = np.array([r * np.cos(angle), d + r * np.sin(angle), 0.0])
    along = pin / np.linalg.norm(pin)
    slide: Joints = {"B": ("slot", "crank", "arm", pin, along)}
    if block:
        slide = {"B": ("revolute", "crank", "block", pin, Z), "C": ("prismatic", "block", "arm", pin, along)}
    return {
        "A": ("revolute", "ground", "crank", (0.0, d, 0.0), Z),
        **slide,
        "D": ("revolute", "arm", "ground", np.zeros(3), Z),
    }


def inverted_slider_crank(r: float, d: float, angle: float) -> Joints:
    """Crank r about the origin; its rod slides through a block that swings about (d, 0) [m]."""
    pin, pivot = np.array([r * np.cos(angle), r * np.sin(angle), 0.0]), np.array([d, 0.0, 0.0])
    return {
        "A": ("revolute", "ground", "crank", np.zeros(3), Z),
        "B": ("revolute", "crank", "rod", pin, Z),
        "C": ("prismatic", "rod", "block", pivot, (pivot - pin) / np.linalg.norm(pivot - pin)),
        "D": ("revolute", "block", "ground", pivot, Z),
    }


def universal_cardan(beta: float) -> Joints:
    """`cardan` with one universal joint instead of the cross and its two hinges."""
    hinged = cardan(beta)
    return {"A": hinged["A"], "U": ("universal", "shaft1", "shaft2", np.zeros(3), (Y, Z)), "D": hinged["D"]}


def double_cardan(beta: float, crossed: bool = False) -> Joints:
    """Two parallel shafts along x and one between them at β, in the xy plane; its forks in line, or crossed."""
    along = np.array([np.cos(beta), np.sin(beta), 0.0])
    aside = (-np.sin(beta), np.cos(beta), 0.0)
    end = OUT * along
    return {
        "A": ("revolute", "ground", "shaft1", -0.2 * np.array(X), X),
        "U": ("universal", "shaft1", "middle", np.zeros(3), (Y, Z)),
        "V": ("universal", "middle", "shaft2", end, (aside, Z) if crossed else (Z, Y)),
        "D": ("revolute", "shaft2", "ground", end + 0.2 * np.array(X), X),
    }


def oldham(e: float, angle: float, tongue: str = "prismatic") -> Joints:
    """Parallel shafts at (0, 0) and (e, 0) [m]; the disc slides on both, at right angles, drawn at an angle.

    tongue : joint of disc and second shaft: prismatic, or planar (one flank of its groove alone)
    """
    one, other = (np.array([np.cos(x), np.sin(x), 0.0]) for x in (angle, angle + np.pi / 2))
    centre = e * np.cos(angle) * one
    return {
        "A": ("revolute", "ground", "shaft1", np.zeros(3), Z),
        "B": ("prismatic", "shaft1", "disc", centre, one),
        "C": (tongue, "disc", "shaft2", centre, other if tongue == "prismatic" else one),
        "D": ("revolute", "shaft2", "ground", (e, 0.0, 0.1), Z),
    }


def offset_cardan(beta: float) -> Joints:
    """RCCC: the axes of a Cardan joint moved apart, none of them meeting; sleeves that also slide instead of hinges."""
    out = (np.cos(beta), np.sin(beta), 0.0)
    return {
        "A": ("revolute", "ground", "shaft1", (-0.2, 0.0, 0.0), X),
        "B": ("cylindrical", "shaft1", "cross", (0.03, 0.05, 0.02), Y),
        "C": ("cylindrical", "cross", "shaft2", (-0.02, 0.04, 0.07), Z),
        "D": ("cylindrical", "shaft2", "ground", (0.2, 0.1, -0.05), out),
    }


def universal_slider_crank(angle: float) -> Joints:
    """`spatial_slider_crank` with a universal joint instead of the cross at the slider."""
    hinged = spatial_slider_crank(angle)
    C, across = hinged["C1"][3:]
    return {
        **{name: hinged[name] for name in ("A", "B", "guide")},
        "C": ("universal", "rod", "slider", C, (across / np.linalg.norm(across), Y)),
    }


def universal_rssr(psi: float) -> Joints:
    """`rssr` with a universal joint instead of the cross at the rocker."""
    hinged = rssr(psi)
    C, arm = hinged["C1"][3:]
    other = hinged["C2"][4]
    return {**{name: hinged[name] for name in "ABD"}, "C": ("universal", "coupler", "rocker", C, (arm, other))}
