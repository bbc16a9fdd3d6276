"""Joints as shared port points: W u = B z with constant scalar weights W and a constant selection B.

Weights commute with rotation, so joints hold for displacement, velocity and acceleration at once. Joints whose directions
vary in time have port points of each link's own, and is enforced by constraint equations over these (`row_joints`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import scipy.linalg
from jaxtyping import Bool, Float, Int

from kedfem.dynamics.joints.constraint_joints import ConstraintJoint, needs_rows
from kedfem.dynamics.joints.constraint_ports import (
    Own,
    Ways,
    can_be_bars,
    element_joint,
    gear_joint,
    rigid_points,
    row_joint,
)
from kedfem.dynamics.joints.places import part_seat, slider_axis
from kedfem.errors import MeshError
from kedfem.links.record import Link
from kedfem.links.surfaces.coupling_surfaces import CouplingSurface, holds, is_flat, port_weights
from kedfem.motion.constraints import perpendiculars
from kedfem.motion.linkage import joint_axis
from kedfem.scene import Joint, Scene

DEPENDENT = (
    1e-9  # relative: ports of one coupling surface repeat each other to rounding, others differ by far more
)


@dataclass(frozen=True, slots=True)
class Attachment:
    """One link's share in the joints.

    nodes, weights : (b,) and (p, b): scalar port weights W of the nodes that carry any
    components : d of the link
    points : (p, 3) port points, reference position [m]
    joints : (p,) name of each port's joint
    keep : (q,) which of the flattened (p, d) components are held; closed under the link's rotation; independent:
        what other ports of the link imply is left out
    B : (q, k) held components, in world axes, from the interface unknowns z
    shares : per link j (dp, q_j): forces at all ports of this link, world axes, from all links' λ in world axes
    from_rows : (dp, m): the same from the forces that rows of joints exert on their links' ports, world axes; m all
        components of all these ports, and empty where λ alone tells the forces
    loose : (dp, r) port forces of this link, world axes, that neither tells: statically indeterminate
    """

    nodes: Int[np.ndarray, " b"]
    weights: Float[np.ndarray, "p b"]
    components: int
    points: Float[np.ndarray, "p 3"]
    joints: tuple[str, ...]
    keep: Int[np.ndarray, " q"]
    B: Float[np.ndarray, "q k"]
    shares: tuple[Float[np.ndarray, "m _"], ...] = ()
    from_rows: Float[np.ndarray, "m _"] = field(default_factory=lambda: np.zeros((0, 0)))
    loose: Float[np.ndarray, "m r"] = field(default_factory=lambda: np.zeros((0, 0)))


@dataclass(frozen=True, slots=True)
class SharedCut:
    """Where two segments of a link meet: their keys, the points of the cut (k, 3) and each one's weights (k, n)."""

    keys: tuple[str, str]
    points: Float[np.ndarray, "k 3"]
    weights: tuple[Float[np.ndarray, "k _"], Float[np.ndarray, "k _"]]


@dataclass
class _Ports:
    """Ports of one link while they are collected."""

    link: Link
    weights: list[np.ndarray] = field(default_factory=list)
    points: list[np.ndarray] = field(default_factory=list)
    joints: list[str] = field(default_factory=list)
    keep: list[int] = field(default_factory=list)
    selection: list[tuple[int, np.ndarray]] = field(
        default_factory=list
    )  # first unknown, (components, unknowns)

    def add(
        self,
        weights: np.ndarray,
        point: np.ndarray,
        joint: str,
        held: list[int],
        first: int,
        block: np.ndarray,
    ) -> None:
        self.keep.extend(self.link.d * len(self.weights) + c for c in held)
        self.weights.append(weights)
        self.points.append(point)
        self.joints.append(joint)
        self.selection.append((first, block))

    def attachment(self, unknowns: int) -> Attachment:
        d = self.link.d
        if not self.weights:
            none = np.zeros(0, int)
            return Attachment(none, np.zeros((0, 0)), d, np.zeros((0, 3)), (), none, np.zeros((0, unknowns)))
        B = np.zeros((len(self.keep), unknowns))
        row = 0
        for first, block in self.selection:
            B[row : row + block.shape[0], first : first + block.shape[1]] = block
            row += block.shape[0]
        W = np.array(self.weights)
        nodes = np.flatnonzero(W.any(axis=0))
        return Attachment(
            nodes, W[:, nodes], d, np.array(self.points), tuple(self.joints), np.array(self.keep), B
        )


