"""Independent parts of a linkage: closed loops that share a joint, and single joints.

Relative motions at the joints of a tree are independent, so constraints lose rank only within parts whose bodies
are connected by closed loops: the biconnected components of the graph of bodies and constraints. The rank of all
constraints is the sum of the parts' ranks.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import scipy.sparse as sp
from scipy.sparse.csgraph import breadth_first_order, connected_components

from kedfem.arrays import Float, Int
from kedfem.motion.constraints import Rows
from kedfem.motion.released_motions import rank
from kedfem.motion.values import Poses, features, jacobian


@dataclass(frozen=True, slots=True)
class Part:
    """Bodies of an independent part, and the constraints between them.

    bodies : numbers in the linkage
    rows : its constraints, between bodies as numbered here
    closed : whether its bodies are connected by closed loops instead of a single joint
    """

    bodies: Int[np.ndarray, " b"]
    rows: Rows
    closed: bool

    @property
    def freedoms(self) -> int:
        """Degrees of freedom of its bodies relative to the first, without constraints."""
        return 6 * (len(self.bodies) - 1)

    def rank(self, poses: Poses, size: float) -> int:
        """Number of its independent constraints at one instant."""
        return rank(self.jacobian(poses, size)[0])

    def jacobian(self, poses: Poses, size: float) -> Float[np.ndarray, "T m k"]:
        """Scaled derivatives of its constraints at poses of all the linkage's bodies, as `values.jacobian` has them."""
        mine = poses[0][:, self.bodies], poses[1][:, self.bodies]
        return jacobian(self.rows, features(self.rows, mine), len(self.bodies), size)


def parts(rows: Rows, joints: Sequence[str], bodies: int) -> Iterator[Part]:
    """The independent parts of a linkage, also single joints.

    Parameters
    ----------
    joints : joint of each constraint
    """
    of_row = [{int(rows.i[k]), int(rows.j[k])} for k in range(rows.count)]
    for k, other, _ in rows.plus:
        of_row[k] |= {int(rows.i[other]), int(rows.j[other])}
    edges = sorted({pair for each in of_row for pair in combinations(sorted(each), 2)})
    part_of = dict(zip(edges, _in_common_loops(edges, bodies), strict=True))
    # all pairs of a constraint's bodies are in one part, as three pairs or more are a loop
    firsts = [(min(each), min(each - {min(each)}, default=-1)) for each in of_row]
    of = np.array([part_of.get(pair, -1) for pair in firsts], int)
    for part in range(of.max(initial=-1) + 1):
        which = np.flatnonzero(of == part)
        own = np.array(sorted(set().union(*(of_row[k] for k in which))), int)
        here, _ = rows.part(which)
        i, j = np.searchsorted(own, here.i), np.searchsorted(own, here.j)
        yield Part(own, replace(here, i=i, j=j), len({joints[int(k)] for k in which}) > 1)


def _in_common_loops(edges: list[tuple[int, int]], bodies: int) -> Int[np.ndarray, " e"]:
    """A number for each edge, the same for those that closed loops have in common."""
    number = {edge: k for k, edge in enumerate(edges)}
    i, j = np.array(edges, int).reshape(-1, 2).T
    graph = sp.coo_array((np.ones(len(edges)), (i, j)), (bodies, bodies)).tocsr()
    before, depth = np.full(bodies, -1), np.full(bodies, -1)
    for root in range(bodies):
        if depth[root] < 0:
            order, above = breadth_first_order(graph, root, directed=False)
            depth[root] = 0
            for body in order[1:]:
                before[body], depth[body] = above[body], depth[above[body]] + 1
    shared: list[tuple[int, int]] = []
    for k, ends in enumerate(edges):
        upper, deeper = ends
        while upper != deeper:  # up the tree from the deeper of both, until they meet
            upper, deeper = sorted((upper, deeper), key=lambda body: depth[body])
            up = int(before[deeper])
            shared.append((k, number[min(deeper, up), max(deeper, up)]))
            deeper = up
    one, other = np.array(shared, int).reshape(-1, 2).T
    loops = sp.coo_array((np.ones(len(shared)), (one, other)), (len(edges), len(edges)))
    return np.asarray(connected_components(loops, directed=False)[1])
