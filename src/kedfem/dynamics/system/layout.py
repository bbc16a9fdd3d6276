"""A system's flat arrays: bodies factored for a fixed step, ends, constraints."""

from collections.abc import Sequence

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.matrices.dense import SMALL, component_first, coordinates, dense_part, work_on
from kedfem.dynamics.matrices.profile import Profile, profile_of
from kedfem.dynamics.matrices.substructure import effective_coefficients
from kedfem.dynamics.matrices.substructure import factored as condensed
from kedfem.dynamics.metric import element_tables
from kedfem.dynamics.stepping.scheme import Scheme
from kedfem.dynamics.stepping.state import Rayleigh
from kedfem.dynamics.system import record
from kedfem.dynamics.system.arrays import Beams, Bodies, Coefficients, Constraints, Ends, ends_of, flat, groups, reach
from kedfem.dynamics.system.forces.follower_loads import follower_loads
from kedfem.dynamics.system.forces.stresses import stress_tables
from kedfem.dynamics.system.record import Constraint, Curve, Driven, Held, Law, Spring, Stop, System, curve_of
from kedfem.dynamics.system.sparse import (
    Part,
    SparsePart,
    address_tables,
    mass_of,
    mass_tables,
    sparse_part,
    stiffness_tables,
)
from kedfem.links.record import BeamPoint, Link
from kedfem.scene import Pieces

KINDS = {"solid": 0, "spatial_beam": 0, "plane": 1, "beam": 2}
TOLERANCE = 1e-9  # change of a pass, of what a step moves: far below what co-rotational frames are compared to, 1e-7
SMALLEST = 1e-13  # of a system's size, or how far it is from the origin: what a step of one at rest may be out by


def coefficients(
    scheme: Scheme, damping: Rayleigh, links: Sequence[Link], single: bool, tolerance: float = TOLERANCE
) -> Coefficients:
    """Of generalised-α for bodies of a mass and a size; places far from the origin have its rounding."""
    c_M, c_K = effective_coefficients(scheme, damping)
    mass = sum(float(link.one @ link.m1[:, 0]) for link in links)
    size = max(max(link.size, float(np.linalg.norm((link.full or link).nodes, axis=1).max())) for link in links)
    return Coefficients(
        c_M, c_K, scheme.alpha_m, scheme.alpha_f, scheme.acceleration, scheme.rate, scheme.h,
        scheme.h * scheme.gamma, scheme.h * (1 - scheme.gamma), damping.alpha, damping.beta, tolerance,
        SMALLEST * size * np.sqrt(mass), float(np.sqrt(mass)), single,
    )  # fmt: skip


def points_of(link: Link) -> tuple[BeamPoint, ...]:
    """The points of a planar beam at which its strains are known."""
    return tuple(frame.point for frame in link.frames if frame.point)


def frame_of(link: Link) -> int:
    """Which frame a body's internal force is seen from."""
    if link.fit is None:
        return record.NOMINAL
    return record.TANGENTIAL if points_of(link) else record.COROTATIONAL


