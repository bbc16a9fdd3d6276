"""Random mechanisms: trees of 2 to 12 bodies in space, on the ground or free, without a drive; driven ones of all kinds.

``python -m tests.mechanisms --count 2000`` tries as many of the first, with ``--driven rigid-body`` or ``co-rotational``
of the others (`tests.random_scenes`), with ``--solvers`` of these by two solvers; ``--first SEED --count 1`` one of
them again.
"""

import argparse
import copy
import signal
import sys
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from kedfem.accuracy.prepared import moving
from kedfem.errors import KedfemError, MeshError, MotionError, SolveError
from kedfem.scene import scene_from
from tests.cells import apart, as_a_run, run_of
from tests.moving import beam_in_space, channels, ran, turned
from tests.partners import joint
from tests.random_scenes import driven
from tests.spatial_joints import rigid_in_space
from tests.systems import Begun, against_oracle, begun, by_oracle, marched, rows

Raw = dict[str, Any]
KINDS = ("revolute", "spherical", "universal", "prismatic", "cylindrical", "screw", "weld", "planar")
STEPS, STEP = 3, 2e-4


def mechanism(seed: int, most: int = 12) -> Raw:
    """Beams in space and rigid rods, each jointed to an earlier one or to the ground, under gravity and forces."""
    random = np.random.default_rng(seed)
    count, free = int(random.integers(2, most + 1)), bool(random.random() < 0.3)
    links: Raw = {}
    joints: Raw = {}
    ends: dict[str, np.ndarray] = {"ground": np.zeros(3)}
    for k in range(count):
        name = f"link{k}"
        other = "ground" if not k else f"link{int(random.integers(0, k))}"
        a = ends[other]
        step = random.normal(size=3)
        b = a + step / np.linalg.norm(step) * random.uniform(0.08, 0.2)
        made = rigid_in_space if k and random.random() < 0.3 else beam_in_space
        links[name], ends[name] = made(a.tolist(), b.tolist(), 1) if made is beam_in_space else made(a, b), b
        if k or not free:
            kind = str(random.choice(KINDS))
            joints[f"J{k}"] = as_lists(joint(kind, (name, other), a, random.normal(size=3)))
    if free:
        spin, at = (2 * random.normal(size=3)).tolist(), [0.0, 0.0, 0.0]
        start: Raw = {"initial_motions": {name: {"at": at, "angular_velocity": spin} for name in links}}
    else:
        start = {"initial_speeds": {"J0": 2.0}} if joints["J0"]["kind"] in {"revolute", "cylindrical"} else {}
        if joints["J0"]["kind"] != "weld" and random.random() < 0.3:
            last = f"link{count - 1}"
            joints["closing"] = as_lists(joint("spherical", (last, "ground"), ends[last], np.zeros(3)))
    gravity = [0.0, 0.0, 0.0] if free else (5 * random.normal(size=3)).tolist()
    analysis = {"end_time": STEPS * STEP, "step": STEP, "rho_inf": 0.8, "initial": "rest", **start}
    return {"links": links, "joints": joints, "gravity": gravity, "analysis": analysis}


def as_lists(made: Raw) -> Raw:
    return {key: np.asarray(x).tolist() if key in {"at", "axis", "axes"} else x for key, x in made.items()}


def stepped(raw: Raw) -> tuple[Begun, np.ndarray, np.ndarray]:
    """A scene with displacements and rates (T, N) of its steps."""
    of = as_a_run(begun(raw))
    history = marched(of, STEPS)[1]
    return of, rows(of.ready, history.u), rows(of.ready, history.v)


def of_beams(of: Begun, x: np.ndarray) -> np.ndarray:
    """Rows (T, n, 3) of all beams; those of rigid links are a field's gradient too, which turns from both sides."""
    links = of.ready.system.model.links
    parts = np.split(x, np.cumsum([link.unknowns for link in links])[:-1], axis=1)
    kept = [part.reshape(len(x), -1, 3) for part, link in zip(parts, links, strict=True) if not link.rigid]
    return np.concatenate(kept, axis=1)


def momentum(of: Begun, v: np.ndarray) -> float:
    """Largest change of the sum of m v from the first step on, of the bodies' own."""
    links = of.ready.system.model.links
    parts = np.split(v, np.cumsum([link.unknowns for link in links])[:-1], axis=1)
    each = [
        np.einsum("n,tnd->td", link.m1[:, 0], part.reshape(len(v), -1, 3))
        for part, link in zip(parts, links, strict=True)
    ]
    total = np.sum(each, axis=0)
    return float(np.abs(total - total[0]).max() / np.abs(each).max())


