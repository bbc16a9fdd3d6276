"""Modes for reduced segments of links with co-rotational frames: as few as keep the segment's flexibility.

A segment bends under the forces of its cuts and joints. These few deflections have a small strain energy compared with
that of each of their components alone (a bar bends by s² across and s y along it, and its section changes by y z:
without any one of these it is stiff). So modes are not sorted by size. Modes are removed one by one, first the one whose
loss adds least strain energy to the deflections while the others adjust. With K the stiffness on the modes and C a
deflection's coefficients, the loss of qᵀ C adds

    J(q) = tr[(qᵀ C)ᵀ (qᵀ C) F(q)⁻¹],   F(q) = (q ⊗ I)ᵀ K⁻¹ (q ⊗ I),

and q is the direction in which Σ |qᵀ C|² over tr F(q) is least.

Beside the deflections of the linear equation a segment needs those that a large rotation adds at its ends,
`_rotated_ports`.
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
from kedfem.links.reduced import mass_orthonormal, projected_stiffness, rigid_body_functions, rigid_modes

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
    g = _relative(link, np.stack([x.ravel() for x in deflections], axis=1))
    S = _shapes(link, np.concatenate([_answers(link, joint, part, g), _rotated_ports(link, joint, part, g), g], axis=1))
    rigid = mass_orthonormal(link, rigid_body_functions(link))
    H = energy_product(link)
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


def _relative(link: Link, g: Float[np.ndarray, "k c"]) -> Float[np.ndarray, "k c"]:
    """Deflections without the segment's mean rigid motion."""
    modes = rigid_modes(link)
    M = np.stack([mass_times(link.mass, x.reshape(link.n, link.d)).ravel() for x in modes.T], axis=1)
    return np.asarray(g - modes @ np.linalg.solve(modes.T @ M, M.T @ g))


def _answers(
    link: Link, joint: Attachment, part: Substructure, deflections: Float[np.ndarray, "k c"]
) -> Float[np.ndarray, "k a"]:
    """Static deflections of a segment under balanced forces at its ports, each of a small strain energy."""
    g = _free(link, part, port_columns(joint, link.n), np.arange(len(joint.keep)))
    energy, whole = (np.sqrt(np.maximum((x * np.asarray(link.K0 @ x)).sum(axis=0), 0.0)) for x in (g, deflections))
    return np.asarray(g / np.where(energy > 0, energy, 1.0) * (UNIT * (np.linalg.norm(whole) or 1.0)))


def _free(
    link: Link, part: Substructure, W: Float[np.ndarray, "k q"], here: Int[np.ndarray, " g"]
) -> Float[np.ndarray, "k c"]:
    """K0⁻¹ of balanced forces at some port components."""
    balanced = scipy.linalg.null_space(rigid_modes(link).T @ W[:, here], rcond=1e-9)
    q = W.shape[1]
    y = part.Y[:, here] @ balanced
    F = np.linalg.inv(part.S)[q:, q:]  # what the anchors take is given back: forces in balance need none of it
    return np.asarray(y - part.Y[:, q:] @ np.linalg.lstsq(F, y[part.anchors], rcond=1e-9)[0])


def _rotated_ports(
    link: Link, joint: Attachment, part: Substructure, deflections: Float[np.ndarray, "k c"]
) -> Float[np.ndarray, "k a"]:
    """Strain of a segment that treats rotations w of cuts and joints as small: ½ w × (w × r) at their points r.

    Neighbours with other rotations share the points of a cut; a rotation of one is a stretch of the other.
    """
    W, rigid = port_columns(joint, link.n), rigid_modes(link)
    port = joint.keep // link.d
    values, modes = W.T @ deflections, W.T @ rigid
    out = [np.zeros((link.unknowns, 0))]
    for group in _groups(joint, link.d):
        here = np.flatnonzero(np.isin(port, group))
        answers = _free(link, part, W, here)
        if not answers.shape[1]:
            continue
        answers /= np.abs(W[:, here].T @ answers).max()
        # how the group moves as a whole, and so turns
        moved = np.linalg.lstsq(modes[here], values[here], rcond=1e-9)[0][link.d if link.d == 2 else 3 :]
        arms = joint.points[port[here]] - joint.points[group].mean(axis=0)
        needed = _shortened(moved, arms, np.eye(3)[joint.keep[here] % link.d])
        c = np.linalg.lstsq(np.concatenate([W[:, here].T @ answers, modes[here]], axis=1), needed, rcond=1e-9)[0]
        U, size, _ = np.linalg.svd(c[: answers.shape[1]], full_matrices=False)
        out.append(answers @ (U * size))  # as many, with the sum of squares of all
    return np.concatenate(out, axis=1)


