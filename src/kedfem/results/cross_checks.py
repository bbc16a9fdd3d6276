"""Comparison of two independent computations of an effort over a run: elastic and rigid links, drives and energy.

It costs a few sums a step. With free motions, in which rigid links stay in the reference position, there is no
comparison. Elastic effort e and rigid effort r of one joint or drive agree but for vibration, which over a run has no
mean and is not correlated with r. So c = ⟨e r⟩/⟨r r⟩ of e ≈ c r and the mean of e − r reveal an effort that is missing
or counted twice, but are insensitive to vibration.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import Block
from kedfem.motion.linkage import Linkage
from kedfem.results.audit import Account
from kedfem.results.channels import Channel
from kedfem.results.forces.loads import drive_rate
from kedfem.results.recorded import Rows, drive_effort
from kedfem.scene import Scene, driven_travel, percentage, without_vibration

# c and the mean of e − r may be off by this part; runs of examples/ and tests stay below 0.2, a missing effort gives 1
CONTRADICTION = 0.5
SWING = 1.0  # and by this part of what swings beside it, whose share in c and mean falls with the length of the run
AMPLIFIED = 3.0  # times as much as rigid links: near a resonance elastic links bear more, in phase
SMALL = 0.01  # of the largest effort of its unit: what is smaller is not compared
UNWORKED = 1e-3  # of the energy exchanged: trapezoidal sums of one and the same step agree to rounding
RESTING = 1e-7  # of the linkage's size, or rad: what moves less exchanges rounding; no work is judged by it
MISSING = 0.02  # of it, from which on a part of an effort is missing; steps that hardly converge leave less


@dataclass
class _Pair:
    """Sums over the time points so far of an elastic effort and that of rigid links."""

    elastic: str
    rigid: str
    columns: list[int]
    unit: str
    count: int = 0
    products: Float[np.ndarray, "3"] = field(default_factory=lambda: np.zeros(3))
    means: Float[np.ndarray, "2 c"] = field(default_factory=lambda: np.zeros((2, 1)))

    def add(self, e: Rows, r: Rows) -> None:
        """Add more time points."""
        self.count += len(e)
        self.products += [np.vdot(e, e), np.vdot(e, r), np.vdot(r, r)]
        self.means = self.means + np.stack([e.sum(axis=0), r.sum(axis=0)])

    @property
    def size(self) -> float:
        """Root mean square of the rigid effort."""
        return float(np.sqrt(self.products[2] / max(self.count, 1)))

    def share(self) -> float | None:
        """Ratio of the elastic to the rigid effort if the two contradict each other; None if they agree."""
        ee, er, rr = self.products / self.count
        c = float(er / rr)
        swing = float(np.sqrt(max(ee - c * er, 0.0) / rr))
        e, r = self.means / self.count
        offset = float(np.linalg.norm(e - r) / np.sqrt(rr))
        spread = float(np.sqrt(max((ee - 2 * er + rr) / rr - offset**2, 0.0)))
        less = 1.0 - c > CONTRADICTION + SWING * swing
        more = c > AMPLIFIED + SWING * swing
        shifted = offset > CONTRADICTION + SWING * spread
        return c if less or more or shifted else None


class CrossChecks:
    """Comparison of efforts over a run, block after block.

    account : of the same run's energy; the drives' work is compared with that of all port forces on the rigid-body
        motion. On the elastic motion constraint equations whose directions vary do work too, −μᵀ C' z, and springs in
        joints do.
    """

    REMEMBERED = ("pairs", "_last", "_work", "unbalanced", "exchanged", "_rounding")

    def __init__(self, scene: Scene, linkage: Linkage, channels: Sequence[Channel], account: Account) -> None:
        known = {each.name: each for each in channels}
        self.linkage, self.size = linkage, linkage.size
        self.pairs = []
        for name, each in known.items() if not linkage.mobility else ():
            rigid = known.get(_rigid_name(name))
            if rigid is not None and "without the part along" not in rigid.description:
                columns = [each.columns.index(x) for x in rigid.columns]
                self.pairs.append(_Pair(name, rigid.name, columns, each.unit))
        self.scene, self.drives = scene, {drive_effort(scene, name)[0]: name for name in scene.all_drives}
        self.account = account
        all_known = bool(self.drives) and known.keys() >= self.drives.keys()
        self.worked = all_known and not without_vibration(scene)  # else there is no account of energy
        self._last: tuple[float, float] | None = None
        self._work, self.unbalanced = 0.0, 0.0
        self.exchanged = 0.0  # largest energy or work so far [J]
        self._rounding = 0.0  # work of the largest drive effort on what RESTING allows [J]

    def add(self, block: Block, values: dict[str, Rows]) -> None:
        """Add the rows of the next block."""
        motion = block.motion
        for each in self.pairs:
            each.add(values[each.elastic][:, each.columns], values[each.rigid])
        if not self.worked:
            return
        rates = {effort: drive_rate(self.scene, x, self.linkage, motion) for effort, x in self.drives.items()}
        power = np.sum([values[effort][:, 0] * rate for effort, rate in rates.items()], axis=0)
        t0, before = self._last or (float(motion.t[0]), float(power[0]))
        h = np.diff(motion.t, prepend=t0)
        work = self._work + np.cumsum(0.5 * h * (power + np.concatenate([[before], power[:-1]])))
        left = work - self.account.rows(block)["driven"][:, 0]
        exchanged = [values["energy/strain"], values["energy/kinetic"], values["energy/work"], work]
        for effort, x in self.drives.items():
            arm = self.size if driven_travel(self.scene, x) else 1.0
            self._rounding = max(self._rounding, RESTING * arm * float(np.abs(values[effort]).max()))
        self._last, self._work = (float(motion.t[-1]), float(power[-1])), float(work[-1])
        self.unbalanced = max(self.unbalanced, float(np.abs(left).max()))
        self.exchanged = max(self.exchanged, *(float(np.ptp(x, axis=0).max()) for x in exchanged))

    @property
    def unworked(self) -> float:
        """Work of the drives that is missing in the energy account, relative to the energy exchanged [-].

        Where all rests, of the least that a drive's effort would exchange if anything moved.
        """
        scale = max(self.exchanged, self._rounding)
        return self.unbalanced / scale if scale else 0.0

    def warnings(self) -> tuple[str, ...]:
        """Warnings of efforts that contradict each other."""
        out = []
        for each in self.pairs:
            most = max(other.size / self._arm(other) for other in self.pairs)
            share = each.share() if each.size > SMALL * most * self._arm(each) and each.count > 1 else None
            if share is not None:
                out.append(
                    f"{each.elastic} contradicts {each.rigid}: over the run it is {percentage(share, 3)} of it, "
                    "on average; elastic links do not explain that, unless links or springs are very soft: one of "
                    "both is wrong"
                )
        if self.unworked > UNWORKED:
            names, left = ", ".join(self.drives), f"{percentage(self.unworked)} of the energy exchanged"
            meaning = "a part of its effort is missing"
            if self.unworked <= MISSING:
                left += ", no more"
                uncertain = "so far efforts and energies are uncertain"
                meaning = f"{uncertain}; a shorter step shows whether it is the steps'"
            off = f"is off the change of energy and the other work by {left}"
            out.append(f"{names}: the work of the drive {off}: {meaning}")
        return tuple(out)

    def _arm(self, each: _Pair) -> float:
        """The arm by which moments are compared with forces [m]."""
        return 1.0 if each.unit == "N" else self.size


def _rigid_name(name: str) -> str:
    """The channel of rigid links that corresponds to one of elastic links."""
    head, _, what = name.rpartition("/")
    return f"{head}/rigid_{what}" if what in {"force", "torque"} else ""