def checked(seed: int, most: int = 12) -> dict[str, float]:
    """How far a mechanism is from each law, of the peak."""
    raw = mechanism(seed, most)
    of, u, v = stepped(raw)
    found = {"monolithic": apart(u, by_oracle(of, STEPS, keeps=True)[0])}
    if not any(link["fidelity"] == "rigid" for link in raw["links"].values()):
        found["run"] = apart(run_of(of), u)
    if not any("ground" in each["links"] for each in raw["joints"].values()):
        found["momentum"] = momentum(of, v)
    R, shift = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix(), np.array([0.3, -0.2, 0.5])
    again = turned(copy.deepcopy(raw), R, shift)
    for motion in again["analysis"].get("initial_motions", {}).values():
        motion |= {
            "at": (R @ motion["at"] + shift).tolist(),
            "angular_velocity": (R @ motion["angular_velocity"]).tolist(),
        }
    other = stepped(again)
    found["turned"] = apart(of_beams(*other[:2]), of_beams(of, u) @ R.T)
    return found


WITHIN = {"monolithic": 1e-7, "run": 1e-10, "turned": 1e-7, "momentum": 1e-8}


def outcome(seed: int, most: int = 12) -> tuple[str, dict[str, float]]:
    """Fine, differs, does not converge (at this step, by the march or the oracle), or has a start that its joints do not
    allow; and how far it is from each law."""
    try:
        found = checked(seed, most)
    except SolveError as error:
        return f"does not converge: {error}", {}
    except MotionError:
        return "no mechanism", {}
    return "fine" if all(x < WITHIN[key] for key, x in found.items()) else "differs", found


# -- driven ones ---------------------------------------------------------------------------------------------

STIFFER, TEN, LIMIT, SECONDS = 3.0, 10.0, 1e-3, 60.0
LEAST, SPEED = 1e-12, 0.1  # m, N, N m; rad/s, m/s of coordinates: what is less is rounding
ALIKE = 5e-5  # of the largest: what the monolithic step's rounding leaves of stiff hubs' forces, and iterations of laws
#: drawn at random, some lock, or have a slot too short, or one that turns too far
NO_MECHANISM = (MotionError, MeshError)


def stiffer(raw: Raw, factor: float) -> Raw:
    """A scene whose elastic links and bushings are stiffer by a factor; not its springs, which act as they do."""
    raw = copy.deepcopy(raw)
    for link in raw["links"].values():
        link["material"] = "steel" if link["fidelity"] == "rigid" else "elastic"
    raw["materials"] = {
        "elastic": {"youngs_modulus": 2.1e11 * factor, "poisson_ratio": 0.3, "density": 7850.0}
    }
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
    arm = 0.15  # m, the length of a link
    unit = {name: 1.0 if name.endswith("force") else arm for name in pairs}
    largest = max(
        (float(np.abs(rigid).max()) / unit[name] for name, (_, rigid) in pairs.items()), default=1.0
    )
    return {name: float(np.abs(e - r).max()) / unit[name] / largest for name, (e, r) in pairs.items()}


def limit(seed: int, frames: str, most: int = 6) -> tuple[str, dict[str, float]]:
    """Whether a driven mechanism of nearly rigid links has the forces of rigid ones, and how far it is from that.

    Two independent ways: multipliers of the rigid linkage's equations, and the balance of elastic links. Where they are
    not within LIMIT, a stiffness ten times as high must bring them nearer, five times at least.
    """
    raw = driven(seed, most, frames)
    try:
        moving(scene_from(raw))
        found = off_rigid(stiffer(raw, STIFFER))
        soft = any(x >= LIMIT for x in found.values())
        again = off_rigid(stiffer(raw, TEN * STIFFER)) if soft else {}
    except NO_MECHANISM:
        return "no mechanism", {}
    except KedfemError as error:
        return f"refused: {error}", {}
    return "fine" if all(
        x < 2 * max(found[name], LIMIT) / TEN for name, x in again.items()
    ) else "differs", found


