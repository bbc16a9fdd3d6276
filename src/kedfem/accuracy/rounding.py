"""The error by rounding: the forces that each link's matrices exert in a rigid motion, which should be zero.

A link that is much stiffer than its neighbours moves nearly as a rigid body. Its stiffness times that motion is zero only
up to rounding: the residual of about eps |K0| |δ| is an unbalanced force that grows with the stiffness, while the forces
of the linkage do not. Most of it comes from the stiffness condensed onto ports, which the condensed step uses,

    S W Φ − c_M Yᵀ M Φ        zero up to rounding, Φ the rigid motions of the link with K0 Φ = 0

For the monolithic solver it is K0 Φ. Both are computed once at the beginning of a run and multiplied with the link's
rigid motion at each time. The estimate is the largest product over the largest force at a port.

Co-rotational frames first remove the rigid motion up to eps times the displacement of the link's points. That remainder
acts as a deformation; max |S| times it is the force.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from kedfem.accuracy.error_budget import Share
from kedfem.arrays import Float
from kedfem.dynamics.history import Block
from kedfem.dynamics.matrices.dense import coordinates
from kedfem.dynamics.model import Model
from kedfem.dynamics.system.arrays import Coefficients
from kedfem.dynamics.system.sparse import Part, SparsePart, momentum
from kedfem.dynamics.system.steps import Steps
from kedfem.links.record import Link, in_space, mass_times
from kedfem.links.reduced import rigid_modes
from kedfem.results import Peak

REPORTED = 1e-5  # relative force above which it is reported; scenes of equally stiff links have 1e-9
LEFT = {"beam": 1.0, "plane": 4.0, "solid": 4.0, "spatial_beam": 4.0}
"""Factors on the residual of S; errors of scenes of two or four links are a tenth to ten times that (test_rounding)."""
# factor on the residual of K0: the factor of the monolithic solver loses more than its matrix (measured, 5 to 17)
NODAL = 8.0
IDLE = "no link is stressed at all: the scene has no gravity, load, spring or acceleration that acts on them"
#: of the least E: more than rounding without loads (3e-14), less than the stress of a grain by its weight
UNSTRESSED = 1e-12
FOLLOWED = {"beam": 4.0, "plane": 4.0, "solid": 3.0, "spatial_beam": 0.5}
"""Factors on eps · size · max |S| of co-rotational links; errors are a tenth to four times that (test_rounding)."""
EPSILON = float(np.finfo(float).eps)
INSTANTS = 64  # of a block that are examined


def rigid_part(link: Link) -> Float[np.ndarray, "r N"]:
    """The projection that removes rigid motions from a state, orthogonal in the mass norm."""
    flat = rigid_modes(link)
    weighed = [mass_times(link.mass, x.reshape(link.n, link.d)).ravel() for x in np.ascontiguousarray(flat.T)]
    return np.asarray(np.linalg.pinv(np.stack(weighed) @ flat) @ np.stack(weighed))


def condensed_defect(link: Link, part: Part, c: Coefficients) -> Float[np.ndarray, "q r"]:
    """Residual forces at ports (q, r) of a link's condensed stiffness in its rigid motions [N/m, N/rad]."""
    out = []
    for motion in rigid_modes(link).T.reshape(-1, link.n, link.d):
        if isinstance(part, SparsePart):
            x = motion.T.ravel()
            Mx = momentum(link, x)
        else:
            x = Mx = coordinates(link, part, motion).ravel()
        out.append((part.S @ (part.W @ x) - c.c_M * (part.Y.T @ Mx)) / c.c_K)
    return np.stack(out, axis=1)


def nodal_defect(link: Link) -> Float[np.ndarray, "r r"]:
    """Norms, on a diagonal (r, r), of the residual nodal forces of K0 in a link's rigid motions [N/m, N/rad]."""
    forces = (link.K0 @ rigid_modes(link)).reshape(link.n, link.d, -1)
    forces = np.moveaxis(in_space(link, np.moveaxis(forces, 2, 0)), 0, 2)
    return np.diag(np.sqrt((forces**2).sum(axis=(0, 1))))


