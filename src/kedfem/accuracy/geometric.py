"""The geometric error of the linear equation, estimated from the deflections of a run.

Equation (20) rotates K with the rigid-body motion, which neglects three effects:

* **Axial forces.** An axial force N has a transverse component on a link whose elastic rotation is ψ. It changes the
  stiffness against the deflection by the share

      e = ∫ N ψ² ds / 2V,     V = ½ gᵀ K0 g the strain energy,

  the Rayleigh quotient of the geometric and the elastic stiffness for the link's actual deflection: N L²/(π² E I) for a
  strut that bends between its ends, in general N over the buckling load in that shape. Length, section and end
  conditions need not be known, so that it applies to links of every kind.
* **Large rotations.** Where N vanishes, as under a transverse force on a cantilever, the error is of second order,
  c ψ².
* **Directions of slides.** A body that slides along an elastic link is constrained across the link's rigid-body
  direction, not across the bent link, whose direction differs by ψ: displacements, joint forces and efforts err by ψ,
  which is of first order. Stiffening does not include the rotation of these forces with the bent link, nor the forces
  of joint limits, so that it is not taken to reduce the error there.

All links are counted together, because the force of a joint acts on both of its links, with the largest sums over time.
The factor of e, 3, was measured on the four-bar of [KED] (docs/theory/errors.md). A part of 1 is the change of stiffness
itself; the rest is the change of the joint forces, which deflected links transmit, and the phase shift by a changed
stiffness. A single arm has neither, and the estimate is then up to four times too large. c is that of the elastica
under a transverse load at its tip.

N follows from the forces beyond a cut: port forces and P − M R0'' − M δ''. ψ is the slope of the line through the mean
displacements of slices across the link's axis. Both need scalar weights only.
"""

from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.dynamics.history import Block, LinkHistory
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.ports import rotated_vectors
from kedfem.dynamics.model import Model
from kedfem.links.record import Link, in_space
from kedfem.motion.rigid import RigidMotion

SLICES = 8  # of a link along its axis, if it has so many nodes
SAME = 1e-6  # of a slice's length: distance along the link within which nodes are in one cross-section
APART = 0.5  # of a slice's length: least distance of middles; slopes over less would show rounding or warping
INSTANTS = 256  # of a block that are examined
AXIAL = 3.0  # error of the peak stress over e, measured
TURN = 0.4  # error over ψ²: elastica under a transverse tip load, 0.42 for its deflection, 0.24 for the root stress
STIFFENED = 0.4  # share of the error that geometric stiffening leaves: 0.25 to 0.4, measured
LARGE = 0.02  # error above which a run warns
MODERATE = 0.15  # error up to which stiffening helps


@dataclass(frozen=True, slots=True)
class Slices:
    """A link cut across its axis; k slices, k − 1 cuts between them.

    axis : (3,) along the link in the reference position
    means : (k, n) weights of the mean displacement of each slice [-]
    beyond : (k − 1, n) weights of the sum of nodal forces beyond each cut [-]
    mass : (k − 1, n) the same for M u [kg]
    mended : (k − 1, 4) what `beyond` lacks of −M (1 ⊗ p'' + X R''ᵀ) with few modes [kg, kg m]
    ports : (k − 1, p) 1 for each port beyond a cut
    gaps, lengths : (k − 1,) distances of the slices' middles; the same, but up to the ends of the link [m]
    """

    axis: Float[np.ndarray, "3"]
    means: Float[np.ndarray, "k n"]
    beyond: Float[np.ndarray, "c n"]
    mass: Float[np.ndarray, "c n"]
    mended: Float[np.ndarray, "c 4"]
    ports: Float[np.ndarray, "c p"]
    gaps: Float[np.ndarray, " c"]
    lengths: Float[np.ndarray, " c"]


