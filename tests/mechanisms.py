"""Random mechanisms: trees of 2 to 12 bodies in space, on the ground or free, without a drive; driven ones of all kinds.

``python -m tests.mechanisms --count 2000`` tries as many of the first, with ``--driven rigid-body`` or ``co-rotational``
of the others by one of their laws (`tests.driven_mechanisms`), ``--law turned``; ``--first SEED --count 1`` one of them
again. Numbers after driven ones are parts of what is allowed.
"""

import argparse
import signal
import sys
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from kedfem.compiled import compiling
from kedfem.errors import MotionError, SolveError
from tests.cells import apart, run_of
from tests.driven_mechanisms import FRAMES, LAWS, tried
from tests.moving import beam_in_space, turned
from tests.partners import joint
from tests.random_scenes import driven
from tests.spatial_joints import rigid_in_space
from tests.systems import Begun, begun, by_oracle, marched, rows

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


def stepped(raw: Raw, today: bool = False) -> tuple[Begun, np.ndarray, np.ndarray]:
    """A scene with displacements and rates (T, N) of its steps; see `begun`."""
    of = begun(raw, today=today, as_run=True)
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
    all_elastic = not any(link["model"] == "rigid" for link in raw["links"].values())
    of, u, v = stepped(raw, today=all_elastic)
    found = {"monolithic": apart(u, by_oracle(of, STEPS, keeps=True)[0])}
    if all_elastic:
        found["run"] = apart(run_of(of), u)
    if not any("ground" in each["links"] for each in raw["joints"].values()):
        found["momentum"] = momentum(of, v)
    R, shift = Rotation.from_rotvec([0.7, -1.1, 0.4]).as_matrix(), np.array([0.3, -0.2, 0.5])
    other = stepped(turned(raw, R, shift))
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


def bounded(seed: int, given: argparse.Namespace) -> tuple[str, dict[str, float]]:
    """What becomes of a mechanism within so much processor time, compiling aside: numba must not be stopped."""
    left = given.seconds

    def paused(begins: bool) -> None:
        nonlocal left
        rest = signal.setitimer(signal.ITIMER_PROF, 0.0 if begins else max(left, 0.1))[0]
        left = rest if begins else left

    signal.signal(signal.SIGPROF, _stop)
    signal.setitimer(signal.ITIMER_PROF, given.seconds)
    try:
        with compiling(paused):
            if given.driven:
                return tried(given.law, seed, given.driven, min(given.most, 6), given.elsewhere)
            return outcome(seed, given.most)
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
    parser.add_argument("--driven", choices=FRAMES)
    parser.add_argument("--elsewhere", action="store_true", help="driven ones at coordinates of joints in their loops")
    parser.add_argument("--law", choices=LAWS, default="rigid", help="of driven ones")
    parser.add_argument("--seconds", type=float, default=60.0, help="processor time of one, compiling aside")
    given = parser.parse_args()
    count: dict[str, int] = {}
    for seed in range(given.first, given.first + given.count):
        what, found = bounded(seed, given)
        count[what.split(":")[0]] = count.get(what.split(":")[0], 0) + 1
        raw = driven(seed, min(given.most, 6), given.driven) if given.driven else mechanism(seed, given.most)
        kinds = " ".join(x["kind"] for x in raw["joints"].values())
        worst = sorted(found.items(), key=lambda x: -x[1])[:4]
        far = ", ".join(f"{key} {x:.1e}" for key, x in worst)
        said = what.partition("\n")[0]
        sys.stdout.write(f"{seed}: {len(raw['links'])} bodies, {kinds}: {said} {far}\n")
        sys.stdout.flush()
    sys.stdout.write(f"{count}\n")


if __name__ == "__main__":
    main()