def _shortened(
    turns: Float[np.ndarray, "r c"], arms: Float[np.ndarray, "q 3"], e: Float[np.ndarray, "q 3"]
) -> Float[np.ndarray, "q c"]:
    """½ w × (w × r) along each component; turns in the order of `rigid_modes`: about z, x, y; in a plane about z."""
    w = np.roll(np.pad(turns, ((0, 3 - len(turns)), (0, 0))), -1, axis=0)
    return np.asarray(((arms @ w) * (e @ w) - (arms * e).sum(axis=1)[:, None] * (w**2).sum(axis=0)) / 2)


def _groups(joint: Attachment, d: int) -> list[Int[np.ndarray, " p"]]:
    """Ports that belong together: of each joint, and of each cut the d that follow each other."""
    cuts = np.flatnonzero([name == "" for name in joint.joints])
    named = [np.flatnonzero([x == name for x in joint.joints]) for name in dict.fromkeys(joint.joints) if name]
    return [*named, *(cuts[k : k + d] for k in range(0, len(cuts), d))]


def _shapes(link: Link, g: Float[np.ndarray, "k c"]) -> Float[np.ndarray, "n md"]:
    """Components of the principal deflections by strain energy, as large as they are together, side by side."""
    G = g.T @ np.asarray(link.K0 @ g)
    values, vectors = np.linalg.eigh((G + G.T) / 2)
    values, vectors = values[::-1][:SHAPES], vectors[:, ::-1][:, :SHAPES]
    shapes = (vectors[:, values > SEEN * values[0]].T @ g.T).reshape(-1, link.n, link.d)
    return np.concatenate(list(shapes), axis=1)


def _eliminated(
    K: Float[np.ndarray, "k k"], C: Float[np.ndarray, "m f d"], rigid: Float[np.ndarray, "p r"],
    ports: Float[np.ndarray, "p f"],
) -> tuple[Float[np.ndarray, "f s"], Float[np.ndarray, "f c"], Float[np.ndarray, " c"]]:  # fmt: skip
    """Coefficients of required modes, of others by importance, and the strain energy that the loss of each adds.

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
    Z, gone, losses = np.eye(f), [], []
    flexibility, now = np.linalg.inv(K).reshape(f, d, f, d), C.transpose(1, 2, 0)  # of what is left, 0 along what is gone
    while Z.shape[1] > 1:
        moved = Z.T @ now.reshape(f, -1)
        trace = Z.T @ np.einsum("akbk->ab", flexibility) @ Z
        L = np.linalg.cholesky((trace + trace.T) / 2)
        moved = np.linalg.solve(L, moved)
        cheapest = Z @ np.linalg.solve(L.T, np.linalg.eigh(moved @ moved.T)[1])
        for q in (cheapest / np.linalg.norm(cheapest, axis=0)).T:
            rest = Z @ np.linalg.qr((q @ Z)[:, None], mode="complete")[0][:, 1:]
            if _smallest(np.concatenate([rigid, ports @ rest], axis=1)) >= least:
                break
        else:
            break
        flexibility, now, loss = _held(flexibility, now, q)
        gone.append(q)
        losses.append(loss)
        Z = rest
    return Z, np.array(gone[::-1]).reshape(-1, f).T, np.array(losses[::-1])


def _held(
    flexibility: Float[np.ndarray, "f d f d"], now: Float[np.ndarray, "f d m"], q: Float[np.ndarray, " f"]
) -> tuple[Float[np.ndarray, "f d f d"], Float[np.ndarray, "f d m"], float]:
    """Flexibility and deflections with a mode fixed at zero, and the strain energy that this adds: J(q)."""
    f, d = flexibility.shape[:2]
    response = np.einsum("akbl,b->akl", flexibility, q)  # to forces on the mode, (f, d, d)
    L = np.linalg.cholesky((q @ response.reshape(f, d * d)).reshape(d, d))  # of F(q)
    response = np.linalg.solve(L, response.reshape(f * d, d).T).T
    force = np.linalg.solve(L, (q @ now.reshape(f, -1)).reshape(d, -1))
    left = flexibility - (response @ response.T).reshape(flexibility.shape)
    return left, now - response.reshape(f, d, d) @ force, float((force**2).sum())


def _smallest(values: Float[np.ndarray, "p c"]) -> float:
    """Least singular value of port values; 0 where there are fewer modes than ports."""
    if not len(values):
        return 1.0
    return 0.0 if values.shape[1] < len(values) else float(np.linalg.svd(values, compute_uv=False)[-1])