@dataclass(frozen=True, slots=True)
class Joined:
    """All joints of a scene: what each link has of them, and those enforced by constraint equations."""

    attachments: dict[str, Attachment]
    rows: tuple[ConstraintJoint, ...]


def joined(
    scene: Scene, links: dict[str, Link], cuts: Sequence[SharedCut], ways: Ways, elements: bool = False,
    bars: bool = False,
) -> Joined:  # fmt: skip
    """All joints of a scene, and cuts between segments, as attachments of its elastic links.

    Parameters
    ----------
    links : elastic links, or their segments, by a key of each
    elements : whether springs, motors and limits get interface points, as joints without rows
    bars : whether rigid links get points between which distances are kept

    Raises
    ------
    MeshError
        If a joint finds no bore, face or node on one of its links.
    """
    ports = {name: _Ports(link) for name, link in links.items()}
    sliders = {name: axis for name in scene.links if (axis := slider_axis(scene, name)) is not None}
    first_of: dict[str, int] = {name: k for k, name in enumerate(sliders)}
    unknowns = len(sliders)
    rows: list[tuple[ConstraintJoint, list[Own | None]]] = []
    columns: list[list[int]] = []  # of each side's own unknowns
    held_by_rows = [row_joint(scene, name, links, ways) for name in scene.joints if needs_rows(scene, name)]
    geared = [gear_joint(scene, name, links, ways) for name in scene.gears]
    acting = [
        element_joint(scene, f"{kind}.{name}", element, links, ways)
        for kind, every in (("springs", scene.springs), ("motors", scene.motors), ("limits", scene.limits))
        for name, element in (every.items() if elements else ())
    ]
    stiff = [rigid_points(link, key, ways) for key, link in links.items() if bars and can_be_bars(link)]
    for row, own in [*held_by_rows, *geared, *acting, *stiff]:
        if all(each is None for each in own):
            continue
        for each in own:
            columns.append(_own_columns(ports, row.name, each, first_of, unknowns))
            unknowns += len(columns[-1]) if each is not None and each.key else 0
        rows.append((row, own))
    for name, joint in scene.joints.items():
        if needs_rows(scene, name):
            continue
        elastic = {link.name for link in links.values()}
        seats = dict(part_seat(scene, name, links, link) for link in joint.links if link in elastic)
        held = list(seats)
        others = [link for link in joint.links if link not in elastic]
        if len({links[link].planar for link in held}) == 2:
            unknowns += _mixed(scene, name, {link: (ports[link], seats[link]) for link in held}, unknowns)
            continue
        points = port_points(scene, name, joint, seats, links) if held else np.zeros((0, 3))
        for point in points:
            components = _components(scene, name, joint, [links[link] for link in held])
            first, block, new = _target(joint, others, sliders, first_of, unknowns, components)
            for link in held:
                weights = port_weights(seats[link], point[None, :])[0]
                ports[link].add(weights, point, name, components, first, block)
            unknowns += new
    for cut in cuts:
        for point, *weights in zip(cut.points, *cut.weights, strict=True):
            for key, row_ in zip(cut.keys, weights, strict=True):
                d = ports[key].link.d
                ports[key].add(row_, point, "", list(range(d)), unknowns, np.eye(d))
            unknowns += d
    every = [ports[name].attachment(unknowns) for name in links]
    sides = list(zip((side for _, both in rows for side in both), columns, strict=True))
    bear = [k for side, here in sides if side is not None and not side.slider for k in here]
    riding = [k for side, here in sides if side is not None and side.slider for k in here]
    found, Z = independent(every, bear, riding)
    return Joined(dict(zip(links, found, strict=True)), tuple(_on(rows, columns, Z)))


def _own_columns(
    ports: dict[str, _Ports], name: str, own: Own | None, first_of: dict[str, int], unknowns: int
) -> list[int]:
    """The unknowns of one side of a joint enforced by constraint equations: all components of its ports; a slider's own
    travel."""
    if own is None:
        return []
    if own.slider:
        return [first_of[own.slider]]
    d = ports[own.key].link.d
    for k, (weights, point) in enumerate(zip(own.weights, own.points, strict=True)):
        ports[own.key].add(weights, point, name, list(range(d)), unknowns + d * k, np.eye(d))
    return list(range(unknowns, unknowns + d * len(own.points)))


