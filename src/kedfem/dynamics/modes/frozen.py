"""Natural frequencies and mode shapes of a linkage frozen at positions of its rigid-body motion.

    (K + κ c cᵀ) x = ω² M x,   joints closed: W x = Rᵀ B z,  C z = 0

K = T K0 Tᵀ is the stiffness of links, κ are the tangents of force laws at the position. All links are factored once, with
K0 + s M; at each position joints and laws add an interface of some dozen unknowns (`system.starts.linear_equations`), and
a block Lanczos run on (K + s M)⁻¹ M finds the lowest ω². With s > 0 it also finds rigid-body motions, ω = 0.
Forces that stretch a link or a spring do not change its stiffness here, unless `preloads` are requested; `stiffened` has
those of links.
"""

from dataclasses import dataclass

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.matrices.bordered import ConstraintTerms
from kedfem.dynamics.modes.lanczos import Block, lanczos
from kedfem.dynamics.modes.preloads import with_preloads
from kedfem.dynamics.stepping.scheme import generalised_alpha
from kedfem.dynamics.stepping.state import Rayleigh
from kedfem.dynamics.system.arrays import Coefficients
from kedfem.dynamics.system.layout import as_arrays, coefficients, factored
from kedfem.dynamics.system.ready import Ready
from kedfem.dynamics.system.record import TIME, Stop, System, curve_of
from kedfem.dynamics.system.sparse import SparsePart, momentum
from kedfem.dynamics.system.starts.instant import Instant, sizes
from kedfem.dynamics.system.starts.internal_forces import own, rows
from kedfem.dynamics.system.starts.linear_equations import HeldBody, LinearEquations, stepped_body
from kedfem.errors import SceneError, SolveError
from kedfem.links.reduced import wave_frequency
from kedfem.motion.rigid import RigidMotion
from kedfem.scene import Scene, time_grid

RIGID_MOTIONS = 6  # of a free body: so many equal frequencies must be found, at the least
STILL = 1e-8  # ω²/s below which a motion has no strain: free chains of tests/laws/test_frozen.py leave less
# of the sum of the terms of xᵀ K x: a beam about its own axis leaves up to 1.4e-16 (tests/laws/test_frozen.py)
ROUNDED = 16 * float(np.finfo(float).eps)
TURNED = 1e-4  # of `least`: turning links whose tension and turning cancel leave 3e-6 (tests/laws/test_stiffened.py)
FIRST = 1e-3  # s, of the slowest link's (√(E/ρ)/L)², before the first frequency is known
NEAR = (1e-3, 1e6)  # ω² of the first vibration over s; beyond, links are factored again with s = ω²


class UnstableError(SolveError):
    """A linkage is statically unstable in the position in which it is frozen.

    Parameters
    ----------
    how : what happens there, in words
    motion : of that one time
    """

    def __init__(self, how: str, motion: RigidMotion) -> None:
        super().__init__(
            f"frequencies: must be those of a linkage that is stable where it is frozen, got one that {how} at "
            f"t = {float(motion.t[0]):.4g} s"
        )


@dataclass(frozen=True, slots=True)
class Modes:
    """Modes of a frozen linkage.

    omega : (f,) natural circular frequencies in rising order, those of motions without strain zero [rad/s]
    shapes : per link (f, n, d), of unit mass all together, world components [kg^-½]
    still : how many of them are motions without strain
    """

    omega: Float[np.ndarray, " f"]
    shapes: tuple[Float[np.ndarray, "f n d"], ...]
    still: int

    @property
    def frequencies(self) -> Float[np.ndarray, " v"]:
        """Of vibrations alone [Hz]."""
        return self.omega[self.still :] / (2 * np.pi)


