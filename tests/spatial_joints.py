"""Mechanisms in space, one for each kind of joint: closed loops that no joint over-constrains, of beams and of solids."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import meshio
import numpy as np

from kedfem.links.record import Link
from tests.moving import beam_in_space, rising

Raw = dict[str, Any]
SHORT = {"end_time": 0.02, "step": 5e-4, "rho_inf": 0.8, "initial": "quasi-static"}
HERE, P, Q, G = (0.0, 0.0, 0.0), (0.12, 0.02, 0.03), (0.2, 0.2, 0.1), (0.45, 0.1, -0.05)
ALONG = np.subtract(G, Q).tolist()
ACROSS = [0.3, -0.2, 1.0]  # an axis along nothing else


def scene(links: Raw, joints: Raw, **more: Any) -> Raw:
    """With gravity askew, and a drive on the ground's hinge A."""
    motion = {"kind": "cycloidal", "angle": 0.3, "rise": 0.03}
    return {
        "links": links,
        "joints": joints,
        "drive": {"joint": "A", "motion": motion},
        "gravity": [2.0, -9.0, 3.0],
        "analysis": dict(SHORT),
        **more,
    }


def hinge(first: str, second: str, at: Any = HERE, axis: Any = (0, 0, 1)) -> Raw:
    return {"kind": "revolute", "links": [first, second], "at": list(at), "axis": list(axis)}


def ball(first: str, second: str, at: Any) -> Raw:
    return {"kind": "spherical", "links": [first, second], "at": list(at)}


def cross(first: str, second: str, at: Any, held: Any) -> Raw:
    """A cross whose axes are across a direction, so that it holds the turn about that one in the reference position."""
    n = np.array(held, float) / np.linalg.norm(held)
    a = np.cross(n, [0.2, 0.5, 0.9])
    a /= np.linalg.norm(a)
    return {"kind": "universal", "links": [first, second], "at": list(at), "axes": [a.tolist(), np.cross(n, a).tolist()]}


def loop(one: Raw, two: Raw, last: Raw) -> Raw:
    """A crank about A, a rod, and a rocker on the ground."""
    links = {"crank": beam_in_space(HERE, P, 2), "rod": beam_in_space(P, Q, 2), "rocker": beam_in_space(Q, G, 2)}
    return scene(links, {"A": hinge("ground", "crank"), "P": one, "J": two, "G": last})


def sliding(kind: str, **more: Any) -> Raw:
    """The rod slides on the rocker; what a cylindrical joint lets turn too, a universal joint on the crank holds."""
    axis = [1.0, -0.3, -0.5]
    on_crank = cross("crank", "rod", P, axis) if kind == "cylindrical" else ball("crank", "rod", P)
    two = {"kind": kind, "links": ["rod", "rocker"], "at": list(Q), "axis": axis, **more}
    return loop(on_crank, two, cross("rocker", "ground", G, ALONG))


def hinged() -> Raw:
    """Hinge, ball and weld between links that move."""
    two = hinge("crank", "rod", P, ACROSS)
    raw = loop(two, ball("rod", "rocker", Q), cross("rocker", "ground", G, ALONG))
    half = (0.5 * (np.array(P) + Q)).tolist()
    raw["links"] |= {"rod": beam_in_space(P, half, 2), "end": beam_in_space(half, Q, 2)}
    raw["joints"]["J"]["links"] = ["end", "rocker"]
    raw["joints"]["W"] = {"kind": "weld", "links": ["rod", "end"], "at": half}
    return raw


def slotted() -> Raw:
    """The crank's pin in a slot of an arm on a cross."""
    arm = beam_in_space(G, (2 * np.array(P) - 0.8 * np.array(G) - 0.2 * np.array(P)).tolist(), 8)
    axis = (np.array(G) - P).tolist()
    joints = {
        "A": hinge("ground", "crank"),
        "J": {"kind": "slot", "links": ["crank", "arm"], "at": list(P), "axis": axis},
        "G": cross("arm", "ground", G, axis),
    }
    return scene({"crank": beam_in_space(HERE, P, 2), "arm": arm}, joints)


