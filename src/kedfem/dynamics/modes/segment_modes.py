"""Modes for reduced segments of links with co-rotational frames: as few as bend like the segment itself.

A segment bends under the forces of its cuts and joints: a handful of deflections, whose strain energy is small beside
what each of their components alone would take (a bar bends by s² across and s y along it, and its section changes by y z:
without any one of these it is stiff). So modes are not sorted by size. From all of them the one goes first whose
loss costs the deflections least strain energy, the others free to answer. With K the stiffness on the modes and C a
deflection's coefficients, the loss of qᵀ C costs

    J(q) = tr[(qᵀ C)ᵀ (qᵀ C) F(q)⁻¹],   F(q) = (q ⊗ I)ᵀ K⁻¹ (q ⊗ I),

and q is the direction in which Σ |qᵀ C|² over tr F(q) is least.

Besides the deflections of the linear equation a segment needs what a large turn adds at its ends, `_turned_ports`.
"""

from collections.abc import Sequence

import numpy as np
import scipy.linalg

from kedfem.arrays import Float, Int
from kedfem.dynamics.joints.attachments import Attachment
from kedfem.dynamics.joints.ports import port_columns
from kedfem.dynamics.matrices.substructure import Substructure
from kedfem.dynamics.modes.reduction import Basis, energy_product, orthonormal
from kedfem.links.record import Link, mass_times
from kedfem.links.reduced import mass_orthonormal, projected_stiffness, rigid_functions, rigid_modes

CANDIDATES = 32  # modes to choose from
SHAPES = 24  # deflections that count
SEEN = 1e-8  # of the energy of the largest: deflections below are left out
UNIT = 1e-4  # energy norm of the answers to single forces at ports, of that of all deflections
HELD = 1e-2  # least singular value of the ports' values on modes, of what all candidates reach


def segment_basis(
    link: Link, joint: Attachment, part: Substructure, deflections: Sequence[Float[np.ndarray, "n d"]]
) -> Basis:
    """Modes of a segment, most important first.

    Parameters
    ----------
    joint, part : of the segment; factored with A = K0
    deflections : that it is expected to take, as large as they are

    Returns
    -------
    Basis
        Weights are what the loss of each function costs the deflections, of their strain-energy norm.
    """
    modes = rigid_modes(link)
    deflections = [_relative(link, modes, x) for x in deflections]
    of_ports = *_answers(link, joint, part, deflections), *_turned_ports(link, joint, part, deflections)
    shapes = _shapes(link, [*of_ports, *deflections])
    rigid = mass_orthonormal(link, rigid_functions(link))
    H = energy_product(link)
    S = np.concatenate(list(shapes), axis=1)
    S = S - rigid @ (rigid.T @ np.asarray(link.mass[0] @ S))
    functions = orthonormal(S, H, 1e-13)[0][:, :CANDIDATES]
    r, f, d = rigid.shape[1], functions.shape[1], link.d
    K = projected_stiffness(link, np.concatenate([rigid, functions], axis=1))
    K_oo, K_or = K[r * d :, r * d :], K[r * d :, : r * d]
    K = K_oo - K_or @ np.linalg.pinv(K[: r * d, : r * d], rcond=1e-9, hermitian=True) @ K_or.T
    C = functions.T @ np.asarray(H @ S)  # orthonormal in H
    C = C.reshape(f, -1, d).transpose(1, 0, 2)
    at_ports = (joint.weights @ x[joint.nodes] for x in (rigid, functions))
    kept, others, losses = _eliminated(K, C, *at_ports)
    whole = float(np.vdot(C, (C.reshape(len(C), -1) @ K).reshape(C.shape)))
    return Basis(np.concatenate([rigid, functions @ kept], axis=1), functions @ others, np.sqrt(losses / whole))


def _relative(link: Link, modes: Float[np.ndarray, "k r"], g: Float[np.ndarray, "n d"]) -> Float[np.ndarray, "n d"]:
    """A deflection without the segment's mean rigid motion."""
    M = np.stack([mass_times(link.mass, x.reshape(link.n, link.d)).ravel() for x in modes.T], axis=1)
    return np.asarray(g - (modes @ np.linalg.solve(modes.T @ M, M.T @ g.ravel())).reshape(g.shape))


def _answers(
    link: Link, joint: Attachment, part: Substructure, deflections: Sequence[Float[np.ndarray, "n d"]]
) -> list[Float[np.ndarray, "n d"]]:
    """Static answers of a segment to forces at its ports that hold each other, each of a small strain energy."""
    g = _free(link, part, port_columns(joint, link.n), np.arange(len(joint.keep)))
    energy = np.sqrt(np.maximum(np.einsum("kc,kc->c", g, np.asarray(link.K0 @ g)), 0.0))
    whole = np.sqrt(sum(float(np.vdot(x, link.K0 @ x.ravel())) for x in deflections)) or 1.0
    scaled = g / np.where(energy > 0, energy, 1.0) * (UNIT * whole)
    return [x.reshape(link.n, link.d) for x in scaled.T]


def _free(
    link: Link, part: Substructure, W: Float[np.ndarray, "k q"], here: Int[np.ndarray, " g"]
) -> Float[np.ndarray, "k c"]:
    """K0⁻¹ of forces at some port components that hold each other."""
    balanced = scipy.linalg.null_space(rigid_modes(link).T @ W[:, here], rcond=1e-9)
    q = W.shape[1]
    y = part.Y[:, here] @ balanced
    F = np.linalg.inv(part.S)[q:, q:]  # what the anchors take is given back: forces in balance need none of it
    return np.asarray(y - part.Y[:, q:] @ np.linalg.lstsq(F, y[part.anchors], rcond=1e-9)[0])