def slices(link: Link, joint: Attachment) -> Slices:
    """A link cut between its nodes into slices of about equal length, whose middles are well apart.

    Nodes whose places along the link differ by rounding are one cross-section, which is not cut.
    """
    full, axis = link.full or link, link.axes[:, 0]
    nodes = np.flatnonzero(full.one)
    s = full.X[nodes] @ axis
    of = _numbers(s)
    inside = np.zeros((of.max() + 1, full.n))
    inside[of, nodes] = 1.0
    means = inside / inside.sum(axis=1, keepdims=True)
    middles = means[:, nodes] @ s
    chosen = np.cumsum(inside[::-1], axis=0)[::-1][1:]
    cuts = (middles[1:] + middles[:-1]) / 2
    bounds = np.concatenate([[s.min()], middles[1:-1], [s.max()]])
    ports = (joint.weights @ link.X[joint.nodes]) @ axis
    beyond = chosen if link.Q is None else _projected(full, link.Q, chosen)
    mended = beyond @ _inertia(link) - chosen @ _inertia(full)
    return Slices(
        axis, means if link.Q is None else means @ link.Q, beyond, (link.mass[0] @ beyond.T).T, mended,
        (ports > cuts[:, None]).astype(float), np.diff(middles), np.diff(bounds),
    )  # fmt: skip


def _numbers(s: Float[np.ndarray, " k"]) -> Int[np.ndarray, " k"]:
    """The slice of each node, by its place along the link; a slice too near to the previous one is merged with it."""
    length = float(np.ptp(s)) or 1.0
    of = np.clip(np.floor(SLICES * (s - s.min()) / length + SAME).astype(int), 0, SLICES - 1)
    used, of = np.unique(of, return_inverse=True)
    middles = np.bincount(of, s) / np.bincount(of)
    first = [0]
    for k in range(1, len(used)):
        if middles[k] - middles[first[-1]] >= APART * length / SLICES:
            first.append(k)
    return np.asarray(np.searchsorted(first, of, side="right") - 1)


