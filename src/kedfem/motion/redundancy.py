"""Redundant joint equations: which they are, in which directions, and which kinds of joints would avoid them.

A dependent set of rows bears forces in balance with one another without any load: self-stress, the vectors λ with
Jᵀ λ = 0. What these do at a joint is what the joint holds redundantly, whichever rows are struck out; statics of rigid
links cannot determine it.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from kedfem.arrays import Float
from kedfem.motion.joint_equations import PLANE, unit
from kedfem.motion.released_motions import Drawn, directions, listed, null_space, of_joints, rank, span

LOOSER = {
    "revolute": ("spherical", "cylindrical"), "prismatic": ("cylindrical",), "universal": ("spherical",),
    "weld": ("spherical",),
}  # fmt: skip
Looser = Mapping[tuple[str, str], Float[np.ndarray, "m k"]]
"""Rows of joints if they were of another kind, by joint and kind."""


@dataclass(frozen=True, slots=True)
class Redundant:
    """Joints with the same redundant constraints, and which: ``force along z, moments about x and y``."""

    joints: tuple[str, ...]
    words: str


def redundancy(drawn: Drawn) -> int:
    """Number of redundant rows."""
    return len(drawn.J) - rank(drawn.J)


def redundant(drawn: Drawn) -> list[Redundant]:
    """The redundant constraints of each joint; joints with equal ones together."""
    stress = null_space(drawn.J.T)
    by_words: dict[str, list[str]] = {}
    for name in dict.fromkeys(drawn.rows):
        if words := _words(drawn, name, stress):
            by_words.setdefault(words, []).append(name)
    return [Redundant(tuple(names), words) for words, names in by_words.items()]


def wrenches(drawn: Drawn, joint: str, stress: Float[np.ndarray, "m r"]) -> Float[np.ndarray, "6 r"]:
    """Forces and moments (per size) at a joint's point on one of its links, of self-stresses; the drive left out."""
    mine = drawn.of(joint) & ~drawn.driven
    link = next(name for name in drawn.joints[joint].links if name in drawn.links)
    force, moment = (drawn.J[mine, drawn.block(link)].T @ stress[mine]).reshape(2, 3, -1)
    return np.concatenate([force, moment - np.cross(drawn.place(joint), force.T).T])


def _words(drawn: Drawn, name: str, stress: Float[np.ndarray, "m r"]) -> str:
    if name not in drawn.joints:  # a coupling: one number alone
        return "the coupling itself" if np.abs(stress[drawn.of(name)]).max(initial=0.0) > 1e-6 else ""
    force, moment = wrenches(drawn, name, stress).reshape(2, 3, -1)
    joint = drawn.joints[name]
    axis = None if joint.axis is None else unit(joint.axis)
    parts = []
    for what, where, vectors in (("force", "along", span(force)), ("moment", "about", span(moment))):
        if d := vectors.shape[1]:
            parts.append(directions(f"{what}{'s' * (d > 1)}", where, vectors, axis))
    return ", ".join(parts)


# -- remedies -----------------------------------------------------------------------------------------------


def changed(drawn: Drawn, joint: str, rows: Float[np.ndarray, "m k"]) -> Drawn:
    """The linkage with other rows for one joint; its drive stays."""
    kept = ~drawn.of(joint) | drawn.driven
    J = np.concatenate([rows, drawn.J[kept]])
    names = (joint,) * len(rows) + tuple(np.array(drawn.rows)[kept].tolist())
    driven = np.concatenate([np.zeros(len(rows), bool), drawn.driven[kept]])
    return replace(drawn, J=J, rows=names, driven=driven)


def without_redundancy(drawn: Drawn, looser: Looser) -> tuple[list[tuple[str, str]], int]:
    """Joints to replace by another kind, one after the other, which removes redundant rows and releases no motion.

    Each time the one that takes most off. Returns them, and the number of redundant rows that then are left.
    """
    done: list[tuple[str, str]] = []
    while left := redundancy(drawn):
        trials = [
            (redundancy(trial), key, trial)
            for key, rows in looser.items()
            if key[0] not in {joint for joint, _ in done}
            and rank((trial := changed(drawn, key[0], rows)).J) == rank(drawn.J)
        ]
        best = min(trials, key=lambda each: each[0], default=None)
        if best is None or best[0] >= left:
            break
        drawn, done = best[2], [*done, best[1]]
    return done, redundancy(drawn)


def remedy(drawn: Drawn, looser: Looser) -> str:
    """A remedy for redundant rows, in words."""
    done, left = without_redundancy(drawn, looser)
    if not done:
        couplings = [name for name in _undriven(drawn) if "." in name]
        spare = [name for name in couplings if rank(changed(drawn, name, drawn.J[:0]).J) == rank(drawn.J)]
        return f"leave out {listed(spare, 'or')}" if spare else "none by another kind of one joint"
    words = "make " + listed([f"joint {joint} {kind}" for joint, kind in done])
    return f"{words}; {left} would be left" if left else words


def would_move(drawn: Drawn, looser: Looser) -> str:
    """A change with which the drives could move a structure, in words: one joint of another kind, or one joint less."""
    kinds: dict[str, list[str]] = {}
    for (joint, kind), rows in looser.items():
        if _moves(changed(drawn, joint, rows)):
            kinds.setdefault(kind, []).append(joint)
    if kinds:
        return " or ".join(f"if {of_joints(names, 'or')} were {kind}" for kind, names in kinds.items())
    fewer = [name for name in _undriven(drawn) if _moves(changed(drawn, name, drawn.J[:0]))]
    return f"without {of_joints(fewer, 'or')}" if fewer else ""


def _undriven(drawn: Drawn) -> Iterator[str]:
    driven = set(np.array(drawn.rows)[drawn.driven].tolist())
    return (name for name in dict.fromkeys(drawn.rows) if name not in {*driven, PLANE})


def _moves(drawn: Drawn) -> bool:
    """Whether the drives move the linkage and nothing is left free."""
    held = drawn.J[~drawn.driven]
    mobile = held.shape[1] - rank(held) == drawn.driven.sum()
    return bool(mobile and rank(drawn.J) == drawn.J.shape[1])
