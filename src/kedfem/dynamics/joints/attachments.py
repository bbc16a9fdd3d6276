"""Attachments of links to the interface: the port weights of one link, and joints that share an interface point."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.sparse as sp

from kedfem.arrays import Float, Int


@dataclass(frozen=True, slots=True)
class Attachment:
    """One link's share in the joints.

    nodes, weights : (b,) and (p, b): scalar port weights W of the nodes that carry any
    components : d of the link
    points : (p, 3) interface points, reference position [m]
    joints : (p,) name of each port's joint
    keep : (q,) which of the flattened (p, d) components are held; closed under the link's rotation; independent:
        what other ports of the link imply is left out
    columns, B : (c,) interface unknowns that the link has a share in, few of all, and (q, c): held components, in world
        axes, from these
    unknowns : k of all z
    shares : (dp, Σ q): forces at all ports of this link, world axes, from the λ of all links in world axes; sparse, as
        the next two
    from_rows : (dp, m): the same from the forces that rows of joints exert on their links' ports, world axes; m all
        components of all these ports, and empty where λ alone shows the forces
    loose : (dp, r) port forces of this link, world axes, that neither determines: statically indeterminate
    """

    nodes: Int[np.ndarray, " b"]
    weights: Float[np.ndarray, "p b"]
    components: int
    points: Float[np.ndarray, "p 3"]
    joints: tuple[str, ...]
    keep: Int[np.ndarray, " q"]
    columns: Int[np.ndarray, " c"]
    B: Float[np.ndarray, "q c"]
    unknowns: int
    shares: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))
    from_rows: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))
    loose: sp.csr_array = field(default_factory=lambda: sp.csr_array((0, 0)))


def used_columns(matrix: sp.csr_array) -> tuple[Int[np.ndarray, " c"], Float[np.ndarray, "r c"]]:
    """The columns that a matrix uses, and the matrix on them, dense."""
    columns = np.unique(matrix.indices[matrix.data != 0.0])
    return columns, matrix[:, columns].toarray()


def interface_matrix(joints: Sequence[Attachment]) -> sp.csr_array:
    """B of all links, one below the other, on all interface unknowns."""
    width = np.concatenate([np.full(len(joint.B), len(joint.columns)) for joint in joints])
    columns = np.concatenate([np.tile(joint.columns, len(joint.B)) for joint in joints])
    values = np.concatenate([joint.B.ravel() for joint in joints])
    return sp.csr_array((values, columns, np.append(0, np.cumsum(width))), (len(width), joints[0].unknowns))


@dataclass(frozen=True, slots=True)
class SharedCut:
    """The cut between two segments of a link: their keys, its points (k, 3) and each one's weights (k, n).

    uneven : facets of each where the link is no prism around the cut, so that stresses there are not those of the whole
    """

    keys: tuple[str, str]
    points: Float[np.ndarray, "k 3"]
    weights: tuple[Float[np.ndarray, "k _"], Float[np.ndarray, "k _"]]
    uneven: tuple[Int[np.ndarray, " f"], ...] = ()