def _on(
    rows: Sequence[tuple[ConstraintJoint, list[Own | None]]], columns: Sequence[list[int]], Z: np.ndarray
) -> Iterator[ConstraintJoint]:
    """Joints with rows on the interface unknowns, as these turned out."""
    of_side = iter(columns)

    def on(row: ConstraintJoint, own: Iterator[Own | None]) -> ConstraintJoint:
        sides = [
            None if side is None or each is None
            else replace(side, onto=(each.selection @ Z[here]).reshape(*side.onto.shape[:2], -1))
            for side, each, here in zip(row.sides, own, of_side, strict=False)
        ]  # fmt: skip
        return replace(
            row, sides=(sides[0], sides[1]), plus=tuple((c, on(other, own)) for c, other in row.plus)
        )

    for row, own in rows:
        yield on(row, iter(own))


def _mixed(scene: Scene, name: str, held: dict[str, tuple[_Ports, CouplingSurface]], first: int) -> int:
    """A hinge between a planar link and one in space: the pin of the latter stays upright; two new unknowns."""
    joint = scene.joints[name]
    if joint.kind not in {"revolute", "spherical"}:
        kinds = " and ".join(f"'{link}' ({ports.link.kind})" for link, (ports, _) in held.items())
        raise MeshError(
            f"joints.{name}: must be a hinge between a planar link and one in space, "
            f"got a {joint.kind} joint of {kinds}"
        )
    for link, (ports, seat) in held.items():
        points = port_points(scene, name, joint, {link: seat}, {link: ports.link})
        for point in points:
            components = [0, 1] if ports.link.planar else [0, 1, 2]
            weights = port_weights(seat, point[None, :])[0]
            ports.add(weights, point, name, components, first, np.eye(3)[components, :2])
    return 2


def independent(
    every: Sequence[Attachment], own: Sequence[int] = (), riding: Sequence[int] = ()
) -> tuple[list[Attachment], Float[np.ndarray, "k r"]]:
    """Joints on one coupling surface repeat rows of W: w_d = Σ l w_r. Each is held once, and the rest said of z instead.

    With all rows W = L W_r of the independent ones W_r, (B − L B_r) z = 0. An orthonormal basis Z of these z makes
    B_r Z the new B. L is scalar, so it commutes with the link's rotation.

    Parameters
    ----------
    own : unknowns z of ports on which rows of joints bear, side by side
    riding : those of rigid sliders on which rows bear

    Returns
    -------
    attachments on the new unknowns, and Z
    """
    relations = [_relation(each) for each in every]
    B = np.vstack([each.B for each in every])
    shares, loose, from_rows = np.eye(len(B)), np.zeros((len(B), 0)), np.zeros((len(B), 0))
    Z = np.eye(B.shape[1])
    if not all(kept.all() for kept, _ in relations):
        L = scipy.linalg.block_diag(*(L for _, L in relations))
        kept = np.concatenate([kept for kept, _ in relations])
        Z = _null_space(B - L @ B[kept])
        shares, from_rows, loose = _port_forces(L, B, own, riding)
    ends = np.cumsum([len(each.keep) for each in every])[:-1]
    columns = np.cumsum([kept.sum() for kept, _ in relations])[:-1]
    return [
        replace(
            each, keep=each.keep[kept], B=each.B[kept] @ Z, loose=_placed(each, theirs),
            shares=tuple(_placed(each, x) for x in np.split(share, columns, axis=1)), from_rows=_placed(each, rows),
        )
        for each, (kept, _), share, theirs, rows in zip(
            every, relations, np.split(shares, ends), np.split(loose, ends), np.split(from_rows, ends), strict=True
        )
    ], Z  # fmt: skip


def _relation(each: Attachment) -> tuple[Bool[np.ndarray, " h"], Float[np.ndarray, "h q"]]:
    """Which held components are independent, and L: all from those."""
    port, component = np.divmod(each.keep, each.components)
    kept, L = np.zeros(len(port), bool), np.zeros((len(port), len(port)))
    for c in range(each.components):
        at = np.flatnonzero(component == c)
        if len(at):
            # u, v(, w) are held by the same ports, so the choice is the same for them
            chosen, coefficients = _independent_rows(each.weights[port[at]])
            kept[at[chosen]] = True
            L[np.ix_(at, at[chosen])] = coefficients
    return kept, L[:, kept]