class Frozen:
    """A system whose modes are computed at positions.

    Parameters
    ----------
    count : vibrations that are wanted
    free : motions without strain that there may be, which are found beside them
    least : s at the least [1/s²], where links alone are not held by less
    preloaded : whether forces of springs and motors, which change their directions, count

    excluded : (N, m) motions of unit mass that count as motions without strain; vibrations are orthogonal to them in M
    factorisations : of links, so far
    """

    def __init__(self, system: System, count: int, free: int = 0, least: float = 0.0, preloaded: bool = False) -> None:
        self.system, self.count, self.free, self.least = system, count, free, least
        self.preloaded = preloaded
        self.excluded: Block | None = None
        elastic = [link for link in system.model.links if not link.rigid] or list(system.model.links)
        self.shift = max(FIRST * min(map(wave_frequency, elastic)) ** 2, least)
        self.factorisations = 0
        self._settled = False
        self._factored()

    def _factored(self) -> None:
        self.of = _ready(self.system, self.shift)
        self.held = [_held(self.of, k) for k in range(len(self.of.parts))]
        self._like: Instant | None = None
        self.factorisations += len(self.held)

    def frozen(self, motion: RigidMotion) -> "Frozen":
        """Itself: its stiffness does not depend on the motion."""
        return self

    def at(self, motion: RigidMotion) -> Modes:
        """The lowest modes at a position; parameters and errors as in `modes`."""
        omega, still, x = self.modes(motion)
        return Modes(omega, self.per_link(x), still)

    def modes(self, motion: RigidMotion) -> tuple[Float[np.ndarray, " f"], int, Float[np.ndarray, "N f"]]:
        """Natural circular frequencies in rising order, how many are of motions without strain, shapes on coordinates.

        Parameters
        ----------
        motion : of one time

        Raises
        ------
        UnstableError
            If a motion away from the position would grow by itself.
        """
        lowest, shapes = self._lowest(motion)
        still = self._still(lowest, shapes, motion)
        while not self._settled:
            vibrations = lowest[still:]
            first = vibrations[vibrations > 0.0][:1]
            low, high = NEAR
            near = not len(first) or low <= first[0] / self.shift <= high
            better = self.shift if near else max(float(first[0]), self.least)
            self._settled = better == self.shift
            if not self._settled:
                self.shift = better
                self._factored()
                lowest, shapes = self._lowest(motion)
                still = self._still(lowest, shapes, motion)
        if (lowest[still:] < 0.0).any():
            raise UnstableError("is statically unstable", motion)
        end = still + self.count
        omega = np.sqrt(np.where(np.arange(len(lowest)) < still, 0.0, lowest))[:end]
        return omega, still, shapes[:, :end]

    def _still(self, lowest: Float[np.ndarray, " f"], shapes: Float[np.ndarray, "N f"], motion: RigidMotion) -> int:
        """How many of the lowest modes have no strain: their ω² is rounding, of s or of the terms of xᵀ K x."""
        nothing = max(STILL * self.shift, TURNED * self.least)
        for k, square in enumerate(np.abs(lowest)):
            if square > nothing and square > self._rounding(shapes[:, k : k + 1], motion):
                return k
        return len(lowest)

    def _rounding(self, x: Float[np.ndarray, "N 1"], motion: RigidMotion) -> float:
        """What rounding leaves of xᵀ K x: its terms are large in a thin beam that rotates about its own axis."""
        out, model = 0.0, self.system.model
        for link, body, (shape,) in zip(model.links, model.bodies, self.per_link(x), strict=True):
            g = np.abs(shape @ motion.R[0, body][: link.d, : link.d]).ravel()
            out += float(g @ (abs(link.K0) @ g))
        return ROUNDED * out

    def per_link(self, x: Block) -> tuple[Float[np.ndarray, "f n d"], ...]:
        """Columns on the coordinates of all bodies as rows of each link."""
        every = range(len(self.of.parts))
        return tuple(np.array([rows(self.of, k, each[own(self.of, k)]) for each in x.T]) for k in every)

    def balance(self, motion: RigidMotion) -> tuple[Instant, LinearEquations]:
        """K + s M with all joints and laws at a position."""
        now = Instant(self.of, lambda t: motion, float(motion.t[0]), self._like)
        self._like = now
        found = asked(now)
        return now, LinearEquations(self.of, self.held, now.R, with_preloads(now, found) if self.preloaded else found)

    def _lowest(self, motion: RigidMotion) -> tuple[Float[np.ndarray, " f"], Float[np.ndarray, "N f"]]:
        """ω² in rising order behind those of excluded motions, and shapes on the coordinates of all bodies."""
        _, balance = self.balance(motion)

        def solved(r: Block) -> Block:
            return np.stack([balance.solved(each).x for each in r.T], axis=1)

        size = int(self.of.bodies.at[-1])
        x = np.zeros((size, 0)) if self.excluded is None else self.excluded
        Mx = self.momentum(x) if x.size else x
        held = solved(Mx) if x.size else x

        def answer(r: Block) -> Block:
            found = solved(r)
            return np.asarray(found - held @ np.linalg.solve(Mx.T @ held, Mx.T @ found))

        block = max(RIGID_MOTIONS, self.free)
        theta, shapes = lanczos(answer, self.momentum, size, self.count + self.free, block)
        return np.append(np.zeros(x.shape[1]), 1 / theta - self.shift), np.hstack([x, shapes])

    def momentum(self, x: Block) -> Block:
        """M x."""
        out = x.copy()
        for k, (part, link) in enumerate(zip(self.of.parts, self.system.model.links, strict=True)):
            if isinstance(part, SparsePart):
                here = own(self.of, k)
                out[here] = np.stack([momentum(link, each) for each in x[here].T], axis=1)
        return out


