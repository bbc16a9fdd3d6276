"""How a mechanism with rigid links starts: their accelerations, centripetal ones too, and the strain that carries them.

A rigid link is a very stiff one. Started without strain, it would have to find it first, and ring. What it starts with
instead is the limit of a link that is stiffer still, a = a_c + b with the centripetal a_c and a b without strain:

    (M + κ K0) b = P − M R0'' − M a_c + Wᵀ λ,   a = a_c + b,   joints closed: W a = B z

and the small δ with K0 δ = P − M R0'' − M a + Wᵀ λ, joints closed. Elastic links have the acceleration that
equation (20) asks for where they are.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.linalg
from jaxtyping import Float

from kedfem.dynamics.coupling import Attachment
from kedfem.dynamics.held import HeldPart, held_part, held_substructure
from kedfem.dynamics.ports import port_rotation, port_values
from kedfem.dynamics.state import LinkState, Nodal, NodalOf
from kedfem.dynamics.substructure import mass_substructure
from kedfem.links.record import Link, mass_times

STIFFER = 1e6  # κ of a rigid link, of its mass over its stiffness
STILL = 1e6  # how much heavier an elastic link is made, than a rigid one is stiff, where only rigid ones are to strain
REST = 1e-8  # mass of a rigid link there, of its stiffness: it has its place where nothing else holds it

Spin = Float[np.ndarray, "d d"]


def rigid_start(
    links: Sequence[Link], joints: Sequence[Attachment], states: Sequence[LinkState], spin: Sequence[Spin]
) -> list[LinkState]:
    """States at the start in which rigid links accelerate as rigid bodies do.

    Parameters
    ----------
    states : without strain, F with the forces of motors and springs
    spin : per link [ω]×² of all that turns it less that of its nominal motion, world components [1/s²]
    """
    scale = [_stiffness(link) for link in links]
    centripetal = [
        _place(link, s) @ W.T if link.rigid else np.zeros_like(s.u)
        for link, s, W in zip(links, states, spin, strict=True)
    ]
    parts = [
        held_part(link, joint, 1.0, STIFFER / k)
        if link.rigid
        else held_substructure(mass_substructure(link, joint))
        for link, joint, k in zip(links, joints, scale, strict=True)
    ]
    load = [
        s.F - s.f @ s.R.T - mass_times(link.mass, c)
        for link, s, c in zip(links, states, centripetal, strict=True)
    ]
    b, forces = _coupled(parts, joints, states, load, centripetal)
    a = [x + c for x, c in zip(b, centripetal, strict=True)]
    highest = max(k for link, k in zip(links, scale, strict=True) if link.rigid)
    parts = [
        held_part(link, joint, REST * k, 1.0) if link.rigid
        else held_substructure(mass_substructure(_heavier(link, STILL * highest), joint))
        for link, joint, k in zip(links, joints, scale, strict=True)
    ]  # fmt: skip
    left = [
        s.F - mass_times(link.mass, x) if link.rigid else np.zeros_like(x)
        for link, s, x in zip(links, states, a, strict=True)
    ]
    u, _ = _coupled(parts, joints, states, left, [np.zeros_like(x) for x in left])
    return [
        replace(
            s,
            u=x,
            a=y,
            Mu=mass_times(link.mass, x),
            Ma=mass_times(link.mass, y),
            g=x @ s.R,
            port_forces=force,
        )
        for link, s, x, y, force in zip(links, states, u, a, forces, strict=True)
    ]


def _stiffness(link: Link) -> float:
    """Square of the frequency that a rigid link's stiffness gives its mass [1/s²]."""
    return float(np.linalg.eigvalsh(np.asarray(link.K0))[-1]) if link.rigid else 0.0


def _heavier(link: Link, factor: float) -> Link:
    return replace(link, mass=tuple(factor * m for m in link.mass))


def _place(link: Link, s: LinkState) -> Nodal:
    """Position against the origin that the nominal motion turns, world components; ψ has none."""
    X = link.X[:, : link.d] * ([1, 1, 0] if link.kind == "beam" else 1)
    return np.asarray(X @ s.R.T)


def _coupled(
    parts: Sequence[HeldPart], joints: Sequence[Attachment], states: Sequence[LinkState], rhs: Sequence[NodalOf],
    moved: Sequence[NodalOf],
) -> tuple[list[NodalOf], list[Float[np.ndarray, " _"]]]:  # fmt: skip
    """x of A x = r + Wᵀ λ with W (x + moved) = B z, world components, and λ in the link frames."""
    R = [s.R for s in states]
    RB = [port_rotation(joint, r).T @ joint.B for joint, r in zip(joints, R, strict=True)]
    held, reactions = zip(*(part.held(x @ r) for part, x, r in zip(parts, rhs, R, strict=True)), strict=True)
    offset = [port_values(joint, x @ r) for joint, x, r in zip(joints, moved, R, strict=True)]
    H = np.sum([b.T @ part.S @ b for part, b in zip(parts, RB, strict=True)], axis=0)
    f = np.sum(
        [b.T @ (y + part.S @ o) for part, b, y, o in zip(parts, RB, reactions, offset, strict=True)], axis=0
    )
    z = scipy.linalg.solve(H, f, assume_a="pos") if len(H) else f
    w = [b @ z - o for b, o in zip(RB, offset, strict=True)]
    forces = [part.S @ x - y for part, x, y in zip(parts, w, reactions, strict=True)]
    x = [(y + (part.Y @ v).reshape(y.shape)) @ r.T for part, y, v, r in zip(parts, held, w, R, strict=True)]
    return x, forces