def body_arrays(system: System, parts: Sequence[Part], profile: Profile) -> Bodies:
    """All bodies as flat arrays, their parts factored."""
    model, stiffening = system.model, system.stiffening
    links, joints, numbers = model.links, model.joints, model.bodies
    columns = [joint.columns for joint in joints]
    stressed = [stiffening is not None and len(stiffening.modes[k].states) > 0 for k in range(len(links))]
    frames = [record.STRESSED if x else frame_of(link) for x, link in zip(stressed, links, strict=True)]
    sizes, ports = [link.unknowns for link in links], [len(joint.keep) for joint in joints]
    beams = [k for k, frame in enumerate(frames) if frame == record.TANGENTIAL]
    at = ends_of(sizes)
    passed, place = np.full(len(links), -1), 0
    for k, frame in enumerate(frames):
        if frame != record.NOMINAL:
            passed[k], place = place, place + sizes[k]
    fits = [_fitted(link, part) for link, part in zip(links, parts, strict=True)]
    dense = np.array([not isinstance(part, SparsePart) for part in parts], bool)
    Y, W = ([x[:0] if isinstance(part, SparsePart) else x for x, part in zip(each, parts, strict=True)]
            for each in ([part.Y.T for part in parts], [part.W for part in parts]))  # fmt: skip
    stiff = [
        component_first(part.T, link.K0) if frame == record.COROTATIONAL and part.G.size else np.zeros(part.G.shape)
        for link, part, frame in zip(links, parts, frames, strict=True)
    ]
    return Bodies(
        at=at, functions=np.array([x.n for x in links]), components=np.array([x.d for x in links]),
        motion=np.array(numbers), frame=np.array(frames), kind=np.array([KINDS[x.kind] for x in links]),
        dense=dense, arrays=address_tables(parts), passed=passed, port_at=ends_of(ports),
        component=flat([joint.keep % joint.components for joint in joints], int),
        group=groups([joint.keep // joint.components for joint in joints]),
        G_at=ends_of([x.G.size for x in parts]), Y_at=ends_of([x.size for x in Y]),
        S_at=ends_of([q * q for q in ports]), B_at=ends_of([q * len(c) for q, c in zip(ports, columns, strict=True)]),
        G=flat([x.G for x in parts]), Y=flat(Y), W=flat(W),
        S=flat([x.S for x in parts]), B=flat([joint.B for joint in joints]),
        column_at=ends_of([len(c) for c in columns]), columns=flat([profile.number[c] for c in columns], int),
        reach=reach([joint.B for joint in joints], [joint.keep // joint.components for joint in joints]),
        place=profile.unknown, first=profile.first, row_at=profile.at, multiplier=profile.multiplier,
        X=flat([x for x, _, _ in fits]), one=flat([x for _, x, _ in fits]), fit=flat([x for _, _, x in fits]),
        K=flat(stiff),
        beams=Beams(
            np.array(beams, int), np.array([numbers[k] for k in beams], int), at[beams],
            np.array([links[k].n for k in beams], int),
            *_beam_tables([links[k] for k in beams], [parts[k] for k in beams]),
        ),
        elements=element_tables(links, parts), mass=mass_tables(links, parts),
        turning=follower_loads(links, parts, model.loads),
        stiffness=stiffness_tables(links, parts, [frame == record.COROTATIONAL for frame in frames]),
        size=np.array([1.0 if whole else mass_of(link) for link, whole in zip(links, dense, strict=True)]),
        rigid=np.array([x.rigid and frame == record.COROTATIONAL for x, frame in zip(links, frames, strict=True)], bool),
        stresses=stress_tables(stiffening, parts),
    )  # fmt: skip


def _fitted(link: Link, part: Part) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    rows = link.X[:, : link.d] * ([1, 1, 0] if link.kind == "beam" else 1)
    one = coordinates(link, part, np.repeat(link.one[:, None], link.d, axis=1))
    fit = np.zeros((link.d, link.n)) if link.fit is None else work_on(part, link.fit[:, : link.d])
    return coordinates(link, part, rows), one, fit


def _beam_tables(
    links: Sequence[Link], parts: Sequence[Part]
) -> tuple[Float[np.ndarray, "b 3 E n"], Float[np.ndarray, "b 2 E"], Float[np.ndarray, "b 3 E"]]:
    """Rows, tangents and rigidities of planar beams with strains at points, see `beams_kernel`."""
    E, n = max([1, *(len(points_of(link)) for link in links)]), max([1, *(link.n for link in links)])
    rows = np.zeros((len(links), 3, E, n))
    tangent, rigidity = np.zeros((len(links), 2, E)), np.zeros((len(links), 3, E))
    tangent[:, 0] = 1.0
    for k, (link, part) in enumerate(zip(links, parts, strict=True)):
        for e, point in enumerate(points_of(link)):
            strains, own = point.strains.reshape(3, -1, 3), slice(link.n)
            rows[k, 0, e, own] = part.T[0].T @ strains[0, :, :2] @ point.tangent
            rows[k, 1, e, own] = part.T[2].T @ -strains[1, :, 2]
            rows[k, 2, e, own] = part.T[2].T @ strains[2, :, 2]
            tangent[k, :, e], rigidity[k, :, e] = point.tangent, point.rigidity
    return rows, tangent, rigidity


def end_arrays(system: System, number: Int[np.ndarray, " k"]) -> Ends:
    """All ends as flat arrays on the renumbered interface unknowns."""
    ends = system.ends
    columns, every = [end.columns for end in ends], [end.onto for end in ends]
    lines = [n for n, end in enumerate(ends) if end.form == record.LINE]
    full = [every[n] for n in lines]
    onto = [x[:1] if n in lines else x for n, x in enumerate(every)]
    forms = [record.POINT if end.form == record.LINE else end.form for end in ends]
    of_lines = [(end.line.axis, end.line.stations) for end in ends if end.line is not None]
    cubics = [_cardinal(along.s) for _, along in of_lines]
    terms = [term for each in system.constraints for term in each.terms]
    free = {term.j for term in terms if term.kind in record.ON_LINES}
    return Ends(
        body=np.array([end.body for end in ends], int), form=np.array(forms, int),
        origin=_rows([end.origin for end in ends]),
        directions=np.array([end.directions for end in ends]).reshape(-1, 3, 3),
        lengths=_rows([end.lengths for end in ends]), known=np.array([end.known for end in ends], int),
        components=np.array([end.onto.shape[1] for end in ends], int), column_at=ends_of([len(c) for c in columns]),
        columns=flat([number[c] for c in columns], int), onto_at=ends_of([x.size for x in onto]), onto=flat(onto),
        line=np.array(lines, int), line_at=ends_of([len(x) for x in full]), full_at=ends_of([x.size for x in full]),
        full=flat(full), number=np.array([lines.index(n) if n in lines else -1 for n in range(len(ends))], int),
        free=np.array([n in free for n in lines], bool), axis=_rows([axis for axis, _ in of_lines]),
        knots=flat([along.s for _, along in of_lines]), cubic_at=ends_of([x.size for x in cubics]), cubics=flat(cubics),
        weights=np.zeros(sum(map(len, full))), slopes=np.zeros(sum(map(len, full))), pin=np.zeros(len(lines)),
    )  # fmt: skip


def _cardinal(s: Float[np.ndarray, " p"]) -> Float[np.ndarray, "_ 4 p"]:
    """Coefficients of a cubic spline's cardinal functions by powers of the place from each station on."""
    from scipy.interpolate import CubicSpline

    return np.ascontiguousarray(CubicSpline(s, np.eye(len(s))).c[::-1].transpose(1, 0, 2))


def constraint_arrays(constraints: Sequence[Constraint], profile: Profile) -> Constraints:
    """All constraints and laws as flat arrays."""
    terms = [term for each in constraints for term in each.terms]
    laws = [_law(each.law) for each in constraints]
    curves = [curve_of(each.law) or Curve(record.COORDINATE, Pieces()) for each in constraints]
    return Constraints(
        term_at=ends_of([len(each.terms) for each in constraints]), kind=np.array([x.kind for x in terms], int),
        i=np.array([x.i for x in terms], int), j=np.array([x.j for x in terms], int),
        a=_rows([x.a for x in terms]), a_j=_rows([x.a_j for x in terms]), b=_rows([x.b for x in terms]),
        factor=np.array([x.factor for x in terms], float), linear=np.array([x.linear for x in constraints], bool),
        law=np.array([kind for kind, _, _ in laws], int),
        numbers=np.array([x for _, x, _ in laws], float).reshape(-1, 4),
        drive=np.array([x for _, _, x in laws], int), over=np.array([x.over for x in curves], int),
        curve_at=ends_of([len(x.force.at) for x in curves]),
        abscissa=flat([np.array(x.force.at) for x in curves]),
        cubics=np.array([c for x in curves for c in x.force.coefficients], float).reshape(-1, 4),
        period=np.array([x.force.period for x in curves], float),
        jumps=np.array([isinstance(x.law, Stop) and x.law.damping > 0 for x in constraints], bool),
        place=profile.constraint, column_at=ends_of([len(c) for c in profile.columns]),
        columns=flat(profile.columns, int),
    )  # fmt: skip


def _law(law: Law) -> tuple[int, tuple[float, float, float, float], int]:
    """Kind, numbers and drive of a law."""
    match law:
        case Held():
            return record.HELD, (0.0, 0.0, 0.0, 0.0), -1
        case Driven():
            return record.DRIVEN, (0.0, 0.0, 0.0, 0.0), law.drive
        case Spring():
            return record.SPRING, (law.stiffness, law.damping, law.free, 0.0), law.drive
        case Stop():
            return record.STOP, (law.lower, law.upper, law.stiffness, law.damping), -1
        case Curve():
            return record.CURVE, (0.0, 0.0, 0.0, 0.0), -1


def _rows(vectors: Sequence[np.ndarray]) -> Float[np.ndarray, "r 3"]:
    return np.array(vectors, float).reshape(-1, 3)


def factored(links: Sequence[Link], joints: Sequence[Attachment], c: Coefficients | None = None) -> list[Part]:
    """All bodies with A = c_M M + c_K K0, or M alone."""
    c_M, c_K = (1.0, 0.0) if c is None else (c.c_M, c.c_K)
    return [
        sparse_part(link, joint, condensed(link, joint, c_M, c_K)) if is_large(link)
        else dense_part(link, joint, c_M, c_K)
        for link, joint in zip(links, joints, strict=True)
    ]  # fmt: skip


def is_large(link: Link) -> bool:
    """Whether a body keeps a sparse factor and nodal coordinates: elements with frames of their own never do.

    Beams in space with rigid-body frames do, however small: in coordinates in which mass is one their rigid nodes, which
    have next to no mass, would be 1e11 times as stiff as they bend.
    """
    if frame_of(link) == record.TANGENTIAL or link.element is not None:
        return False
    rigid_nodes = link.kind == "spatial_beam" and link.full is None and link.fit is None
    return link.unknowns > SMALL or rigid_nodes


def profile(system: System) -> Profile:
    """The profile of the interface: unknowns that a body, or a constraint, couples with each other."""
    bodies = [joint.columns for joint in system.model.joints]
    constraints = [
        np.unique(np.concatenate([system.ends[n].columns for term in each.terms for n in (term.i, term.j)]))
        for each in system.constraints
    ]
    return profile_of(bodies, constraints, system.unknowns)


def as_arrays(system: System, parts: Sequence[Part]) -> tuple[Bodies, Ends, Constraints]:
    """A system's flat arrays, its bodies factored."""
    made = profile(system)
    bodies = body_arrays(system, parts, made)
    return bodies, end_arrays(system, made.number), constraint_arrays(system.constraints, made)