def asked(now: Instant) -> ConstraintTerms:
    """Terms of joints, drives and force laws for a small motion about a position: laws with their tangents there."""
    z = np.zeros((3, now.of.system.unknowns))
    C, e = now.gradients(z[0]), now.coordinates(z)
    hard, stiffness = now.hard(C), now.forces(e)[:, 1]
    kept = hard | ((stiffness != 0.0) & (sizes(C) > 0.0))
    compliance = np.where(hard, 0.0, 1 / np.where(stiffness != 0.0, stiffness, 1.0))[kept]
    return ConstraintTerms(C[kept], np.zeros(len(compliance)), compliance, z[0])


def require_drive(scene: Scene, free: bool) -> None:
    """A drive, where one is to release its joint.

    Raises
    ------
    SceneError
    """
    if free and scene.driven is None:
        raise SceneError("--free: must be combined with a drive to release, got a scene without one: leave it out")


def released(scene: Scene) -> Scene:
    """The scene over the same time without its drives, which have released their joints."""
    grid = time_grid(scene)
    times = {"end_time": grid.end, "step": grid.step, "revolutions": None, "steps_per_revolution": None}
    analysis = scene.analysis.model_copy(update=times)
    return scene.model_copy(update={"drive": None, "drives": {}, "analysis": analysis})


def tangent_warning(system: System, what: str) -> tuple[str, ...]:
    """A warning that names force laws that are not linear; `what` asks."""
    bent = (
        each.name
        for each in system.constraints
        if isinstance(each.law, Stop) or ((curve := curve_of(each.law)) is not None and curve.over != TIME)
    )
    names = ", ".join(dict.fromkeys(bent))
    return (f"{what}: force laws that are not linear enter with their tangent at rest: {names}",) if names else ()


def _ready(system: System, shift: float) -> Ready:
    """A system whose bodies are factored with K0 + s M."""
    c = _shifted(system, shift)
    parts = factored(system.model.links, system.model.joints, c)
    return Ready(system, generalised_alpha(1.0, 1.0), c, parts, *as_arrays(system, parts))


def _shifted(system: System, shift: float) -> Coefficients:
    c = coefficients(generalised_alpha(1.0, 1.0), Rayleigh(0.0, 0.0), system.model.links, single=True)
    return c._replace(c_M=shift, c_K=1.0)


def _held(of: Ready, k: int) -> HeldBody:
    part = of.parts[k]
    if isinstance(part, SparsePart):
        return stepped_body(part, 1.0)
    return HeldBody(part.G, part.Y, part.Y, part.S, part.W)