def _turned_ports(
    link: Link, joint: Attachment, part: Substructure, deflections: Sequence[Float[np.ndarray, "n d"]]
) -> list[Float[np.ndarray, "n d"]]:
    """How cuts and joints strain a segment that sees their turns w as small: by ½ w × (w × r) at their points r.

    Neighbours with other turns share the points of a cut; what one takes for a turn is a stretch for the other.
    """
    W, rigid = port_columns(joint, link.n), rigid_modes(link)
    port = joint.keep // link.d
    g = np.stack([x.ravel() for x in deflections], axis=1)
    values, modes = W.T @ g, W.T @ rigid
    out = []
    for group in _groups(joint, link.d):
        here = np.flatnonzero(np.isin(port, group))
        answers = _free(link, part, W, here)
        if not answers.shape[1]:
            continue
        answers /= np.abs(W[:, here].T @ answers).max()
        # how the group moves as a whole, and so turns
        moved = np.linalg.lstsq(modes[here], values[here], rcond=1e-9)[0][link.d if link.d == 2 else 3 :]
        arms = joint.points[port[here]] - joint.points[group].mean(axis=0)
        e = np.eye(3)[joint.keep[here] % link.d]
        needed = np.stack([_shortened(w, arms, e, link.d) for w in moved.T], axis=1)
        c = np.linalg.lstsq(np.concatenate([W[:, here].T @ answers, modes[here]], axis=1), needed, rcond=1e-9)[0]
        out.append(answers @ c[: answers.shape[1]])
    return [x.reshape(link.n, link.d) for each in out for x in each.T]


def _shortened(
    turns: Float[np.ndarray, " r"], arms: Float[np.ndarray, "q 3"], e: Float[np.ndarray, "q 3"], d: int
) -> Float[np.ndarray, " q"]:
    """½ w × (w × r) along each component; turns in the order of `rigid_modes`: about z, x, y."""
    w = np.array([0.0, 0.0, turns[0]]) if d == 2 else np.array([turns[1], turns[2], turns[0]])
    return np.asarray((np.cross(w, np.cross(w, arms)) / 2 * e).sum(axis=1))


def _groups(joint: Attachment, d: int) -> list[Int[np.ndarray, " p"]]:
    """Ports that belong together: of each joint, and of each cut the d that follow each other."""
    cuts = np.flatnonzero([name == "" for name in joint.joints])
    named = [np.flatnonzero([x == name for x in joint.joints]) for name in dict.fromkeys(joint.joints) if name]
    return [*named, *(cuts[k : k + d] for k in range(0, len(cuts), d))]


def _shapes(link: Link, deflections: Sequence[Float[np.ndarray, "n d"]]) -> Float[np.ndarray, "m n d"]:
    """Principal deflections by strain energy, as large as they are together."""
    g = np.stack([x.ravel() for x in deflections])
    G = g @ np.asarray(link.K0 @ g.T)
    values, vectors = np.linalg.eigh((G + G.T) / 2)
    values, vectors = values[::-1][:SHAPES], vectors[:, ::-1][:, :SHAPES]
    kept = values > SEEN * values[0]
    return np.asarray((vectors[:, kept].T @ g).reshape(-1, link.n, link.d))


def _eliminated(
    K: Float[np.ndarray, "k k"], C: Float[np.ndarray, "m f d"], rigid: Float[np.ndarray, "p r"],
    ports: Float[np.ndarray, "p f"],
) -> tuple[Float[np.ndarray, "f s"], Float[np.ndarray, "f c"], Float[np.ndarray, " c"]]:  # fmt: skip
    """Coefficients of modes that cannot go, of those that can, most important first, and what their loss costs.

    Parameters
    ----------
    K : stiffness of the modes, rigid ones free to answer
    rigid, ports : values of the rigid and the other modes at ports, which must not depend on each other

    Returns
    -------
    Orthonormal coefficients; strain energy that the loss of each costs the deflections
    """
    f, d = C.shape[1:]
    least = HELD * _smallest(np.concatenate([rigid, ports], axis=1))
    target = np.asarray(K @ C.reshape(len(C), -1).T)  # forces of the deflections
    Z, gone, losses = np.eye(f), [], []
    before = float(np.vdot(C.reshape(len(C), -1).T, target))
    while Z.shape[1] > 1:
        k, T = Z.shape[1], np.kron(Z, np.eye(d))
        flexibility = np.linalg.inv(T.T @ K @ T)
        now = (flexibility @ (T.T @ target)).reshape(k, d, -1)
        trace = np.einsum("akbk->ab", flexibility.reshape(k, d, k, d))
        cheapest = scipy.linalg.eigh(np.einsum("adm,bdm->ab", now, now), (trace + trace.T) / 2)[1]
        for q in (cheapest / np.linalg.norm(cheapest, axis=0)).T:
            rest = Z @ scipy.linalg.null_space(q[None])
            if _smallest(np.concatenate([rigid, ports @ rest], axis=1)) >= least:
                break
        else:
            break
        T = np.kron(rest, np.eye(d))
        after = float(np.vdot(x := T.T @ target, np.linalg.solve(T.T @ K @ T, x)))
        gone.append(Z @ q)
        losses.append(max(before - after, 0.0))
        Z, before = rest, after
    return Z, np.array(gone[::-1]).reshape(-1, f).T, np.array(losses[::-1])


def _smallest(values: Float[np.ndarray, "p c"]) -> float:
    """Least singular value of port values; 0 where there are fewer modes than ports."""
    if not len(values):
        return 1.0
    return 0.0 if values.shape[1] < len(values) else float(np.linalg.svd(values, compute_uv=False)[-1])