@dataclass
class Rounding:
    """The residual force of rigid motions of each link, and its largest value so far [N].

    defects, parts : residual forces and projections onto rigid motions, for links with rigid-body frames; else None
    stiffest : (L,) FOLLOWED · max |S| of co-rotational links, else 0 [N/m, N/rad]
    forces : (L,) largest residual force of each link [N]
    largest : largest force at any port of any link [N]
    """

    model: Model
    defects: list[Float[np.ndarray, "_ r"] | None]
    parts: list[Float[np.ndarray, "r _"] | None]
    stiffest: Float[np.ndarray, " L"]
    forces: Float[np.ndarray, " L"]
    largest: float = 0.0
    REMEMBERED: ClassVar = ("forces", "largest")

    @classmethod
    def of(cls, model: Model, solvers: Sequence[Steps]) -> "Rounding":
        """The record for the links of a model, as its solver factored them."""
        first = solvers[0] if solvers else None
        stiffest = np.zeros(len(model.links))
        if first is not None and first.corotational:
            ready = first.ready
            for k, (part, link) in enumerate(zip(ready.parts, model.links, strict=True)):
                if not link.rigid:
                    stiffest[k] = FOLLOWED[link.kind] * np.abs(part.S).max(initial=0.0) / ready.c.c_K
        solver = None if first is None or first.corotational or first.monolithic is not None else first
        defects: list[np.ndarray | None] = []
        for k, link in enumerate(model.links):
            if link.fit is not None or link.rigid:
                defects.append(None)
            elif solver is not None:
                left = condensed_defect(link, solver.ready.parts[k], solver.ready.c)
                defects.append(LEFT[link.kind] * left)
            else:
                defects.append(NODAL * nodal_defect(link))
        every = zip(defects, model.links, strict=True)
        parts = [None if x is None else rigid_part(link) for x, link in every]
        return cls(model, defects, parts, stiffest, np.zeros(len(model.links)))

    def add(self, block: Block) -> None:
        """Evaluate the steps of a block."""
        some = slice(None, None, max(1, len(block) // INSTANTS))
        for k, (defect, part) in enumerate(zip(self.defects, self.parts, strict=True)):
            history = block.links[k]
            self.largest = max(self.largest, float(np.abs(history.port_forces).max(initial=0.0)))
            if self.stiffest[k]:
                reach = max(self.model.links[k].size, float(np.abs(history.u).max(initial=0.0)))
                self.forces[k] = max(self.forces[k], EPSILON * reach * self.stiffest[k])
            if defect is None or part is None or not defect.size:
                continue
            g = history.g[some]
            left = np.abs(g.reshape(len(g), -1) @ part.T) @ np.abs(defect).T
            self.forces[k] = max(self.forces[k], float(left.max(initial=0.0)))

    @property
    def relative(self) -> float:
        """The largest residual force, relative to the largest force at a port [-]."""
        return float(self.forces.max(initial=0.0)) / self.largest if self.largest else 0.0

    def share(self, kinds: Sequence[str]) -> Share | None:
        """Its share of the error; None if it is negligible."""
        if not self.relative > REPORTED:
            return None
        link = self.model.links[int(self.forces.argmax())].name
        how = f"link {link} is so stiff compared with its neighbours that rounding in its rigid motion acts as strain"
        remedy = f'{how}; take model = "rigid" for it, or its true stiffness and larger elements'
        return Share("rounding", dict.fromkeys(kinds, self.relative), remedy)


def unstressed(model: Model, peak: Peak | None) -> bool:
    """Whether the highest stress of a run is rounding by the modulus of its softest link, because nothing acts on it."""
    softest = min((link.E for link in model.links if not link.rigid), default=0.0)
    return peak is not None and peak.stress <= UNSTRESSED * softest
