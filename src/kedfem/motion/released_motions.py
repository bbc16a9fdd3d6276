"""Free motions of a linkage in the reference position, in words that name links and joints."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
import scipy.linalg

from kedfem.arrays import Bool, Float
from kedfem.motion.joint_equations import PLANE
from kedfem.scene import Joint
from kedfem.vectors import cross

RANK_TOLERANCE = 1e-6  # of the largest singular value: axes with a smaller angle between them are parallel
STILL = 1e-6  # of a motion: smaller ones are rounding
SEARCHED = 10  # links up to which all groups are searched for motions of their own
AXES = np.eye(3)
ACROSS = np.array([2, 3, 4])  # columns of a link's out-of-plane motions: v_z, ω_x, ω_y
Basis = Float[np.ndarray, "k n"]


@dataclass(frozen=True, slots=True)
class LinearLinkage:
    """A linkage linearised in its reference position.

    J : (m, k) derivatives of the rows by the links' twists (v, ω) at the centre; gaps and v in units of size
    rows : (m,) joint of each row, or coupling
    driven : (m,) whether a row is that of a drive
    links : names; k = 6 per link
    joints : of the scene
    centre, size : [m]
    """

    J: Float[np.ndarray, "m k"]
    rows: tuple[str, ...]
    driven: np.ndarray
    links: tuple[str, ...]
    joints: Mapping[str, Joint]
    centre: Float[np.ndarray, "3"]
    size: float

    def place(self, joint: str) -> Float[np.ndarray, "3"]:
        """A joint's point, from the centre, in units of size."""
        return np.asarray((np.asarray(self.joints[joint].at) - self.centre) / self.size)

    def of(self, name: str) -> Bool[np.ndarray, " m"]:
        """Which rows are those of a joint or coupling."""
        return np.array([row == name for row in self.rows], bool)

    def block(self, link: str) -> slice:
        """Columns of a link."""
        k = 6 * self.links.index(link)
        return slice(k, k + 6)


def rank(J: Float[np.ndarray, "m k"]) -> int:
    """Number of independent rows."""
    s = scipy.linalg.svdvals(J) if J.size else np.zeros(0)
    return int((s > RANK_TOLERANCE * s.max(initial=0.0)).sum())


def null_space(J: Float[np.ndarray, "m k"]) -> Basis:
    """Orthonormal basis of the null space of J, as columns."""
    return np.asarray(scipy.linalg.null_space(J, rcond=RANK_TOLERANCE)) if J.size else np.eye(J.shape[1])


def span(vectors: Float[np.ndarray, "k n"]) -> Float[np.ndarray, "k d"]:
    """Orthonormal basis of the span of some vectors; negligible ones are left out."""
    U, s, _ = np.linalg.svd(vectors, full_matrices=False)
    return np.asarray(U[:, s > STILL])


def planar(reference: LinearLinkage) -> LinearLinkage:
    """The linkage with its links constrained to the xy plane, and the rows of each joint and drive reduced to it."""
    keys = list(zip(reference.rows, reference.driven.tolist(), strict=True))
    rows = {key: in_plane(reference.J[[each == key for each in keys]]) for key in dict.fromkeys(keys)}
    held = np.eye(reference.J.shape[1]).reshape(len(reference.links), 6, -1)[:, ACROSS].reshape(-1, reference.J.shape[1])
    names = [name for (name, _), J in rows.items() for _ in J] + [PLANE] * len(held)
    driven = [moves for (_, moves), J in rows.items() for _ in J] + [False] * len(held)
    return replace(reference, J=np.concatenate([*rows.values(), held]), rows=tuple(names), driven=np.array(driven, bool))


def in_plane(rows: Float[np.ndarray, "m k"]) -> Float[np.ndarray, "n k"]:
    """Independent rows of one joint for motions in the plane."""
    left = rows.copy().reshape(len(rows), -1, 6)
    left[:, :, ACROSS] = 0.0
    _, s, Vt = np.linalg.svd(left.reshape(rows.shape), full_matrices=False)
    return np.asarray(Vt[s > RANK_TOLERANCE * s.max(initial=0.0)])


