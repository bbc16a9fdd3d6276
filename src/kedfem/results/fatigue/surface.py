"""The surface of a link over a period: the stress histories at its points, and their damage."""

from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.links.free_surface import FreeSurface, free_surface
from kedfem.links.recovery import StressRecovery
from kedfem.processes import threads
from kedfem.results.fatigue.planes import disproportion, dominant, findley_stresses, normal_stresses, signed_von_mises
from kedfem.results.fatigue.strength import Strength
from kedfem.results.stresses.envelope import StressHistory
from kedfem.scene import Fatigue as FatigueSettings

PLANES = 36  # through a point, at the least, on which histories are counted
CHUNK = 4_000_000  # bytes of histories of some points: they stay in the cache
NOTHING = 1e-6  # of a link's highest stress: histories whose shape is rounding
CRITERIA = ("signed von Mises", "normal stress", "Findley")
SIGNED, NORMAL, FINDLEY = range(3)


@dataclass(frozen=True, slots=True)
class LinkFatigue:
    """Damage at the points of a link or segment; nan inside it, and where points were left out or have no data.

    damage : Miner's sum in a period
    utilisation : of the endurance stress without a stress gradient, with the safety factor
    amplitude, mean : of the cycle that does most damage [Pa]
    disproportion : of stresses, as of `FatigueSpot`
    criterion : number in `CRITERIA`
    """

    recovery: StressRecovery
    damage: Float[np.ndarray, " p"]
    utilisation: Float[np.ndarray, " p"]
    amplitude: Float[np.ndarray, " p"]
    mean: Float[np.ndarray, " p"]
    disproportion: Float[np.ndarray, " p"]
    criterion: Float[np.ndarray, " p"]


@dataclass(frozen=True, slots=True)
class DamageAtPoints:
    """Damage at k points of a surface.

    found : (k, 4) damage, reversed amplitude, amplitude and mean of its cycle, of the worst plane
    disproportion, criterion : (k,)
    h : (k, T) the history that was counted
    """

    found: Float[np.ndarray, "k 4"]
    disproportion: Float[np.ndarray, " k"]
    criterion: Int[np.ndarray, " k"]
    h: Float[np.ndarray, "k T"]


@dataclass(frozen=True, slots=True)
class Period:
    """The last period of a run.

    length : [s]
    end : time of its end
    before : whether the run had a whole period before
    """

    length: float
    end: float
    before: bool

    def of(self, kept: StressHistory) -> tuple[Float[np.ndarray, "T r"], Float[np.ndarray, "_ r"]]:
        """Coordinates of modes over the period, without its beginning, and their differences from the period before.

        Without a period before, the difference between the end of the period and its beginning.
        """
        some = max(1e-9 * self.length, 1e-3 * float(kept.times[-1] - kept.times[-2]))
        last = kept.times > self.end - self.length + some
        C, times = kept.C[last], kept.times[last]
        times = times if self.before else times[-1:]
        earlier = [np.interp(times - self.length, kept.times, x) for x in kept.C.T]
        return C, C[-len(times) :] - np.reshape(earlier, (-1, len(times))).T


