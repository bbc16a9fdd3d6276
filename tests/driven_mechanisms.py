"""Laws of random driven mechanisms of all kinds of links, joints, drives and force elements (`tests.random_scenes`)."""

import copy
from collections.abc import Callable
from typing import Any
from unittest.mock import patch

import numpy as np
from scipy.spatial.transform import Rotation

from kedfem.accuracy.prepared import moving
from kedfem.errors import KedfemError, MeshError, MotionError
from kedfem.links.beams import metric
from kedfem.scene import scene_from
from tests.cells import as_a_run
from tests.moving import channels, ran, turned
from tests.random_scenes import by_other_coordinates, driven
from tests.systems import against_oracle, begun

Raw = dict[str, Any]
Found = tuple[str, dict[str, float]]
STEPS, STEP = 20, 2e-4
STIFFER, TEN, LIMIT = 3.0, 10.0, 1e-3
LEAST, SPEED = 1e-12, 0.1  # N, N m; rad/s, m/s of coordinates: what is less is rounding
ARM, PINNED = 0.15, 1e-6  # m, the length of a link; of what forces do by it, moments of joints that bear none: rounding
PLACED = 1e-10  # m: displacements that are all less, as of points on the ground, are that of places, 1e-15 m
WITHIN = 1e-7  # of the peak: what iterations leave
ALIKE = 5e-5  # of the largest: what the monolithic step's rounding leaves of stiff hubs' forces, and iterations of laws
#: drawn at random, some lock, or have a slot too short, or one that turns too far
NO_MECHANISM = (MotionError, MeshError)
FRAMES = ("rigid-body", "co-rotational")
SOFT, HUBS = (0.01, 0.1), 3e-4  # of steel; of the largest
CLOSED = 1e-6  # of the largest energy: what closes anyhow


def stiffer(raw: Raw, factor: float) -> Raw:
    """A scene whose elastic links and bushings are stiffer by a factor; not its springs, which act as they do."""
    raw = copy.deepcopy(raw)
    for link in raw["links"].values():
        link["material"] = "steel" if link["model"] == "rigid" else "elastic"
    raw["materials"] = {"elastic": {"youngs_modulus": 2.1e11 * factor, "poisson_ratio": 0.3, "density": 7850.0}}
    for each in raw["joints"].values():
        if "bushing" in each:
            each["bushing"] = {key: x * factor for key, x in each["bushing"].items()}
    return raw


def off_rigid(raw: Raw) -> dict[str, float]:
    """How far forces and moments of joints, and efforts of drives, are from rigid inverse dynamics, of the largest."""
    got = channels(*ran(raw))
    pairs = {}
    for name, elastic in got.items():
        head, _, what = name.rpartition("/")
        rigid = got.get(f"{head}/rigid_{what}")
        if rigid is not None and rigid.shape == elastic.shape:
            pairs[name] = elastic, rigid
    unit = {name: 1.0 if name.endswith("force") else ARM for name in pairs}
    largest = max((float(np.abs(rigid).max()) / unit[name] for name, (_, rigid) in pairs.items()), default=1.0)
    return {name: float(np.abs(e - r).max()) / unit[name] / largest for name, (e, r) in pairs.items()}


def limit(raw: Raw) -> dict[str, float]:
    """How far a driven mechanism of nearly rigid links is from the forces of rigid ones, of what is allowed.

    Two independent ways: multipliers of the rigid linkage's equations, and the balance of elastic links. Where they are
    not within LIMIT, a stiffness ten times as high must bring them nearer, five times at least.
    """
    found = off_rigid(stiffer(raw, STIFFER))
    if all(x < LIMIT for x in found.values()):
        return {name: x / LIMIT for name, x in found.items()}
    again = off_rigid(stiffer(raw, TEN * STIFFER))
    return {name: x / (2 * max(found[name], LIMIT) / TEN) for name, x in again.items()}


def by_both_solvers(raw: Raw) -> dict[str, float]:
    """How far a vibrating mechanism is from the monolithic solver, which is refused with limits."""
    raw = raw | {"limits": {}}
    got, other = (recorded(raw, solver=solver) for solver in ("condensed", "monolithic"))
    return {name: x / ALIKE for name, x in differences(got, other).items() if not name.startswith("energy/")}


def by_march_and_oracle(raw: Raw) -> dict[str, float]:
    """How far a mechanism that starts from rest is from the oracle.

    Where a motor's force rises with its speed, or a limit is met, a step may have several solutions.
    """
    analysis = {"kind": "transient", "initial": "rest", "end_time": 3 * STEP, "step": STEP}
    of = as_a_run(begun(raw | {"analysis": raw["analysis"] | analysis}))
    return {"monolithic": against_oracle(of, 3, keeps=True) / WITHIN}


def when_turned(raw: Raw) -> dict[str, float]:
    """How far a mechanism is from itself when all of it is turned and shifted, in its plane if it has one."""
    plane = any(len(p) == 2 for link in raw["links"].values() for p in link["shape"].get("between", ()))
    R = Rotation.from_rotvec([0.0, 0.0, 0.8] if plane else [0.7, -1.1, 0.4]).as_matrix()
    shift = np.array([0.3, -0.2, 0.0 if plane else 0.5])
    got, other = recorded(raw), recorded(turned(raw, R, shift))
    back = {
        name: x @ R[: x.shape[1], : x.shape[1]] if x.shape[1] in {2, 3} and "energy" not in name else x
        for name, x in other.items()
    }
    return {name: x / ALIKE for name, x in differences(back, got).items()}


