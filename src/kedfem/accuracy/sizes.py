"""Sizes, masses and speeds of a scene, and warnings where they are so unlikely that a unit may be wrong."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from kedfem.dynamics.model import Model
from kedfem.motion.joint_equations import joint_points
from kedfem.scene import ConstantSpeed, Ramp, Scene, driven_travel, percentage
from kedfem.scene.records.materials import LINE
from kedfem.scene.records.units import RPM

LENGTHS = 1e-4, 30.0  # m, of a link: watches, booms of cranes
MASSES = 1e-9, 1e6  # kg, of a link
MODULI = 1e6, 2e12  # Pa: soft rubber, diamond
DENSITIES = 10.0, 3e4  # kg/m³: foam, osmium
MATERIAL_LIMITS = (
    ("youngs_modulus", "Pa", MODULI, "softer than rubber (1e6)", "stiffer than diamond (1.2e12)",
     ((1e3, "MPa"), (0.0, "GPa"))),
    ("density", "kg/m^3", DENSITIES, "lighter than any foam", "heavier than any metal",
     ((1e-2, "g/cm^3"), (1e-7, "kg/mm^3"), (0.0, "t/mm^3"))),
)  # fmt: skip
"""Keys of materials: unit, range, words for values below and above it, and units that small values suggest."""
GRAVITY = 100.0  # m/s²
TURNS = 1e6  # rpm, above the speed of dental drills and turbochargers
WIDE = 3.0, 2.0  # largest width of a section, in lengths of its link and in m
TIP = 2000.0  # m/s at the end of a driven link, above what any material bears in a rotor
STRETCHED = 0.002  # strain of a long metal link by its own rotation; a helicopter's blade has 0.001
LONG = 3.0  # m, least length of such a link
METAL = 1e10  # Pa, least modulus of a metal
APART = 1e4  # largest ratio of the lengths of two links


@dataclass(frozen=True, slots=True)
class Sizes:
    """Sizes, masses and speeds of a scene, in SI.

    overall : largest extent of the linkage in the reference position [m]
    lengths : length of each link by name, except for sliders, which have no shape [m]
    masses : mass of each link by name [kg]
    moduli : Young's modulus of each material of elastic links [Pa]
    turns, speeds : final speeds of rotating and of sliding drives by name [rpm, m/s]
    """

    overall: float
    lengths: Mapping[str, float]
    masses: Mapping[str, float]
    moduli: Mapping[str, float]
    turns: Mapping[str, float]
    speeds: Mapping[str, float]


def sizes(scene: Scene, model: Model) -> Sizes:
    """The sizes of a scene and its model."""
    nodes: dict[str, list[np.ndarray]] = {}
    masses: dict[str, float] = {}
    for link in [*model.links, *(prescribed.link for prescribed in model.prescribed)]:
        if (of := scene.links[link.name]).shape or of.centre:  # a slider has only the points of its model
            nodes.setdefault(link.name, []).append((link.full or link).nodes)
        masses[link.name] = masses.get(link.name, 0.0) + float(link.one @ link.m1[:, 0])
    every = {name: np.concatenate(parts) for name, parts in nodes.items()}

    elastic = [link.material for link in scene.links.values() if link.model != "rigid" and link.material]
    motions = {name: drive.motion for name, drive in scene.all_drives.items()}
    final = {name: float(x.speed) for name, x in motions.items() if isinstance(x, ConstantSpeed | Ramp)}
    slides = {name for name in final if driven_travel(scene, name)}
    return Sizes(
        overall=float(np.ptp(np.concatenate([*every.values(), joint_points(scene)]), axis=0).max()),
        lengths={name: float(np.linalg.norm(np.ptp(X, axis=0))) for name, X in every.items()},
        masses={name: masses[name] for name in scene.links if name in masses},
        moduli={name: scene.materials[name].youngs_modulus for name in dict.fromkeys(elastic)},
        turns={name: speed * RPM for name, speed in final.items() if name not in slides},
        speeds={name: speed for name, speed in final.items() if name in slides},
    )


def size_warnings(scene: Scene, found: Sizes) -> tuple[str, ...]:
    """Warnings of sizes that no machine has, each with the unit that was probably intended."""
    lengths, others = _length_warnings(scene, found), _other_warnings(scene, found)
    return (*scene.unit_warnings, *lengths, *_material_warnings(scene), *others)


def _length_warnings(scene: Scene, found: Sizes) -> Iterator[str]:
    low, high = LENGTHS
    long = {name: x for name, x in found.lengths.items() if x > high}
    short = {name: x for name, x in found.lengths.items() if x < low}
    for names, what in ((long, "longer"), (short, "shorter")):
        if names:
            limit = high if names is long else low
            unit = "are lengths in mm? write '25 mm', or 0.025" if names is long else "are they in m?"
            sizes = " to ".join(f"{x:.4g}" for x in dict.fromkeys((min(names.values()), max(names.values()))))
            yield f"links.{', '.join(names)}: {sizes} m long, {what} than any machine's ({limit:g} m): {unit}"
    if found.lengths and not (long or short):
        a, b = (pick(found.lengths, key=found.lengths.__getitem__) for pick in (min, max))
        if found.lengths[b] > APART * found.lengths[a]:
            sizes = f"{found.lengths[a]:.4g} m long beside links.{b} of {found.lengths[b]:.4g} m"
            yield f"links.{a}: {sizes}: are all lengths in one unit?"
    for name, link in scene.links.items():
        points = getattr(link.shape, "between", None) or getattr(link.shape, "points", None)
        span = 0.0 if points is None else float(np.ptp(np.array(points), axis=0).max())
        for key in ("width", "thickness"):
            value = getattr(link.shape, key, None) or 0.0
            if span and name not in long and value > min(WIDE[0] * span, WIDE[1]):
                reason = f"{value:.4g} m for a link of {span:.4g} m: is it in mm? write '{value:.4g} mm'"
                yield f"links.{name}.shape.{key}: {reason}"


def _material_warnings(scene: Scene) -> Iterator[str]:
    every = {link.material for link in scene.links.values()}
    used = {name for name in every if name and not name.startswith(LINE)}
    for name, material in scene.materials.items():
        for key, unit, (low, high), below, above, meant in MATERIAL_LIMITS if name in used else ():
            value, where = getattr(material, key), f"materials.{name}.{key}"
            if value < low:
                other = next(each for least, each in meant if value >= least)
                yield f"{where}: {value:.4g} {unit} is {below}: is it in {other}? write '{value:.4g} {other}'"
            elif value > high:
                yield f"{where}: {value:.4g} {unit} is {above}: which unit is it in?"


def _other_warnings(scene: Scene, found: Sizes) -> Iterator[str]:
    low, high = MASSES
    suspicious = {name for name, x in found.lengths.items() if not LENGTHS[0] <= x <= LENGTHS[1]}
    for name, mass in found.masses.items():
        if name not in suspicious and mass and not low <= mass <= high:
            which = "lighter" if mass < low else "heavier"
            yield f"links.{name}: its mass is {mass:.4g} kg, {which} than any machine's: are its units right?"
    size = float(np.linalg.norm(scene.gravity))
    if size > GRAVITY:
        yield f"gravity: {size:.4g} m/s^2 is more than 10 g: is it in mm/s^2? write '{size:.4g} mm/s^2'"
    for name, turns in found.turns.items():
        if abs(turns) > TURNS:
            yield f"drive of joint {name}: {turns:.4g} rpm is faster than any machine's: which unit is it in?"
        joint = scene.joints[scene.all_drives[name].joint]
        links = [link for link in joint.links if link in found.lengths and link not in suspicious]
        tip = max((found.lengths[link] for link in links), default=0.0) * abs(turns) * np.pi / 30
        if tip > TIP:
            yield (
                f"drive of joint {name}: at {turns:.4g} rpm the end of links.{links[0]} moves at {tip:.4g} m/s, "
                "faster than any rotor's: are lengths and speed in their units?"
            )
        elif links and found.lengths[links[0]] > LONG and (strain := _spun(scene, links[0], tip)) > STRETCHED:
            yield (
                f"drive of joint {name}: at {turns:.4g} rpm the end of links.{links[0]} moves at {tip:.4g} m/s, and its "
                f"own inertia would stretch it by {percentage(strain)}, more than such large machines bear: "
                "are lengths in mm? write '25 mm', or 0.025"
            )


def _spun(scene: Scene, link: str, tip: float) -> float:
    """Strain at the root of a uniform metal bar that rotates about its end [-]; 0 for other materials."""
    material = scene.materials.get(scene.links[link].material or "")
    if material is None or material.youngs_modulus < METAL:
        return 0.0
    return material.density * tip**2 / (2 * material.youngs_modulus)