def swash(**more: Any) -> Raw:
    """A shoe slides on a plate that turns askew, and moves a piston over a cross."""
    foot, head, end = [0.1, 0.0, 0.02], [0.1, 0.02, 0.1], [0.12, 0.0, 0.3]
    links = {
        "plate": beam_in_space(HERE, foot, 2),
        "shoe": beam_in_space(foot, head, 2, (1, 0, 0)),
        "piston": beam_in_space(head, end, 2, (1, 0, 0)),
    }
    joints = {
        "A": hinge("ground", "plate"),
        "J": {"kind": "planar", "links": ["shoe", "plate"], "at": foot, "axis": [0.2, 0.15, 1.0], **more},
        "U": cross("shoe", "piston", head, [0.1, 0.0, 1.0]),
        "G": {"kind": "prismatic", "links": ["piston", "ground"], "at": end, "axis": [0.1, 0.0, 1.0]},
    }
    return scene(links, joints)


def geared() -> Raw:
    """A bevel gear, and a rack on its second wheel."""
    away, rack = [0.0, 0.3, 0.1], [0.3, 0.3, 0.0]
    links = {
        "one": beam_in_space(HERE, P, 2),
        "two": beam_in_space(away, (0.1, 0.4, 0.1), 2),
        "rack": beam_in_space(rack, (0.4, 0.5, 0.1), 2),
    }
    joints = {
        "A": hinge("ground", "one"),
        "B": hinge("two", "ground", away, (0.2, 1.0, 0.3)),
        "J": {"kind": "prismatic", "links": ["rack", "ground"], "at": rack, "axis": [1.0, 0.1, 0.4]},
    }
    gears = {"bevel": {"joints": ["A", "B"], "ratio": -1.5}, "rack": {"joints": ["B", "J"], "radius": 0.08}}
    raw = scene(links, joints, gears=gears)
    raw["drive"]["shaft_stiffness"] = 500.0  # so that what the drive leads turns elastically too
    return raw


def robot() -> Raw:
    """An arm with a driven hinge and a driven slide, both between links that move."""
    links = {"base": beam_in_space(HERE, P, 2), "arm": beam_in_space(P, Q, 2), "hand": beam_in_space(Q, G, 2)}
    joints = {
        "A": hinge("ground", "base"),
        "J": hinge("base", "arm", P, ACROSS),
        "K": {"kind": "prismatic", "links": ["hand", "arm"], "at": list(Q), "axis": [1.0, 0.4, 0.2]},
    }
    raw = scene(links, joints)
    drives = {"a": raw.pop("drive"), "b": {"joint": "J", "motion": rising(-1.0)}}
    return {**raw, "drives": drives | {"c": {"joint": "K", "motion": rising(0.05, "travel")}}}


def rigid_in_space(a: Any, b: Any) -> Raw:
    """A rod of round section that does not bend."""
    return {key: x for key, x in beam_in_space(a, b, 2).items() if key != "beam"} | {"model": "rigid"}


def pushed(driven: bool, rod: str = "beam") -> Raw:
    """A ram of mass alone on a guide of the ground, and a rocker: the one moves the other over a rod."""
    links = {
        "ram": {"model": "rigid", "mass": 0.5},
        "rod": beam_in_space(P, Q, 2) if rod == "beam" else rigid_in_space(P, Q),
        "rocker": beam_in_space(Q, G, 2),
    }
    joints = {
        "A": {"kind": "prismatic", "links": ["ram", "ground"], "at": list(P), "axis": [0.0, 0.0, 1.0]},
        "P": ball("ram", "rod", P),
        "J": cross("rod", "rocker", Q, ACROSS),
        "G": hinge("ground", "rocker", G, (1.0, 0.0, 0.0)),
    }
    raw = scene(links, joints)
    travel = {"joint": "A", "motion": rising(0.03, "travel")}
    turn = {"joint": "G", "motion": {"kind": "cycloidal", "angle": 0.2, "rise": 0.03}}
    return {**raw, "drive": travel if driven else turn}


