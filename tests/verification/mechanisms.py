"""Mechanisms: the source's four-bar converging, beams against solids, and links that become rigid."""

import tomllib
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np

from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.rigid_body import drive_range
from kedfem.dynamics.stepping.solvers import steps_of
from kedfem.dynamics.stepping.transient import transient
from kedfem.motion.linkage import linkage
from kedfem.motion.path import path
from kedfem.results.recording import recording
from kedfem.scene import Scene, read_scene, scene_from

from .cases import Row, case

SCENE = Path(__file__).parents[2] / "examples" / "four_bar_beams" / "scene.toml"
KED = "[KED]'s worked example, from Nath and Ghosh (1980)"
STRESS = "probes/rocker_outer/stress"


def four_bar(analysis: dict[str, Any], link: dict[str, Any], **changes: Any) -> Scene:
    """The example's scene with other analysis keys and other keys of every link."""
    raw = tomllib.loads(SCENE.read_text(encoding="utf-8"))
    raw["analysis"] = {"initial": "quasi-static", **analysis}
    for each in raw["links"].values():
        each.update(link)
    if link.get("model") == "solid":
        for each in raw["links"].values():
            each["element"] = "hex27"
    return scene_from(raw | changes, SCENE.parent)


def histories(scene: Scene, *names: str) -> tuple[int, list[np.ndarray]]:
    """Generalised coordinates, and channels over time (steps + 1, columns)."""
    joined = linkage(scene)
    along = path(joined, *drive_range(scene))
    model = elastic_model(scene, joined)
    rows = {each.channel.name: each.rows for each in recording(scene, model)}
    blocks = transient(scene, joined, along, model, steps_of(scene, model))
    values = [[rows[name](block) for name in names] for block in blocks]
    return model.coordinates, [np.concatenate(column) for column in zip(*values, strict=True)]


@cache
def stress(elements: int, steps_per_revolution: int, revolutions: float = 2.0) -> np.ndarray:
    """σ on the rocker's outer side at 720 points a revolution, 3-node beams [MPa]."""
    scene = four_bar(
        {"revolutions": revolutions, "steps_per_revolution": steps_per_revolution}, {"mesh": {"elements": elements}}
    )
    return histories(scene, STRESS)[1][0][:: steps_per_revolution // 720, 0] / 1e6


def difference(a: np.ndarray, b: np.ndarray) -> float:
    """Largest difference of two curves, of the second's peak."""
    return float(np.abs(a - b).max() / np.abs(b).max())


@case("Source's four-bar: generalised coordinates", KED)
def coordinates() -> list[Row]:
    """One 3-node beam per link: 27 − 2·2 at the pins B, C − 3 at the driven root − 2 at D."""
    scene = read_scene(SCENE)
    return [Row("generalised coordinates", 18, elastic_model(scene, linkage(scene)).coordinates, 0.0, "1 beam3 a link")]


@cache
def space_errors() -> dict[int, float]:
    """Error of the stress curve for elements a link, against 32, all at 720 steps a revolution."""
    return {n: difference(stress(n, 720), stress(32, 720)) for n in (1, 2, 4, 8, 16)}


@cache
def time_errors() -> dict[int, float]:
    """Error of the stress curve for steps a revolution, against 11520, all with 8 elements a link."""
    return {n: difference(stress(8, n), stress(8, 11520)) for n in (720, 1440, 2880)}


@case("Source's four-bar: stress curve, elements", "against 32 elements per link, 720 steps per revolution, same start")
def elements() -> list[Row]:
    """Bending stress on the rocker's outer side over two revolutions at 600 rpm; largest difference, relative to the
    peak."""
    caps = {1: 0.8, 2: 0.6, 4: 0.05, 8: 0.0035, 16: 0.00025}
    return [Row("difference / peak", 0.0, e, caps[n], f"{n} beam3 a link") for n, e in space_errors().items()]


@case(
    "Source's four-bar: stress curve, steps",
    "against 11520 steps per revolution, 8 elements per link, same start",
    long=True,
)
def steps() -> list[Row]:
    """The same stress, with fewer steps."""
    caps = {720: 0.05, 1440: 0.0125, 2880: 0.003}
    return [Row("difference / peak", 0.0, e, caps[n], f"{n} steps a revolution") for n, e in time_errors().items()]


@case("Four-bar: solids against beams", "16 beam3 per link against bars of hex27, one revolution at 600 rpm", long=True)
def solids() -> list[Row]:
    """Section 25.4 mm square, links 12 to 36 times as long. The differences are those of beam theory (plane sections,
    5/6 of the area in shear), of hinges that constrain the mean of an end face, and of the mesh. Frequencies differ
    by parts of a percent, and the difference between the curves grows with the revolutions."""
    scene = four_bar(
        {"revolutions": 1, "steps_per_revolution": 720}, {"model": "solid", "mesh": {"elements": [16, 2, 1]}}
    )
    _, (curve,) = histories(scene, STRESS)
    error = difference(curve[:, 0] / 1e6, stress(16, 720)[:721])
    return [Row("difference / peak stress", 0.0, error, 0.025, "16×2×1 a link")]


@cache
def rigid_errors() -> dict[int, float]:
    """rms difference of the drive's torque from the rigid linkage's, for multiples of Young's modulus; 60 rpm."""
    found = {}
    for factor in (1, 4, 16):
        alloy = {"density": 2796, "youngs_modulus": factor * 7.031e10, "shear_modulus": factor * 2.712e10}
        drive = {"joint": "A", "motion": {"kind": "constant_speed", "speed": "60 rpm"}}
        analysis = {"revolutions": 0.5, "steps_per_revolution": 720}
        scene = four_bar(analysis, {"mesh": {"elements": 4}}, materials={"alloy": alloy}, drive=drive)
        _, (torque, rigid) = histories(scene, "drive/torque", "drive/rigid_torque")
        found[factor] = float(np.sqrt(np.mean((torque - rigid) ** 2) / np.mean(rigid**2)))
    return found


@case("Four-bar: E → ∞, drive torque", "virtual work of the rigid linkage; half a revolution at 60 rpm")
def rigid_limit() -> list[Row]:
    """rms difference falls as 1/E."""
    caps = {1: 8e-3, 4: 2e-3, 16: 4e-4}
    return [Row("difference / rms", 0.0, e, caps[n], f"E × {n}, 4 beam3 a link") for n, e in rigid_errors().items()]
