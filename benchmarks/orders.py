"""Order in time: error against work of higher-order schemes, beside generalised-α and its extrapolated levels.

The equation of five four-bars, M q'' + C q' + (K + G) q = f with M constant and all others of time, marched densely by
each scheme. Work is counted in solves of one step's matrix, of all links: what a step costs. Schemes whose stages are
coupled (Gauss, Radau) solve a matrix of twice the size, a complex pair where K is constant: four times the work at least.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg
import scipy.sparse as sp
from jaxtyping import Float

from benchmarks.pages import script, table, write_loglog, write_page
from benchmarks.scenes import DAMPED, EYE, four_bar_of
from kedfem.accuracy.reduction import prepared
from kedfem.dynamics.rigid_body import forcings
from kedfem.dynamics.stepping.monolithic import MonolithicSteps
from kedfem.dynamics.stepping.scheme import generalised_alpha
from kedfem.motion.rigid import rigid_motion
from kedfem.scene import path_parameter, scene_from

TURN, TURNS = 0.1, 2  # s
SEEN = 100  # instants of a run at which its error is examined
MOST = 51_200  # solves of a march
ASKED = (1e-2, 1e-3, 1e-4, 1e-6)
State = tuple[Float[np.ndarray, " N"], Float[np.ndarray, " N"]]
Tableau = tuple[Float[np.ndarray, "s s"], Float[np.ndarray, " s"], Float[np.ndarray, " s"]]


@dataclass(frozen=True)
class Scheme:
    """A scheme: the tableau of its stages (none: generalised-α), levels that are extrapolated."""

    name: str
    tableau: Tableau | None = None
    levels: int = 1

    @property
    def solves(self) -> int:
        """Of a step: one a stage, twice that where stages are coupled; of all levels together."""
        stages = 1 if self.tableau is None else len(self.tableau[1])
        coupled = self.tableau is not None and _coupled(self.tableau)
        levels: int = 2**self.levels - 1
        return stages * (2 if coupled else 1) * levels


def _coupled(tableau: Tableau) -> bool:
    """Whether stages depend on later ones."""
    return bool(np.triu(tableau[0], 1).any())


def _diagonal(A: list[list[float]], b: list[float]) -> Tableau:
    rows = np.zeros((len(A), len(A)))
    for k, row in enumerate(A):
        rows[k, : len(row)] = row
    return rows, np.array(b), rows.sum(axis=1)


def _suzuki() -> Tableau:
    """Five midpoint steps, the middle one backwards (M. Suzuki, Phys. Lett. A 146, 1990): order 4."""
    p = 1 / (4 - 4 ** (1 / 3))
    w = np.array([p, p, 1 - 4 * p, p, p])
    A = np.tril(np.broadcast_to(w, (5, 5)), -1) + np.diag(w / 2)
    return A, w, A.sum(axis=1)


ALEXANDER = 0.4358665215084590  # root of x³ − 3x² + 3x/2 − 1/6
CROUZEIX = np.cos(np.pi / 18) / np.sqrt(3) + 0.5
SQ3 = np.sqrt(3)
SCHEMES = (
    Scheme("generalised-α, ρ∞ = 0.95"),
    Scheme("two levels", levels=2),
    Scheme("three levels", levels=3),
    Scheme("SDIRK of order 2, L-stable", _diagonal([[1 - np.sqrt(0.5)], [np.sqrt(0.5), 1 - np.sqrt(0.5)]],
           [np.sqrt(0.5), 1 - np.sqrt(0.5)])),
    Scheme("SDIRK of order 3, L-stable (Alexander)", _diagonal(
        [[ALEXANDER], [(1 - ALEXANDER) / 2, ALEXANDER],
         [-(6 * ALEXANDER**2 - 16 * ALEXANDER + 1) / 4, (6 * ALEXANDER**2 - 20 * ALEXANDER + 5) / 4, ALEXANDER]],
        [-(6 * ALEXANDER**2 - 16 * ALEXANDER + 1) / 4, (6 * ALEXANDER**2 - 20 * ALEXANDER + 5) / 4, ALEXANDER])),
    Scheme("SDIRK of order 4, A-stable (Crouzeix)", _diagonal(
        [[CROUZEIX], [0.5 - CROUZEIX, CROUZEIX], [2 * CROUZEIX, 1 - 4 * CROUZEIX, CROUZEIX]],
        [1 / (6 * (1 - 2 * CROUZEIX) ** 2), 1 - 1 / (3 * (1 - 2 * CROUZEIX) ** 2), 1 / (6 * (1 - 2 * CROUZEIX) ** 2)])),
    Scheme("SDIRK of order 4, L-stable (Hairer and Wanner)", _diagonal(
        [[1 / 4], [1 / 2, 1 / 4], [17 / 50, -1 / 25, 1 / 4], [371 / 1360, -137 / 2720, 15 / 544, 1 / 4],
         [25 / 24, -49 / 48, 125 / 16, -85 / 12, 1 / 4]], [25 / 24, -49 / 48, 125 / 16, -85 / 12, 1 / 4])),
    Scheme("composition of five midpoint steps (Suzuki)", _suzuki()),
    Scheme("Gauss, two stages, order 4", (np.array([[1 / 4, 1 / 4 - SQ3 / 6], [1 / 4 + SQ3 / 6, 1 / 4]]),
           np.array([0.5, 0.5]), np.array([0.5 - SQ3 / 6, 0.5 + SQ3 / 6]))),
    Scheme("Radau IIA, two stages, order 3", (np.array([[5 / 12, -1 / 12], [3 / 4, 1 / 4]]),
           np.array([0.75, 0.25]), np.array([1 / 3, 1.0]))),
)  # fmt: skip


class Equation:
    """The equation of a scene with rigid-body frames whose joints share points, dense: unknowns that its joints leave."""

    def __init__(self, raw: Mapping[str, Any]) -> None:
        self.ready = prepared(scene_from(raw))[0]
        model = self.ready.model
        steps = MonolithicSteps(model.links, model.joints, generalised_alpha(1.0, 1.0), model.damping)
        self.T = steps.T.toarray()
        self.at = np.concatenate([[0], np.cumsum([link.unknowns for link in model.links])])
        parts = [self.T[a:b] for a, b in zip(self.at, self.at[1:], strict=False)]
        masses = [M.toarray() for M in steps.M]
        self.M = sum(T.T @ M @ T for T, M in zip(parts, masses, strict=True))
        K, C, G = [], [], []
        for link, M, T in zip(model.links, masses, parts, strict=True):
            K0 = link.K0.toarray() if sp.issparse(link.K0) else np.asarray(link.K0)
            C0 = model.damping.alpha * M + model.damping.beta * K0
            K += _waves(T, K0, link.d, turning=False)
            C += _waves(T, C0, link.d, turning=False)
            G += _waves(T, C0, link.d, turning=True)
        self.K, self.C, self.G = np.array(K), np.array(C), np.array(G)

    def along(self, t: Float[np.ndarray, " T"]) -> "Along":
        """What it depends on at some times."""
        ready, model = self.ready, self.ready.model
        motion = rigid_motion(ready.linkage, ready.path, t, path_parameter(ready.scene, t))
        forcing = forcings(model, motion)
        f = sum(each.F.reshape(len(t), -1) @ self.T[a:b]
                for each, a, b in zip(forcing, self.at, self.at[1:], strict=False))  # fmt: skip
        c, s = (np.stack([x.R[:, k, 0] for x in forcing], axis=1) for k in (0, 1))
        basis = np.stack([np.ones_like(c), c, s, c * c - s * s, 2 * c * s], axis=2)
        rates = motion.omega[:, list(model.bodies), 2]
        return Along(
            self, np.asarray(f), basis.reshape(len(t), -1), (rates[..., None] * basis).reshape(len(t), -1)
        )

    @cached_property
    def start(self) -> State:
        """At rest, or where the mechanism moves on without vibrating: K q = f, and its rate."""
        N = len(self.M)
        if self.ready.scene.analysis.initial == "rest":
            return np.zeros(N), np.zeros(N)
        h = 1e-4 * TURN
        along = self.along(h * np.arange(3))
        q = [np.linalg.solve(along.matrices(k)[0], along.f[k]) for k in range(3)]
        return q[0], (-3 * q[0] + 4 * q[1] - q[2]) / (2 * h)


def _waves(
    T: Float[np.ndarray, "n N"], K0: Float[np.ndarray, "n n"], d: int, turning: bool
) -> list[Float[np.ndarray, "N N"]]:
    """Tᵀ R K0 Rᵀ T of a link turned by θ, or Tᵀ R K0 (dR/dθ)ᵀ T, on 1, cos θ, sin θ, cos 2θ, sin 2θ."""
    angles = 2 * np.pi * np.arange(5) / 5
    found = []
    for a in angles:
        R, dR = np.eye(d), np.zeros((d, d))
        R[:2, :2] = [[np.cos(a), -np.sin(a)], [np.sin(a), np.cos(a)]]
        dR[:2, :2] = [[-np.sin(a), -np.cos(a)], [np.cos(a), -np.sin(a)]]
        whole, other = (scipy.linalg.block_diag(*[x] * (len(K0) // d)) for x in (R, dR if turning else R))
        found.append(T.T @ whole @ K0 @ other.T @ T)
    basis = np.stack(
        [np.ones(5), np.cos(angles), np.sin(angles), np.cos(2 * angles), np.sin(2 * angles)], axis=1
    )
    return list(np.tensordot(np.linalg.inv(basis), np.array(found), 1))


@dataclass(frozen=True)
class Along:
    """An equation at T times: f (T, N), and what K and C, and G, are composed of."""

    of: Equation
    f: Float[np.ndarray, "T N"]
    basis: Float[np.ndarray, "T b"]
    turning: Float[np.ndarray, "T b"]

    def matrices(self, k: int) -> tuple[Float[np.ndarray, "N N"], Float[np.ndarray, "N N"]]:
        """K + G and C at one of the times."""
        of = self.of
        K = np.tensordot(self.basis[k], of.K, 1) + np.tensordot(self.turning[k], of.G, 1)
        return K, np.tensordot(self.basis[k], of.C, 1)


def marched(of: Equation, scheme: Scheme, steps: int) -> Float[np.ndarray, "S N"]:
    """The displacements at `SEEN` instants after so many steps in all, with finer levels beside them."""
    if scheme.levels > 1:
        runs = [_alpha(of, steps * 2**k) for k in range(scheme.levels)]
        for order in range(1, scheme.levels):
            runs = [b + (b - a) / (4**order - 1) for a, b in pairwise(runs)]
        return runs[0]
    return _alpha(of, steps) if scheme.tableau is None else _stages(of, scheme.tableau, steps)


def _alpha(of: Equation, steps: int) -> Float[np.ndarray, "S N"]:
    """Generalised-α; M, K, C and f at the ends of a step, as the solver has them."""
    h = TURN * TURNS / steps
    s = generalised_alpha(h, 0.95)
    along = of.along(h * np.arange(steps + 1))
    (q, v), (K, C) = of.start, along.matrices(0)
    a = np.linalg.solve(of.M, along.f[0] - C @ v - K @ q)
    b0, b1, b2 = s.acceleration
    inner, out = along.f[0] - K @ q - C @ v, []
    for k in range(1, steps + 1):
        K, C = along.matrices(k)
        w, am = 1 - s.alpha_f, 1 - s.alpha_m
        rate = s.rate
        past = rate[0] * q + rate[1] * v + rate[2] * a
        right = (
            of.M @ (am * (b0 * q + b1 * v + b2 * a) - s.alpha_m * a)
            + w * (along.f[k] + C @ past)
            + s.alpha_f * inner
        )
        new = np.linalg.solve(am * s.a0 * of.M + w * (K + s.a1 * C), right)
        a_new = s.a0 * new - (b0 * q + b1 * v + b2 * a)
        v = s.a1 * new - past
        q, a = new, a_new
        inner = along.f[k] - K @ q - C @ v
        if k % (steps // SEEN) == 0:
            out.append(q)
    return np.array(out)


def _stages(of: Equation, tableau: Tableau, steps: int) -> Float[np.ndarray, "S N"]:
    """A Runge-Kutta scheme of the first-order form, q' = v."""
    A, b, c = tableau
    h, count = TURN * TURNS / steps, len(b)
    times = (np.arange(steps)[:, None] + c) * h
    along, N = of.along(np.clip(times.ravel(), 0.0, None)), len(of.M)
    q, v = of.start
    out = []
    for k in range(steps):
        V, a = np.zeros((count, N)), np.zeros((count, N))
        if _coupled(tableau):
            A2, big, right = A @ A, np.zeros((count * N, count * N)), np.zeros(count * N)
            for i in range(count):
                K, C = along.matrices(k * count + i)
                here = slice(i * N, (i + 1) * N)
                right[here] = along.f[k * count + i] - C @ v - K @ (q + h * c[i] * v)
                for j in range(count):
                    big[here, j * N : (j + 1) * N] = (
                        h * A[i, j] * C + h * h * A2[i, j] * K + (of.M if i == j else 0)
                    )
            a[:] = np.linalg.solve(big, right).reshape(count, N)
            V[:] = v + h * A @ a
        else:
            for i in range(count):
                K, C = along.matrices(k * count + i)
                g = h * A[i, i]
                w, x = v + h * A[i, :i] @ a[:i], q + h * A[i, :i] @ V[:i]
                right = along.f[k * count + i] - C @ w - K @ (x + g * w)
                a[i] = np.linalg.solve(of.M + g * C + g * g * K, right)
                V[i] = w + g * a[i]
        q, v = q + h * b @ V, v + h * b @ a
        if (k + 1) % (steps // SEEN) == 0:
            out.append(q)
    return np.array(out)


def error(of: Equation, found: Float[np.ndarray, "S N"], truth: Float[np.ndarray, "S N"]) -> float:
    """Largest error in time in the norm of strain energy, of its largest value."""
    t = TURN * TURNS / SEEN * np.arange(1, SEEN + 1)
    K = np.tensordot(of.along(t).basis, of.K, 1)
    size = np.sqrt(np.einsum("ti,tij,tj->t", truth, K, truth)).max()
    off = found - truth
    with np.errstate(over="ignore", invalid="ignore"):
        e = np.sqrt(np.abs(np.einsum("ti,tij,tj->t", off, K, off))).max() / size
    return float(e) if np.isfinite(e) else np.inf


def scene(damped: bool, start: str, **more: Any) -> dict[str, Any]:
    """The source's four-bar at 600 rpm."""
    plates = more.pop("plates", False)
    shape = {"kind": "plate_link", **EYE} if plates else {"kind": "bar", "width": 0.0254, "thickness": 0.0254}
    raw = four_bar_of(shape, {"reduction": 8} if plates else {"model": "beam", "mesh": {"elements": 1}})
    raw["points"]["B"]["angle"] = "60 deg" if plates else 0
    if damped:
        raw["damping"] = DAMPED
    raw["analysis"] = {
        "end_time": TURNS * TURN, "step": TURN / 1000, "accuracy": "quick", "initial": start, "frames": "rigid-body"
    }  # fmt: skip
    return {**raw, **more}


PUSH = {"kind": "force", "link": "rocker", "at": {"between": ["C", "D"]}, "vector": [200.0, 0]}
CORNERS = {"over": "angle", "at": [0.0, 0.7, 1.9, 2.3], "value": [0.0, 1.0, -1.0, 0.0], "period": "360 deg"}
SCENES: dict[str, Callable[[], dict[str, Any]]] = {
    "beams, 2 % damping, quasi-static start": lambda: scene(True, "quasi-static"),
    "beams, 2 % damping, from rest": lambda: scene(True, "rest"),
    "beams, undamped, from rest": lambda: scene(False, "rest"),
    "plates reduced to 8 modes, 2 % damping, quasi-static start": lambda: scene(True, "quasi-static", plates=True),
    "beams, 2 % damping, a load with corners on the rocker": lambda: scene(
        True, "quasi-static",
        loads={"p": {**PUSH, "factor": CORNERS}},
    ),
}  # fmt: skip


def bench_orders(folder: Path, quick: bool) -> None:
    """Solves a turn that each scheme needs for an error, by scene."""
    tables, drawn = [], {}
    for name, raw in list(SCENES.items())[: 1 if quick else None]:
        of = Equation(raw())
        most = MOST // 16 if quick else MOST
        truth = marched(of, Scheme("", levels=3), most // 7 // SEEN * SEEN * 2)
        rows = []
        for scheme in SCHEMES:
            work, errors, steps = [], [], 2 * SEEN
            while steps * scheme.solves <= most // 2:
                work.append(steps * scheme.solves / TURNS)
                errors.append(error(of, marched(of, scheme, steps), truth))
                steps *= 2
            rows.append((scheme.name, *(_needed(work, errors, asked) for asked in ASKED)))
            if name == next(iter(SCENES)):
                drawn[scheme.name] = (work, errors)
        tables.append(table(("solves a turn for an error of", *(f"{100 * x:g} %" for x in ASKED)), rows))
    write_page(folder, "performance/orders", tables)
    write_loglog(folder, "orders", drawn, ("solves a turn", "error"))


def _needed(work: list[float], errors: list[float], asked: float) -> str:
    """Work for an error, between the marches beside it; the last march whose error is larger counts."""
    above = max((k for k, e in enumerate(errors) if not e <= asked), default=None)
    if above is None:
        return f"< {work[0]:,.0f}"
    if above == len(work) - 1:
        return f"> {work[-1]:,.0f}"
    (w0, w1), (e0, e1) = work[above : above + 2], errors[above : above + 2]
    if not np.isfinite(e0):
        return f"{w1:,.0f}"
    return f"{np.exp(np.interp(np.log(1 / asked), np.log([1 / e0, 1 / e1]), np.log([w0, w1]))):,.0f}"


if __name__ == "__main__":
    script(bench_orders)