@dataclass
class GeometricError:
    """Largest sums over time, block by block, over links with rigid-body frames; only these have this error.

    stiffened : whether geometric stiffening is included
    stopped : whether joints have limits
    axial : ∫ N ψ² ds of these links [J]
    strain : their strain energy [J]
    turn : largest ψ of any slice [rad]
    slid : the same for links along which others slide [rad]
    """

    model: Model
    stiffened: bool = False
    stopped: bool = False
    axial: float = 0.0
    strain: float = 0.0
    turn: float = 0.0
    slid: float = 0.0
    _of: list[Slices | None] = field(default_factory=list, repr=False)
    _slides: list[tuple[str, int]] = field(default_factory=list, repr=False)
    REMEMBERED: ClassVar = ("axial", "strain", "turn", "slid")

    def __post_init__(self) -> None:
        self._slides = slides(self.model)
        joined = zip(self.model.links, self.model.joints, strict=True)
        self._of = [slices(link, joint) if link.fit is None else None for link, joint in joined]

    def add(self, block: Block) -> None:
        """Evaluate some time points of a block."""
        both = zip(self._of, block.links, strict=True)
        strains = [history.strain for of, history in both if of is not None]
        if not strains:
            return
        self.strain = max(self.strain, float(np.sum(strains, axis=0).max()))
        some, axial = block.chosen(slice(None, None, max(1, len(block) // INSTANTS))), np.zeros(1)
        guides = {body for _, body in self._slides}
        model = self.model
        joined = zip(model.links, model.joints, model.bodies, some.links, self._of, strict=True)
        for link, joint, body, history, of in joined:
            if of is not None:
                turned = (slopes(link, of, history, some.motion.R[:, body]) ** 2).sum(axis=2)
                N = axial_forces(link, joint, of, history, some.motion, body)
                axial = axial + (N * turned) @ of.lengths
                turn = float(np.sqrt(turned.max(initial=0.0)))
                self.turn = max(self.turn, turn)
                self.slid = max(self.slid, turn * (body in guides))
        self.axial = max(self.axial, float(np.abs(axial).max()))

    @property
    def estimate(self) -> float:
        """Estimated error relative to the peak stress."""
        share = self.axial / (2 * self.strain) if self.strain else 0.0
        error = AXIAL * share + TURN * self.turn**2
        known = self.stiffened and not self._slides and not self.stopped
        return STIFFENED * error if known else error

    @property
    def worst(self) -> float:
        """Largest relative error of any quantity, including displacements and joint forces at slides."""
        return self.estimate + self.slid

    @property
    def sliding(self) -> tuple[str, ...]:
        """Joints that slide along bent links, if they cause most of the error."""
        most = self.slid > self.estimate
        return tuple(dict.fromkeys(f"joints.{name}" for name, _ in self._slides)) if most else ()


def slides(model: Model) -> list[tuple[str, int]]:
    """Joints that constrain some but not all directions of an elastic link, and the link's number in the linkage."""
    found = []
    for row in model.rows:
        if row.sides[1] is not None:
            planar = model.links[model.bodies.index(row.bodies[1])].planar
            gap, turn = row.along
            across = np.linalg.matrix_rank(gap[~turn.any(axis=1)])
            found += [(row.name, row.bodies[1])] if 0 < across < (2 if planar else 3) else []
    return found


def slopes(link: Link, of: Slices, history: LinkHistory, R: Float[np.ndarray, "T 3 3"]) -> Float[np.ndarray, "T c 3"]:
    """ψ between slices: the elastic rotation of the link's line from its rigid-body direction [rad]."""
    along = (R @ of.axis)[:, None]
    change = np.diff(in_space(link, of.means @ history.u), axis=1)
    across = change - (change * along).sum(axis=2, keepdims=True) * along
    return np.asarray(across / of.gaps[:, None])


def axial_forces(
    link: Link, joint: Attachment, of: Slices, history: LinkHistory, motion: RigidMotion, body: int
) -> Float[np.ndarray, "T c"]:
    """N at each cut, tension positive: the axial part of P − M R0'' − M δ'' and of the port forces beyond it [N]."""
    affine = np.concatenate([motion.p2[:, body, None], motion.R2[:, body].transpose(0, 2, 1)], axis=1)
    force = in_space(link, of.beyond @ history.F - of.mass @ history.a) + of.mended @ affine
    force += of.ports @ in_space(link, rotated_vectors(joint, history.R, history.port_forces))
    return np.asarray((force @ (motion.R[:, body] @ of.axis)[:, :, None])[:, :, 0])


def geometric_warning(found: GeometricError) -> tuple[str, ...]:
    """A warning if the linear equation is not sufficient, with the remedy."""
    error = found.worst
    if error < LARGE:
        return ()
    of = "displacements and joint forces" if found.sliding else "the peak stress"
    return (
        f"{bent(found)}, which the linear equation assumes to be small: its error is about "
        f"{float(f'{100 * min(error, 1.0):.2g}'):g} % of {of}{' or more' if error > 1 else ''}; {_remedy(found, error)}",
    )


def bent(found: GeometricError) -> str:
    """Elastic rotation of links in words, with the slides whose direction neglects it."""
    names = found.sliding
    verb = "slides" if len(names) == 1 else "slide"
    sliding = f" ({', '.join(names)} {verb} along the undeformed link)" if names else ""
    return f"the elastic rotation of links is up to {np.degrees(found.turn):.2g} deg{sliding}"


def _remedy(found: GeometricError, error: float) -> str:
    """The remedy if the linear equation is not sufficient."""
    corotational = 'analysis.frames = "co-rotational"'
    if error >= MODERATE:
        return f"take {corotational}, which is right at any deflection"
    known = found.stiffened or found.sliding  # stiffening is on already, or does not help slides
    stiffening = "" if known else "analysis.stiffening = true leaves about a third of it, "
    return f"{stiffening}{corotational} is right at any deflection"


def _projected(full: Link, Q: Float[np.ndarray, "n s"], chosen: Float[np.ndarray, "c n"]) -> Float[np.ndarray, "c s"]:
    """Coefficients of modes Q that fit weights of nodes best, weighted by the volume of each function."""
    share = np.sqrt(_volumes(full))[:, None]
    return np.asarray(np.linalg.lstsq(share * Q, share * chosen.T, rcond=None)[0].T)


def _volumes(full: Link) -> Float[np.ndarray, " n"]:
    """Volume of each function; for slopes, whose ∫ N_a dV vanishes, times the section's squared radius of gyration."""
    own = full.one != 0
    volume = np.asarray(np.abs(full.volume[own])[np.cumsum(own) - 1])
    if full.section is None:
        return volume
    radius = (full.section.second_moment + full.section.second_moment_z) / (2 * full.section.area)
    return np.asarray(np.where(own, volume, radius * volume))


def _inertia(link: Link) -> Float[np.ndarray, "n 4"]:
    """m [1, X]; its negative times p'' and R''ᵀ is −M (1 ⊗ p'' + X R''ᵀ)."""
    return np.column_stack([link.m1[:, 0], link.mX])