def direction(d: Float[np.ndarray, "3"]) -> str:
    """``z``, or ``(0.6, 0.8, 0)`` with its greatest component positive."""
    d = d / np.linalg.norm(d) * np.sign(d[np.abs(d).argmax()])
    if d.max() > 1 - STILL:
        return "xyz"[int(d.argmax())]
    return components(d, 6)


def components(d: Float[np.ndarray, "3"], digits: int = 9, form: str = ".3g") -> str:
    """A vector as text, rounded."""
    return f"({', '.join(format(x + 0.0, form) for x in np.round(d, digits))})"


def directions(
    what: str, where: str, within: Float[np.ndarray, "3 d"], axis: Float[np.ndarray, "3"] | None = None
) -> str:
    """``forces along x and y``: directions within a line, a plane or all of space; `axis` is that of the joint.

    >>> directions("turn", "about", np.eye(3)[:, 2:])
    'turn about z'
    """
    if within.shape[1] == 3:
        return f"{what} {'in all directions' if where == 'along' else 'about all axes'}"
    if within.shape[1] == 1:
        along = "its axis" if axis is not None and _alike(within[:, 0], axis) else direction(within[:, 0])
        return f"{what} {where} {along}"
    normal = scipy.linalg.null_space(within.T)[:, 0]
    if axis is not None and _alike(normal, axis):
        return f"{what} across its axis"
    here = [k for k in range(3) if abs(normal[k]) < STILL]
    if not here:
        return f"{what} across {direction(normal)}"
    two = [*here, *([] if len(here) == 2 else [None])]
    names = ["xyz"[k] if k is not None else direction(np.cross(normal, AXES[here[0]])) for k in two]
    return f"{what} {where} {names[0]} and {names[1]}"


def _alike(a: Float[np.ndarray, "3"], b: Float[np.ndarray, "3"]) -> bool:
    """Whether two unit vectors are parallel, but to no coordinate axis, which has a shorter name."""
    return bool(np.linalg.norm(np.cross(a, b)) < STILL and np.abs(a).max() < 1 - STILL)


def listed(names: list[str] | tuple[str, ...], last: str = "and") -> str:
    """``A, B and C``."""
    return f" {last} ".join(filter(None, [", ".join(names[:-1]), *names[-1:]]))


def joints_in_words(names: list[str] | tuple[str, ...], last: str = "and") -> str:
    """``joint A``, or ``joints A and B``; couplings have names such as ``gears.pair``.

    >>> joints_in_words(["A", "B", "gears.pair"])
    'joints A and B and gears.pair'
    """
    joints, couplings = ([x for x in names if ("." in x) == coupling] for coupling in (False, True))
    plural = "s" * (len(joints) > 1 and last == "and")
    words = [f"joint{plural} {listed(joints, last)}"] if joints else []
    return f" {last} ".join(words + ([listed(couplings, last)] if couplings else []))


@dataclass(frozen=True, slots=True)
class FreeMotion:
    """A free motion of some links.

    links : moving links
    joints : moving joints
    basis : (k, n) scaled twists of all links
    words : its description
    drivable : moving joints of one degree of freedom
    spin : the joints on the line about which a link spins idly, if it does
    """

    links: tuple[str, ...]
    joints: tuple[str, ...]
    basis: Basis
    words: str
    drivable: tuple[str, ...] = ()
    spin: tuple[str, ...] = ()


def free_motions(reference: LinearLinkage) -> list[FreeMotion]:
    """Motions that joints and drives release, sorted by the smallest groups of links that can move alone."""
    return [_described(reference, links, basis) for links, basis in _groups(reference, null_space(reference.J))]


