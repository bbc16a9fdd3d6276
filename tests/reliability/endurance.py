"""Ten million steps in one march: `python -m tests.reliability.endurance --steps 10000000`.

A planar four-bar of beams, one element a link, turns some 14,000 times. Its joints must stay closed, its steady motion
must stay what it was, the energy that is unaccounted for must grow as the step's error says, and the memory not at all.
"""

import argparse
import time
from collections.abc import Iterator
from dataclasses import dataclass, field

import numpy as np
from benchmarks.memory import memory_held

from kedfem.accuracy.prepared import Prepared, meshed
from kedfem.dynamics.history import Block
from kedfem.dynamics.stepping.levels import level_steps, leveled
from kedfem.results.audit import Account
from kedfem.scene import GROUND, Scene, scene_from, time_grid
from tests.joint_checks import bodies, port_motion, sides
from tests.scenes import example

A_TURN = 720  # steps
SETTLED = 50  # turns after which the start has died away; its own damping leaves exp(-100) of it
STRIDE = 16  # steps between two looks at the joints
SIZE = 0.9144  # m, the longest link
MARKS = (0.01, 0.1, 0.2, 0.5, 1.0)  # shares of all steps at which figures are taken


@dataclass
class Seen:
    """What the march has shown so far.

    gap : largest distance of a joint's two sides [m]; residual : largest energy unaccounted for [J]
    turns : energy unaccounted for at the ends of whole turns [J]; steady, drift : displacements of a settled turn [m],
    and by how much those of a later turn differ at most [m]; held : memory at the marks [bytes]
    """

    gap: float = 0.0
    residual: float = 0.0
    turns: list[float] = field(default_factory=list)
    steady: np.ndarray | None = None
    drift: float = 0.0
    held: list[float] = field(default_factory=list)


def scene_of(steps: int, a_turn: int = A_TURN) -> Scene:
    """The worked example's four-bar, marched so many steps."""
    raw = example("four_bar_beams")
    raw["analysis"] = {
        "accuracy": "quick", "initial": "quasi-static", "extrapolation_levels": 1,
        "steps_per_revolution": a_turn, "revolutions": steps / a_turn,
    }  # fmt: skip
    return scene_from(raw | {"output": {}})


def gap(ready: Prepared, block: Block) -> float:
    """Largest distance of the two sides of any joint [m]: where rigid motion and displacements bring them."""
    at, worst = bodies(ready, [block]), 0.0
    for name, joint in ready.scene.joints.items():
        X = np.asarray(joint.at)
        one, other = (at.place(on, X) + displaced(ready, block, name, on) for on in sides(joint))
        worst = max(worst, float(np.linalg.norm(one - other, axis=1).max()))
    return worst


def displaced(ready: Prepared, block: Block, name: str, on: str) -> np.ndarray:
    """Elastic displacement of a joint's side (T, 3) [m]; none of the ground. The third of a planar beam is its turn."""
    return np.zeros(3) if on == GROUND else port_motion(ready, [block], name, on)[1][:, 0] * [1, 1, 0]


def marched(scene: Scene) -> Iterator[tuple[Prepared, Block, np.ndarray, Account]]:
    """All blocks of the run, with the energy that is unaccounted for."""
    ready = meshed(scene)
    account, solvers = Account(ready.model), level_steps(scene, ready.model)
    for block in leveled(scene, ready.linkage, ready.path, ready.model, solvers):
        yield ready, block, account.rows(block)["residual"][:, 0], account


def look(seen: Seen, ready: Prepared, block: Block, residual: np.ndarray, a_turn: int) -> None:
    """One block more."""
    seen.gap = max(seen.gap, gap(ready, block.chosen(slice(0, None, STRIDE))))
    seen.residual = max(seen.residual, float(np.abs(residual).max()))
    number = block.step + np.arange(len(block))
    seen.turns += residual[number % a_turn == 0].tolist()
    phase, late = number % a_turn, number >= SETTLED * a_turn
    u = np.concatenate([link.g[:, :, :2].reshape(len(block), -1) for link in block.links], axis=1)
    if seen.steady is None:
        seen.steady = np.full((a_turn, u.shape[1]), np.nan)
    new = late & np.isnan(seen.steady[phase, 0])
    seen.steady[phase[new]] = u[new]
    if (late & ~new).any():
        seen.drift = max(seen.drift, float(np.abs(u - seen.steady[phase])[late & ~new].max()))


def endured(steps: int, a_turn: int = A_TURN, marks: tuple[float, ...] = MARKS) -> tuple[Seen, Account]:
    """The whole march, and a line at each mark."""
    scene, seen, began = scene_of(steps, a_turn), Seen(), time.monotonic()
    steps, wanted = time_grid(scene).steps, list(marks)
    for ready, block, residual, account in marched(scene):  # noqa: B007 - the last one is handed on
        look(seen, ready, block, residual, a_turn)
        done = block.step + len(block) - 1
        while wanted and done >= wanted[0] * steps:
            wanted.pop(0)
            seen.held.append(memory_held())
            print(  # noqa: T201 - a command
                f"{done:12,d} steps  gap {seen.gap / SIZE:.2e}  residual {seen.residual:.3e} J  drift {seen.drift:.2e} m"
                f"  memory {seen.held[-1] / 1e6:.1f} MB  {time.monotonic() - began:.0f} s",
                flush=True,
            )
    return seen, account


def growth(turns: list[float], settled: int = SETTLED) -> tuple[float, float]:
    """Energy unaccounted for a turn [J], and the largest deviation from growth in proportion to the turns [J]."""
    n, left = np.arange(settled, len(turns)), np.asarray(turns[settled:])
    slope, start = np.polyfit(n - n[0], left, 1)
    return float(slope), float(np.abs(left - start - slope * (n - n[0])).max())


def main() -> None:
    """March, and say what grew."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--steps", type=int, default=10_000_000)
    given = parser.parse_args()
    seen, account = endured(given.steps)
    slope, off = growth(seen.turns)
    print(f"largest displacement {np.nanmax(np.abs(seen.steady)):.3e} m")  # noqa: T201
    print(f"energy unaccounted for, largest share: {account.balance.energy:.2e}")  # noqa: T201
    print(f"a turn leaves {slope:.4e} J, off that by {off:.1e} J at most")  # noqa: T201
    for a_turn in (A_TURN, 2 * A_TURN):
        short = endured(4 * SETTLED * a_turn, a_turn, ())[0]
        print(f"{a_turn} steps a revolution: {growth(short.turns)[0]:.4e} J a turn")  # noqa: T201


if __name__ == "__main__":
    main()