class SurfaceHistory:
    """The surface of one link or segment, and its stress history.

    near : the singular place near each of its points, in words; else empty
    highest : highest stress over the period of all points examined [Pa]
    repeats : difference of stresses from the period before, relative to the highest
    left_out : number of points left out near singular places
    """

    def __init__(
        self, recovery: StressRecovery, kept: StressHistory | None, near: Sequence[str], strength: Strength,
        asked: FatigueSettings, period: Period,
    ) -> None:  # fmt: skip
        self.recovery, self.strength, self.asked, self.near = recovery, strength, asked, near
        self.name = recovery.link.name
        if kept is None:
            raise TypeError(f"{self.name}: has no history")
        self.parts = kept.parts
        self.C, self.gone = period.of(kept)
        self.moments, self.mean = self.C.T @ self.C / len(self.C), self.C.mean(axis=0)
        whole = free_surface(recovery)
        words = np.array([bool(word) for word in near])[whole.places % self.recovery.points]
        out = words & (not asked.near_joints)
        self.left_out = int(out.sum())
        self.surface = FreeSurface(whole.places[~out], whole.axes[~out])
        highest, apart = 0.0, 0.0
        for which in self.chunks(6):
            A = self.parts[self.surface.places[which]]
            highest = max(highest, _largest(_histories(A, self.C)))
            apart = max(apart, _largest(_histories(A, self.gone)))
        self.highest, self.repeats = highest, apart / highest if highest else 0.0

    def chunks(self, each: int = PLANES) -> Iterator[slice]:
        """Slices of points whose histories, `each` of every point, fit into the cache together."""
        size = max(1, CHUNK // (8 * each * max(len(self.C), len(self.gone))))
        return (slice(k, k + size) for k in range(0, len(self.surface.places), size))

    def judged(self, which: slice | list[int]) -> DamageAtPoints:
        """Damage at some of the points."""
        A, axes = self.parts[self.surface.places[which]], self.surface.axes[which]
        H = _histories(A, self.C)
        d = dominant(A @ self.moments @ A.transpose(0, 2, 1), A @ self.mean)
        apart = np.where(np.abs(H).max(axis=(1, 2)) > NOTHING * self.highest, disproportion(H, d), 0.0)
        criterion = self._criterion(apart)
        found, h = np.zeros((len(A), 4)), np.zeros((len(A), len(self.C)))
        for kind in np.unique(criterion):
            some = criterion == kind
            found[some], h[some] = self._counted(kind, H[some], d[some], axes[some])
        return DamageAtPoints(found, apart, criterion, h)

    def _criterion(self, apart: Float[np.ndarray, " k"]) -> Int[np.ndarray, " k"]:
        if self.asked.criterion == "auto":
            return np.where(apart <= self.asked.proportional_within, SIGNED, NORMAL)
        kinds = {"signed_von_mises": SIGNED, "normal": NORMAL, "findley": FINDLEY}
        return np.full(len(apart), kinds[self.asked.criterion])

    def _counted(
        self, kind: int, H: Float[np.ndarray, "k 6 T"], d: Float[np.ndarray, "k 6"],
        axes: Float[np.ndarray, "k 3 3"],
    ) -> tuple[Float[np.ndarray, "k 4"], Float[np.ndarray, "k T"]]:  # fmt: skip
        """The worst history of each point, with its counted cycles."""
        from kedfem.results.fatigue.counting_kernel import counted

        known = self.strength
        if kind == SIGNED:
            h = signed_von_mises(H, d)[:, None]
        elif kind == NORMAL:
            h = normal_stresses(H, axes)
        else:
            h = findley_stresses(H, axes, self.asked.findley_factor)
        found = np.zeros((h.shape[0] * h.shape[1], 4))
        M = 0.0 if kind == FINDLEY else known.M  # the largest normal stress is in the amplitude
        counted(h.reshape(len(found), -1), M, known.S, known.N, known.floor, found)
        found = found.reshape(*h.shape[:2], 4)
        worst = worse(found[:, :, 0], found[:, :, 1])
        rows = np.arange(len(h))
        return found[rows, worst], h[rows, worst]

    def field(self) -> LinkFatigue:
        """Damage at all points; at those of a planar beam of the worse of its two fibres."""
        out = np.full((6, self.recovery.stressed), np.nan)
        endurance = self.strength.endurance * self.strength.endless / self.asked.safety_factor

        def fill(which: slice) -> None:
            each = self.judged(which)
            columns = [each.found[:, 0], each.found[:, 1] / endurance, each.found[:, 2], each.found[:, 3]]
            out[:, self.surface.places[which]] = [*columns, each.disproportion, each.criterion]

        with ThreadPoolExecutor(threads()) as pool:
            for _ in pool.map(fill, self.chunks()):
                pass  # an error of one is raised here
        sides = out.reshape(6, -1, self.recovery.points)
        side = worse(np.nan_to_num(sides[0].T), np.nan_to_num(sides[1].T))
        return LinkFatigue(self.recovery, *np.take_along_axis(sides, side[None, None], 1)[:, 0])

    def place_of(self, point: int) -> int:
        """The position of a point in the list of the surface's places; of two fibres the worse."""
        rows = np.flatnonzero(self.surface.places % self.recovery.points == point)
        found = self.judged(rows.tolist()).found
        return int(rows[worse(found[None, :, 0], found[None, :, 1])[0]])

    def gradient(self, place: int, moment: int) -> float:
        """The related gradient of von Mises stress at a place of the surface, inwards [1/m]; 0 of beams."""
        link = self.recovery.link
        if not link.meshed:
            return 0.0
        node = int(self.surface.places[place])
        around = np.unique(link.cells[(link.cells == node).any(axis=1)])
        stress = np.sqrt(((self.parts[around][:, :5] @ self.C[moment]) ** 2).sum(axis=1))
        own = float(stress[around == node][0])
        if not own:
            return 0.0
        slope = np.linalg.lstsq((link.X[around] - link.X[node])[:, : link.d], stress - own, rcond=None)[0]
        if link.d == 2:  # along the plane
            return float(np.linalg.norm(slope)) / own
        return max(0.0, float(slope @ self.surface.axes[place, 2])) / own


def worse(damage: Float[np.ndarray, "k P"], amplitude: Float[np.ndarray, "k P"]) -> Int[np.ndarray, " k"]:
    """Of each point the history with the most damage; where none does any that with the largest amplitude."""
    some = damage.max(axis=1) > 0
    return np.asarray(np.where(some, damage.argmax(axis=1), amplitude.argmax(axis=1)))


def _histories(A: Float[np.ndarray, "k 6 r"], C: Float[np.ndarray, "T r"]) -> Float[np.ndarray, "k 6 T"]:
    """Stress over time from that of modes and their coordinates; one product of matrices for all points."""
    return np.asarray((A.reshape(-1, A.shape[2]) @ C.T).reshape(len(A), 6, -1))


def _largest(H: Float[np.ndarray, "k 6 T"]) -> float:
    return float(np.sqrt(np.einsum("kqt,kqt->kt", H, H).max(initial=0.0)))
