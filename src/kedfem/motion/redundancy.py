"""Redundant joint equations: their joints and directions, and the kinds of joints that would avoid them.

A dependent set of equations can have forces in balance without any load: self-stress, the vectors λ with Jᵀ λ = 0. The
components of these at a joint are its redundant constraints, whichever equations are removed; statics of rigid links
cannot determine them.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from kedfem.arrays import Float
from kedfem.motion.joint_equations import PLANE, unit
from kedfem.motion.released_motions import LinearLinkage, directions, joints_in_words, listed, null_space, rank, span

ALTERNATIVES = {
    "revolute": ("spherical", "cylindrical"), "prismatic": ("cylindrical",), "universal": ("spherical",),
    "weld": ("spherical",),
}  # fmt: skip
AlternativeRows = Mapping[tuple[str, str], Float[np.ndarray, "m k"]]
"""Rows of joints if they were of another kind, by joint and kind."""


@dataclass(frozen=True, slots=True)
class Redundant:
    """Joints with the same redundant constraints, and which: ``force along z, moments about x and y``."""

    joints: tuple[str, ...]
    words: str


def redundancy(reference: LinearLinkage) -> int:
    """Number of redundant rows."""
    return len(reference.J) - rank(reference.J)


def redundant(reference: LinearLinkage) -> list[Redundant]:
    """The redundant constraints of each joint; joints with equal ones together."""
    stress = null_space(reference.J.T)
    by_words: dict[str, list[str]] = {}
    for name in dict.fromkeys(reference.rows):
        if words := _words(reference, name, stress):
            by_words.setdefault(words, []).append(name)
    return [Redundant(tuple(names), words) for words, names in by_words.items()]


def wrenches(reference: LinearLinkage, joint: str, stress: Float[np.ndarray, "m r"]) -> Float[np.ndarray, "6 r"]:
    """Forces and moments (per size) of self-stresses at a joint's point on one of its links, without its drive."""
    mine = reference.of(joint) & ~reference.driven
    link = next(name for name in reference.joints[joint].links if name in reference.links)
    force, moment = (reference.J[mine, reference.block(link)].T @ stress[mine]).reshape(2, 3, -1)
    return np.concatenate([force, moment - np.cross(reference.place(joint), force.T).T])


def _words(reference: LinearLinkage, name: str, stress: Float[np.ndarray, "m r"]) -> str:
    if name not in reference.joints:  # a coupling: one number alone
        return "the coupling itself" if np.abs(stress[reference.of(name)]).max(initial=0.0) > 1e-6 else ""
    force, moment = wrenches(reference, name, stress).reshape(2, 3, -1)
    joint = reference.joints[name]
    axis = None if joint.axis is None else unit(joint.axis)
    parts = []
    for what, where, vectors in (("force", "along", span(force)), ("moment", "about", span(moment))):
        if d := vectors.shape[1]:
            parts.append(directions(f"{what}{'s' * (d > 1)}", where, vectors, axis))
    return ", ".join(parts)


def with_rows(reference: LinearLinkage, joint: str, rows: Float[np.ndarray, "m k"]) -> LinearLinkage:
    """The linkage with other rows for one joint; its drive stays."""
    kept = ~reference.of(joint) | reference.driven
    J = np.concatenate([rows, reference.J[kept]])
    names = (joint,) * len(rows) + tuple(np.array(reference.rows)[kept].tolist())
    driven = np.concatenate([np.zeros(len(rows), bool), reference.driven[kept]])
    return replace(reference, J=J, rows=names, driven=driven)


def without_redundancy(reference: LinearLinkage, alternatives: AlternativeRows) -> tuple[list[tuple[str, str]], int]:
    """Joints to replace by another kind, which removes redundant rows and releases no motion; and the remaining ones.

    Each time the joint that removes most.
    """
    done: list[tuple[str, str]] = []
    while left := redundancy(reference):
        trials = [
            (redundancy(trial), key, trial)
            for key, rows in alternatives.items()
            if key[0] not in {joint for joint, _ in done}
            and rank((trial := with_rows(reference, key[0], rows)).J) == rank(reference.J)
        ]
        best = min(trials, key=lambda each: each[0], default=None)
        if best is None or best[0] >= left:
            break
        reference, done = best[2], [*done, best[1]]
    return done, redundancy(reference)


def remedy(reference: LinearLinkage, alternatives: AlternativeRows) -> str:
    """A remedy for redundant rows, in words."""
    done, left = without_redundancy(reference, alternatives)
    if not done:
        couplings = [name for name in _undriven(reference) if "." in name]
        spare = [name for name in couplings if rank(with_rows(reference, name, reference.J[:0]).J) == rank(reference.J)]
        return f"leave out {listed(spare, 'or')}" if spare else "none by another kind of one joint"
    words = "make " + listed([f"joint {joint} {kind}" for joint, kind in done])
    return f"{words}; {left} would be left" if left else words


def mobilising_change(reference: LinearLinkage, alternatives: AlternativeRows) -> str:
    """A change with which the drives can move a structure, in words: another kind of one joint, or one joint less."""
    kinds: dict[str, list[str]] = {}
    for (joint, kind), rows in alternatives.items():
        if _moves(with_rows(reference, joint, rows)):
            kinds.setdefault(kind, []).append(joint)
    if kinds:
        return " or ".join(f"if {joints_in_words(names, 'or')} were {kind}" for kind, names in kinds.items())
    fewer = [name for name in _undriven(reference) if _moves(with_rows(reference, name, reference.J[:0]))]
    return f"without {joints_in_words(fewer, 'or')}" if fewer else ""


def _undriven(reference: LinearLinkage) -> Iterator[str]:
    driven = set(np.array(reference.rows)[reference.driven].tolist())
    return (name for name in dict.fromkeys(reference.rows) if name not in {*driven, PLANE})


def _moves(reference: LinearLinkage) -> bool:
    """Whether the drives move the linkage without free motions."""
    held = reference.J[~reference.driven]
    mobile = held.shape[1] - rank(held) == reference.driven.sum()
    return bool(mobile and rank(reference.J) == reference.J.shape[1])