def _independent_rows(W: Float[np.ndarray, "p b"]) -> tuple[Int[np.ndarray, " r"], Float[np.ndarray, "p r"]]:
    """Independent rows of W and the coefficients of all rows in them, by rank-revealing QR."""
    R, order = scipy.linalg.qr(W.T, mode="r", pivoting=True)
    size = np.abs(np.diag(R))
    r = int((size > DEPENDENT * size[0]).sum())
    coefficients = np.zeros((len(W), r))
    coefficients[order[:r]] = np.eye(r)
    coefficients[order[r:]] = scipy.linalg.solve_triangular(R[:r, :r], R[:r, r:]).T
    in_order = np.argsort(order[:r])
    return order[:r][in_order], coefficients[:, in_order]


def _port_forces(
    L: Float[np.ndarray, "h q"], B: Float[np.ndarray, "h k"], own: Sequence[int], riding: Sequence[int]
) -> tuple[Float[np.ndarray, "h q"], Float[np.ndarray, "h o"], Float[np.ndarray, "h r"]]:
    """Forces μ at all ports from the λ at the independent ones, Lᵀ μ = λ, every joint in balance, Bᵀ μ = p.

    p is zero but for what rows exert on their own unknowns.

    Returns
    -------
    (h, q) μ from λ, (h, o) μ from p of the rows' own unknowns, and (h, r) the μ that neither equation sees
    """
    told = np.setdiff1d(np.arange(B.shape[1]), riding)  # what holds a slider is left open
    G = np.vstack([L.T, B.T[told]])
    inverse = np.linalg.pinv(G, rcond=DEPENDENT)
    inverse[np.abs(inverse) < DEPENDENT] = 0.0  # rounding
    q = L.shape[1]
    return inverse[:, :q], inverse[:, q + np.searchsorted(told, np.asarray(own, int))], _null_space(G)


def _null_space(A: Float[np.ndarray, "m n"]) -> Float[np.ndarray, "n r"]:
    """Orthonormal basis of A x = 0, A of order one."""
    _, s, Vt = np.linalg.svd(A)
    return np.asarray(Vt[int((s > DEPENDENT).sum()) :].T)


def _placed(each: Attachment, rows: Float[np.ndarray, "h c"]) -> Float[np.ndarray, "m c"]:
    """Rows of held components among those of all components of all ports."""
    out = np.zeros((each.components * len(each.weights), rows.shape[1]))
    out[each.keep] = rows
    return out


def port_points(
    scene: Scene, name: str, joint: Joint, seats: dict[str, CouplingSurface], links: dict[str, Link]
) -> Float[np.ndarray, "p 3"]:
    """Points of a joint that its links share: 1 spherical, 2 revolute; in a plane 1 for both.

    Where turning is held too, points off these in all directions that the coupling surfaces know: were a bore held along
    one direction only, its eye would be soft or stiff as that happens to lie.

    Raises
    ------
    MeshError
        If a flat coupling surface cannot hold a point outside its plane.
    """
    at = np.asarray(joint.at)
    if any(links[link].kind == "beam" for link in seats) or joint.kind == "spherical":
        return at[None, :]
    if links[next(iter(seats))].planar:
        return _plane_points(scene, name, joint, seats)
    seat = next(iter(seats.values()))
    driven = name in scene.driven_joints
    if joint.kind == "revolute":
        axis = joint_axis(joint)
        half = np.mean([np.sqrt(3) * _spread_along(s, axis) for s in seats.values()]) / 2
        centre = at + np.mean([(s.origin - at) @ axis for s in seats.values()]) * axis
        across = _widest_across(seat, axis)
        directions = [axis, across] if driven else [axis]
        points = [centre + half * axis, centre - half * axis]
        points += _points_off(centre, seats, [across, np.cross(axis, across)]) if driven else []
    else:
        seat = next((s for s in seats.values() if is_flat(s)), seat)
        e1, e2 = seat.directions[:2]
        directions = [e1, e2]
        points = [seat.origin + seat.spread[0] * e1 * c + seat.spread[1] * e2 * s
                  for c, s in ((1, 0), (-0.5, 0.9), (-0.5, -0.9))]  # fmt: skip
        points += _points_off(seat.origin, seats, [seat.directions[2]])
    for link, s in seats.items():
        if not all(holds(s, d) for d in directions):
            raise MeshError(f"joints.{name}: {_unheld(links[link], joint.kind)}")
    return np.array(points)