def by_both_solvers(seed: int, most: int = 6) -> tuple[str, dict[str, float]]:
    """Whether a driven mechanism, in rigid-body frames and without limits, vibrates alike by both solvers; how far."""
    raw = varied(driven(seed, most, "rigid-body") | {"limits": {}}, seed)
    got = []
    try:
        for solver in ("condensed", "monolithic"):
            analysis = raw["analysis"] | {
                "kind": "transient",
                "solver": solver,
                "end_time": 20 * STEP,
                "step": STEP,
            }
            got.append(channels(*ran({**raw, "analysis": analysis})))
    except NO_MECHANISM:
        return "no mechanism", {}
    except KedfemError as error:
        return f"refused: {error}", {}
    sizes: dict[str, float] = {}
    for name, values in got[1].items():
        sizes[_kind(name)] = max(sizes.get(_kind(name), 0.0), float(np.abs(values).max(initial=0.0)))
    found = {
        name: float(np.abs(values - got[1][name]).max(initial=0.0))
        / max(sizes[_kind(name)], SPEED if name.endswith("/speed") else LEAST)
        for name, values in got[0].items()
        if not name.startswith("energy/")
    }
    return "fine" if all(x < ALIKE for x in found.values()) else "differs", found


def varied(raw: Raw, seed: int) -> Raw:
    """A scene with damping, start, numerical damping and stiffening at random."""
    random, analysis = np.random.default_rng(seed + 1_000_000), {}
    if random.random() < 0.5:
        alpha, beta = float(random.uniform(0, 5)), float(10 ** random.uniform(-6, -4))
        raw = raw | {"damping": {"alpha": alpha, "beta": beta}}
    analysis["initial"] = "quasi-static" if random.random() < 0.4 else "rest"
    analysis["rho_inf"] = float(random.choice([0.3, 0.8, 0.9]))
    if random.random() < 0.2:
        analysis["stiffening"] = True
    return raw | {"analysis": raw["analysis"] | analysis}


def by_march_and_oracle(seed: int, most: int = 6) -> tuple[str, dict[str, float]]:
    """Whether a driven mechanism with co-rotational frames moves from rest as by the oracle; how far it is.

    Where a motor's force rises with its speed, or a limit is met, a step may have several solutions.
    """
    raw = driven(seed, most, "co-rotational")
    analysis = {"kind": "transient", "initial": "rest", "end_time": STEPS * STEP, "step": STEP}
    try:
        of = as_a_run(begun(raw | {"analysis": raw["analysis"] | analysis}))
        found = {"oracle": against_oracle(of, STEPS, keeps=True)}
    except NO_MECHANISM:
        return "no mechanism", {}
    except KedfemError as error:
        return f"refused: {error}", {}
    return "fine" if found["oracle"] < WITHIN["monolithic"] else "differs", found


def _kind(name: str) -> str:
    """What channels are measured by: force, moment, displacement …"""
    return name.rpartition("/")[2].removeprefix("rigid_").replace("torque", "moment")


def bounded(seed: int, given: argparse.Namespace) -> tuple[str, dict[str, float]]:
    """What becomes of a mechanism within so much processor time."""
    signal.signal(signal.SIGPROF, _stop)
    signal.setitimer(signal.ITIMER_PROF, given.seconds)
    try:
        if given.solvers:
            two = by_march_and_oracle if given.driven == "co-rotational" else by_both_solvers
            return two(seed, min(given.most, 6))
        return limit(seed, given.driven, min(given.most, 6)) if given.driven else outcome(seed, given.most)
    except TimeoutError:
        return "takes too long", {}
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)


def _stop(number: int, frame: Any) -> None:
    raise TimeoutError


def main() -> None:
    """Tries mechanisms one after the other."""
    parser = argparse.ArgumentParser(description=__doc__)
    for name, usual in (("count", 200), ("first", 0), ("most", 12)):
        parser.add_argument(f"--{name}", type=int, default=usual)
    parser.add_argument("--driven", choices=("rigid-body", "co-rotational"))
    parser.add_argument("--solvers", action="store_true", help="driven ones by both solvers")
    parser.add_argument("--seconds", type=float, default=SECONDS, help="processor time of one")
    given = parser.parse_args()
    count: dict[str, int] = {}
    for seed in range(given.first, given.first + given.count):
        what, found = bounded(seed, given)
        count[what.split(":")[0]] = count.get(what.split(":")[0], 0) + 1
        frames = given.driven or ("rigid-body" if given.solvers else None)
        raw = driven(seed, min(given.most, 6), frames) if frames else mechanism(seed, given.most)
        kinds = " ".join(x["kind"] for x in raw["joints"].values())
        worst = sorted(found.items(), key=lambda x: -x[1])[:4]
        far = ", ".join(f"{key} {x:.1e}" for key, x in worst)
        said = what.partition("\n")[0]
        sys.stdout.write(f"{seed}: {len(raw['links'])} bodies, {kinds}: {said} {far}\n")
        sys.stdout.flush()
    sys.stdout.write(f"{count}\n")


if __name__ == "__main__":
    main()