def _groups(reference: LinearLinkage, free: Basis) -> list[tuple[tuple[str, ...], Basis]]:
    """Free motions by their moving links: first those of one link alone, then of two, and so on."""
    found, out, n = np.zeros((free.shape[1], 0)), [], len(reference.links)
    sizes = range(1, n + 1) if n <= SEARCHED else (1, n)
    for some in (group for size in sizes for group in combinations(reference.links, size)):
        if found.shape[1] == free.shape[1]:
            break
        others = [free[reference.block(link)] for link in reference.links if link not in some]
        _, s, Vt = np.linalg.svd(np.concatenate([np.zeros_like(free), *others]))
        within = Vt[(s > STILL).sum() :].T
        if (fresh := span(within - found @ (found.T @ within))).shape[1]:
            found = np.concatenate([found, fresh], axis=1)
            out.append((some, free @ fresh))
    return out


def _relative(reference: LinearLinkage, joint: str, basis: Basis) -> Float[np.ndarray, "6 n"]:
    """Twists (v, ω) at a joint of its one link against the other."""
    one, other = (_twists(reference, link, joint, basis) for link in reference.joints[joint].links)
    return np.asarray(one - other)


def _twists(reference: LinearLinkage, link: str, joint: str, basis: Basis) -> Float[np.ndarray, "6 n"]:
    """Twists (v, ω) of a link at a joint's point."""
    if link not in reference.links:
        return np.zeros((6, basis.shape[1]))
    v, omega = basis[reference.block(link)].reshape(2, 3, -1)
    return np.concatenate([v + cross(omega.T, np.broadcast_to(reference.place(joint), omega.T.shape)).T, omega])


def _described(reference: LinearLinkage, links: tuple[str, ...], basis: Basis) -> FreeMotion:
    links = tuple(link for link in links if np.abs(basis[reference.block(link)]).max() > STILL)
    joints = tuple(name for name in reference.joints if np.abs(_relative(reference, name, basis)).max() > STILL)
    drivable = tuple(name for name in joints if reference.joints[name].kind in {"revolute", "prismatic"})
    if len(links) == 1:
        words, spin = _alone(reference, links[0], joints, basis)
        return FreeMotion(links, joints, basis, words, drivable, spin)
    count = f"{basis.shape[1]} ways" if basis.shape[1] > 1 else "one way"
    words = f"links {listed([repr(x) for x in links])} can move together in {count}"
    words += f", by {joints_in_words(joints)}" if joints else ""
    return FreeMotion(links, joints, basis, words, drivable)


def _alone(reference: LinearLinkage, link: str, joints: tuple[str, ...], basis: Basis) -> tuple[str, tuple[str, ...]]:
    """Motions of one link in words, and the joints on the line about which it spins."""
    twists = {name: _twists(reference, link, name, basis) for name in joints}
    still = [name for name in joints if np.abs(twists[name][:3]).max() < STILL]
    at = still[0] if still else next(iter(joints), None)
    here = twists[at] if at else basis[reference.block(link)]
    turns, slides = span(here[3:]), span(here[:3])
    parts = [directions("turn", "about", turns)] if turns.shape[1] else []
    parts += [directions("slide", "along", slides)] if slides.shape[1] else []
    words = f"link '{link}' can {' and '.join(parts)}"
    if basis.shape[1] == 1 and len(still) > 1:
        kinds = {reference.joints[name].kind for name in still}
        which = f"both {kinds.pop()}" if len(kinds) == 1 and len(still) == 2 else "on one line"
        return f"{words}, the line through {joints_in_words(still)} ({which})", tuple(still)
    return words + (f" at joint {at} ({reference.joints[at].kind})" if at else ", constrained by no joint"), ()


def remedy(motion: FreeMotion) -> str:
    """The usual remedy for a free motion."""
    if motion.spin:
        return f"make joint {listed(motion.spin, 'or')} universal"
    drive = f"drive joint {listed(motion.drivable, 'or')}, or " if motion.drivable else ""
    return f"{drive}constrain {listed(motion.links)} by a further joint"