def _unheld(link: Link, kind: str) -> str:
    """What to do about a coupling surface that does not hold a joint's points."""
    if link.kind == "spatial_beam":
        return (
            f"must sit at an end or a corner of beam '{link.name}', or need its section only, got a joint that "
            "needs the direction of its axis too: give the beam a point there"
        )
    if kind == "weld":
        return (
            f"must weld faces that lie in one plane, or sit on a bore of link '{link.name}', "
            "got a flat face at an angle to the other link's: cut the two so that they meet in a plane"
        )
    return (
        f"must sit on a bore of link '{link.name}', or on a flat face that contains its axis, "
        "got a flat face across the axis: give the link a bore about the joint's axis"
    )


def _plane_points(
    scene: Scene, name: str, joint: Joint, seats: dict[str, CouplingSurface]
) -> Float[np.ndarray, "p 3"]:
    """The joint's point and, where turning is held, others: along a slide, else along the narrowest coupling surface, and
    across."""
    at = np.asarray(joint.at)
    if joint.kind == "revolute" and name not in scene.driven_joints:
        return at[None, :]
    narrow = min(seats.values(), key=lambda seat: float(seat.spread[1]))
    along = joint_axis(joint) if joint.kind == "prismatic" else narrow.directions[0]
    for link, seat in seats.items():
        if not holds(seat, along):
            raise MeshError(
                f"joints.{name}: must sit on a bore of link '{link}', or on an edge along its direction "
                f"({along[0]:.3g}, {along[1]:.3g}, 0), got an edge across that: give the link a bore there"
            )
    return np.array([at, *_points_off(at, seats, [along, np.cross([0.0, 0.0, 1.0], along)])])


def _points_off(
    centre: Float[np.ndarray, "3"],
    seats: dict[str, CouplingSurface],
    directions: list[Float[np.ndarray, "3"]],
) -> list[Float[np.ndarray, "3"]]:
    """A point off the centre in each direction that all coupling surfaces know, as far as the first coupling surface is
    wide there."""
    known = [d for d in directions if all(holds(seat, d) for seat in seats.values())]
    first = next(iter(seats.values()))
    return [centre + 2 * _spread_along(first, d) * d for d in known]


def _spread_along(seat: CouplingSurface, axis: Float[np.ndarray, "3"]) -> float:
    return float(np.linalg.norm((seat.directions @ axis) * seat.spread))


def _widest_across(seat: CouplingSurface, axis: Float[np.ndarray, "3"]) -> Float[np.ndarray, "3"]:
    candidates = [np.asarray(d - (d @ axis) * axis) for d in seat.directions]
    widest = max(candidates, key=lambda d: _spread_along(seat, d))
    return widest / np.linalg.norm(widest) if np.linalg.norm(widest) > 1e-9 else perpendiculars(axis)[0]


def _components(scene: Scene, name: str, joint: Joint, held: list[Link]) -> list[int]:
    """Which of a port's components the joint holds: of a beam (u, v, ψ) a pin leaves ψ free."""
    turning = name in scene.driven_joints or joint.kind in {"weld", "prismatic"}
    if not any(link.planar for link in held):
        return [0, 1, 2]
    if not turning or all(link.kind == "plane" for link in held):
        return [0, 1]
    if any(link.kind == "plane" for link in held):
        kinds = " and ".join(f"'{link.name}' ({link.kind})" for link in held)
        raise MeshError(
            f"joints.{name}: must be a hinge between a beam and a plane link, got a {joint.kind} of {kinds}"
        )
    return [0, 1, 2]


def _target(joint: Joint, others: list[str], sliders: dict[str, np.ndarray], first_of: dict[str, int],
            unknowns: int, components: list[int]) -> tuple[int, np.ndarray, int]:  # fmt: skip
    """First unknown, (components, unknowns) block and number of new unknowns of one port point."""
    if not others:
        return unknowns, np.eye(len(components)), len(components)
    if others[0] in sliders:
        slider = others[0]
        return first_of[slider], sliders[slider][components, None], 0
    if joint.kind == "prismatic":
        return unknowns, joint_axis(joint)[components, None], 1
    return unknowns, np.zeros((len(components), 0)), 0