def energy(raw: Raw) -> dict[str, float]:
    """How far the account of energy is from closing, of a third of what it misses with steps twice as long.

    From a quasi-static start, as steps cannot resolve what loads that act at once excite of short links. No stops,
    which steps meet at another time each.
    """
    raw = {**raw, "limits": {}}
    rough, fine = (recorded(raw, n, initial="quasi-static") for n in (1, 2))
    scale = max(float(np.abs(fine[f"energy/{name}"]).max()) for name in ("kinetic", "strain", "work"))
    missing, other = (float(np.abs(x["energy/residual"]).max()) / scale for x in (rough, fine))
    return {"energy": other / max(missing / 3, CLOSED)}


def with_small_deflections(raw: Raw) -> dict[str, float]:
    """How far co-rotational from rigid-body frames are, of a fifth of what they are with links ten times as soft.

    At least HUBS: as hubs are stiff, not rigid, and not as stiff in both. Where they are further apart, it must be by
    hubs of co-rotational beams, which give up to 1/RIGID_NODE_STIFF of what one element does, and go as these
    are stiffer.
    """

    def apart() -> dict[str, float]:
        soft, stiff = (between_frames(stiffer(raw, factor)) for factor in SOFT)
        return {name: x / max(soft[name] / 5, HUBS) for name, x in stiff.items()}

    found = apart()
    if all(x < 1 for x in found.values()):
        return found
    with patch.object(metric, "RIGID_NODE_STIFF", 100 * metric.RIGID_NODE_STIFF):
        return apart()


def between_frames(raw: Raw) -> dict[str, float]:
    """How far displacements, forces and moments in quasi-static positions are apart with co-rotational frames."""
    got, other = (channels(*ran({**raw, "analysis": raw["analysis"] | {"frames": frames}})) for frames in FRAMES)
    return {name: x for name, x in differences(got, other).items() if _kind(name) in {"displacement", "force", "moment"}}


LAWS: dict[str, Callable[[Raw], dict[str, float]]] = {
    "rigid": limit,
    "solvers": by_both_solvers,
    "monolithic": by_march_and_oracle,
    "turned": when_turned,
    "energy": energy,
    "frames": with_small_deflections,
}
"""Each shows how far a mechanism is from it, of what is allowed: less than one is fine."""
STANDING = {"rigid", "frames"}
"""Laws of quasi-static positions."""


def tried(law: str, seed: int, frames: str = "rigid-body", most: int = 6, elsewhere: bool = False) -> Found:
    """What becomes of one mechanism by one law: fine, differs, no mechanism, or refused; and how far it is from it.

    Parameters
    ----------
    elsewhere : whether drives, gears and laws are on coordinates of the joints in its loops
    """
    raw = driven(seed, most, frames)
    if elsewhere:
        raw = by_other_coordinates(raw, seed)
    if law not in {*STANDING, "monolithic"}:
        raw = varied(raw, seed)
    try:
        moving(scene_from(raw))
        found = LAWS[law](raw)
    except NO_MECHANISM:
        return "no mechanism", {}
    except KedfemError as error:
        return f"refused: {error}", {}
    return "fine" if all(x < 1 for x in found.values()) else "differs", found


def recorded(raw: Raw, finer: int = 1, **analysis: Any) -> dict[str, np.ndarray]:
    """All channels of some steps."""
    times = {"kind": "transient", "end_time": STEPS * STEP, "step": STEP / finer}
    return channels(*ran({**raw, "analysis": raw["analysis"] | times | analysis}))


def differences(got: dict[str, np.ndarray], other: dict[str, np.ndarray]) -> dict[str, float]:
    """How far channels are apart, of the largest of their kind."""
    sizes: dict[str, float] = {}
    floors = {"speed": SPEED, "displacement": PLACED}
    for name, values in other.items():
        sizes[_kind(name)] = max(sizes.get(_kind(name), 0.0), float(np.abs(values).max(initial=0.0)))
    floors["moment"] = max(LEAST, PINNED * ARM * sizes.get("force", 0.0))
    return {
        name: float(np.abs(values - other[name]).max(initial=0.0))
        / max(sizes[_kind(name)], floors.get(_kind(name), LEAST))
        for name, values in got.items()
    }


def varied(raw: Raw, seed: int) -> Raw:
    """A scene with damping, start, numerical damping and stiffening at random."""
    random, analysis = np.random.default_rng(seed + 1_000_000), {}
    if random.random() < 0.5:
        alpha, beta = float(random.uniform(0, 5)), float(10 ** random.uniform(-6, -4))
        raw = raw | {"damping": {"alpha": alpha, "beta": beta}}
    analysis["initial"] = "quasi-static" if random.random() < 0.4 else "rest"
    analysis["rho_inf"] = float(random.choice([0.3, 0.8, 0.9]))
    if random.random() < 0.2 and raw["analysis"]["frames"] == "rigid-body":
        analysis["stiffening"] = True
    return raw | {"analysis": raw["analysis"] | analysis}


def _kind(name: str) -> str:
    """What channels are measured by: force, moment, displacement, energy …"""
    if name.startswith("energy/"):
        return "energy"
    return name.rpartition("/")[2].removeprefix("rigid_").replace("torque", "moment")