def bushed() -> Raw:
    """Slide, cross and hinge in bushings that are the same in all directions."""
    bushing = {"stiffness": 1e6, "damping": 300.0, "rotational_stiffness": 2e3, "rotational_damping": 0.3}
    raw = sliding("prismatic", bushing=bushing)
    raw["joints"]["G"]["bushing"] = bushing
    raw["joints"]["P"]["bushing"] = {"stiffness": 2e6}
    return raw


BEAMS: dict[str, Callable[[], Raw]] = {
    "revolute, spherical, weld": hinged,
    "universal": lambda: loop(
        ball("crank", "rod", P), cross("rod", "rocker", Q, ACROSS), hinge("rocker", "ground", G, ACROSS)
    ),
    "prismatic": lambda: sliding("prismatic"),
    "cylindrical": lambda: sliding("cylindrical"),
    "screw": lambda: sliding("screw", lead=0.5),
    "planar, prismatic on the ground": swash,
    "slot": slotted,
    "gears, rack": geared,
    "driven hinge and slide": robot,
    "bushings": bushed,
}
SLIDERS: dict[str, Callable[[], Raw]] = {
    "driven slider without a shape": lambda: pushed(driven=True),
    "slider without a shape": lambda: pushed(driven=False),
    "driven slider without a shape on a rigid rod": lambda: pushed(driven=True, rod="rigid"),
}


def plate(a: Sequence[float], b: Sequence[float], thickness: float = 0.02) -> Raw:
    """A bar with a bore at each end."""
    start, end, width = np.array(a), np.array(b), 0.02
    d = width * (end - start) / np.linalg.norm(end - start)
    n = np.array([-d[1], d[0], 0.0])
    corners = [start - d - n, end + d - n, end + d + n, start - d + n]
    shape = {
        "kind": "extrusion",
        "outline": [c.tolist() for c in corners],
        "holes": [{"at": list(a), "diameter": 0.015}, {"at": list(b), "diameter": 0.015}],
        "thickness": thickness,
    }
    return {"model": "solid", "material": "steel", "shape": shape, "mesh": {"size": 0.02}}


def bored(kind: str) -> Raw:
    """A four-bar of solids one of whose pins lets its bore slide; or a block that slides on an arm by its bore's axis."""
    D, B = (0.25, 0.15, 0.0), (0.3, 0.0, 0.0)
    C = (0.1, 0.0, 0.0)
    links = {"crank": plate(HERE, C), "rod": plate(C, D), "rocker": plate(D, B)}
    joints = {"A": hinge("ground", "crank"), "B": hinge("ground", "rocker", B)}
    if kind == "cylindrical":
        joints["J"] = {"kind": "cylindrical", "links": ["crank", "rod"], "at": list(C), "axis": [0, 0, 1]}
        joints["D"] = ball("rod", "rocker", D) | {"axis": [0, 0, 1]}
    else:
        joints["C"] = hinge("crank", "rod", C)
        axis = (np.array(D) - B).tolist()
        joints["J"] = {"kind": "prismatic", "links": ["rod", "rocker"], "at": list(D), "axis": axis}
    return scene(links, joints)


SOLIDS: dict[str, Callable[[], Raw]] = {
    "cylindrical, bores": lambda: bored("cylindrical"),
    "prismatic, bores": lambda: bored("prismatic"),
}


def as_mesh_files(raw: Raw, drawn: Sequence[Link], folder: Path, R: np.ndarray, shift: np.ndarray) -> Raw:
    """A turned and shifted scene with its solids, undeformed, in mesh files: all other shapes of solids lie along z."""
    links = {}
    for link in drawn:
        file = folder / f"{link.name}.vtu"
        meshio.Mesh(link.X @ R.T + shift, [("hexahedron20", link.cells)]).write(file)
        shape = {"kind": "mesh", "file": str(file)}
        links[link.name] = {"model": "solid", "material": "steel", "shape": shape}
    return {**raw, "links": links}
