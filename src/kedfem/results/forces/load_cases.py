"""The load case of one link at an instant: forces at its nodes in link axes, for a static analysis.

In the link's axes the general equation, [KED, eq. (20)], is one of statics:

    K0 g = Wᵀ λ (joints) + P (loads) − M R0'' (rigid motion) − M δ'' (elastic motion) − C0 g' (damping)

so a static analysis of the link under the right-hand side gives g, less a rigid motion, and the stresses of the run.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float
from kedfem.dynamics.history import LinkMoment, Snapshot
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.ports import port_vectors
from kedfem.dynamics.loads import applied
from kedfem.dynamics.matrices.cholesky import Cholesky
from kedfem.dynamics.model import Model
from kedfem.dynamics.stepping.state import Rayleigh
from kedfem.errors import SolveError
from kedfem.links.record import Link, mass_times
from kedfem.links.recovery import nodal_state, nodal_stress, rotated_stress, stress_recovery, von_mises
from kedfem.vectors import cross

Forces = Float[np.ndarray, "n 3"]
LOADS, RIGID, ELASTIC, DAMPING, ELEMENTS = (
    "applied loads", "inertia of the rigid motion", "inertia of the elastic motion", "damping", "force elements",
)  # fmt: skip
NOTHING = 1e-9  # of the largest force: rounding


@dataclass(frozen=True, slots=True)
class LoadCase:
    """A link at an instant; all in its axes: the world's in the reference position.

    time, angle : [s]; drive angle [rad] or travel [m]
    parts : (n, 3) forces at the nodes by what exerts them [N]
    displacement : (n, 3) elastic displacement g of the run [m]
    acceleration : (n, 3) of the nodes, rigid and elastic motion together [m/s²]
    stress : (n, 6) xx, yy, zz, xy, yz, zx of the run [Pa]
    von_mises : (n,) [Pa]
    static_von_mises : (n,) that linear statics under all forces has, found as the run's is [Pa]
    """

    time: float
    angle: float
    parts: Mapping[str, Forces]
    displacement: Forces
    acceleration: Forces
    stress: Float[np.ndarray, "n 6"]
    von_mises: Float[np.ndarray, " n"]
    static_von_mises: Float[np.ndarray, " n"]

    @property
    def total(self) -> Forces:
        """(n, 3) all forces together [N]."""
        return np.asarray(sum(self.parts.values(), np.zeros_like(self.displacement)))

    @property
    def differs(self) -> float:
        """Largest difference between the run's von Mises stresses and those of statics, of the largest of both [-]."""
        largest = max(self.von_mises.max(), self.static_von_mises.max())
        return float(np.abs(self.von_mises - self.static_von_mises).max() / largest) if largest else 0.0


class Statics:
    """Linear statics of one link, factored once.

    held : six (node, component) that hold it
    """

    def __init__(self, link: Link, held: Sequence[tuple[int, int]]) -> None:
        self.link, self.recovery = link, stress_recovery(link)
        self.free = np.setdiff1d(np.arange(link.unknowns), [3 * node + component for node, component in held])
        K = sp.csr_array(link.K0)[self.free][:, self.free]
        self.factor = Cholesky(sp.csr_array(K), f"links.{link.name}")

    def stress(self, forces: Forces) -> Float[np.ndarray, "n 6"]:
        """Stresses at the nodes under forces there, in the link's own axes [Pa]."""
        g = np.zeros(self.link.unknowns)
        g[self.free] = self.factor.solve(forces.ravel()[self.free])
        return nodal_stress(self.recovery, g.reshape(forces.shape))


def load_case(at: Snapshot, k: int, model: Model, full: Model, statics: Statics) -> LoadCase:
    """The k-th link of a model at an instant.

    Parameters
    ----------
    at : of a run with rigid-body frames
    full : the same model with all links unreduced
    statics : of the unreduced link

    Raises
    ------
    SolveError
        Force elements act on a reduced link: where on its nodes is not known.
    """
    link, body, now = full.links[k], model.bodies[k], at.states[k]
    R = at.motion.R[at.k, body]
    motion = at.motion.part(at.k, at.k + 1)
    rigid = applied(link, (), motion, body)[0] @ R
    outer = applied(link, full.loads[k], motion, body)[0] @ R
    a = nodal_state(model.links[k], now.a)
    parts = _joint_forces(full.joints[k], link.n, now) | {
        LOADS: outer - rigid,
        RIGID: rigid,
        ELASTIC: -mass_times(link.mass, a) @ R,
        DAMPING: -_damping(model.links[k], link, model.damping, now, at.motion.omega[at.k, body]),
        ELEMENTS: _force_elements(model, k, at, now),
    }
    largest = max(float(np.abs(x).max(initial=0.0)) for x in parts.values())
    parts = {name: x for name, x in parts.items() if np.abs(x).max(initial=0.0) > NOTHING * largest}
    g = nodal_state(model.links[k], now.g)
    stress = rotated_stress(nodal_stress(statics.recovery, g), link.axes)
    acceleration = (at.motion.p2[at.k, body] + link.X @ at.motion.R2[at.k, body].T + a) @ R
    total = np.asarray(sum(parts.values(), np.zeros((link.n, 3))))
    again = von_mises(statics.stress(total))
    return LoadCase(at.t, at.phi, parts, g, acceleration, stress, von_mises(stress), again)


def _joint_forces(joint: Attachment, n: int, now: LinkMoment) -> dict[str, Forces]:
    """Wᵀ λ of each joint; of all together where several share a coupling surface."""
    at_ports = port_vectors(joint, now.port_forces)
    # no port is left out as redundant: each joint has all of its own
    whole = bool((np.bincount(joint.keep // joint.components, minlength=len(joint.weights)) > 0).all())
    apart = whole and not (joint.loose.nnz or joint.from_rows.nnz)
    names = list(dict.fromkeys(joint.joints))
    out: dict[str, Forces] = {}
    for name in names if apart else ["s"] * bool(names):
        here = [not apart or name == each for each in joint.joints]
        nodal = np.zeros((n, joint.components))
        nodal[joint.nodes] = joint.weights[here].T @ at_ports[here]
        out[f"joint {name}" if apart else f"joints {', '.join(names)}"] = nodal
    return out


def _damping(link: Link, full: Link, of: Rayleigh, now: LinkMoment, omega: Float[np.ndarray, "3"]) -> Forces:
    """C0 g' with g' = Rᵀ (δ' − ω × δ), on the nodes of the unreduced link."""
    if not of.present:
        return np.zeros((full.n, 3))
    rate = nodal_state(link, (now.v - cross(omega, now.u)) @ now.R)
    elastic = (full.K0 @ rate.ravel()).reshape(rate.shape)
    return np.asarray(of.alpha * mass_times(full.mass, rate) + of.beta * elastic)


def _force_elements(model: Model, k: int, at: Snapshot, now: LinkMoment) -> Forces:
    """Forces of springs, motors and limits: the link's forces without loads and inertia."""
    link = model.links[k]
    motion = at.motion.part(at.k, at.k + 1)
    left = now.F - applied(link, model.loads[k], motion, model.bodies[k])[0]
    if np.abs(left).max(initial=0.0) <= 1e-9 * np.abs(now.F).max(initial=0.0):
        return np.zeros(((link.full or link).n, 3))
    if link.full is not None:
        raise SolveError(
            f"links.{link.name}: must not be reduced where springs, motors or limits act on it (its modes do not "
            "determine at which nodes), got a reduced link: take reduction = 'none' for its load cases"
        )
    return np.asarray(left @ now.R)
