"""How far deflections leave joints open, and the nearest that does not."""

import numpy as np

from kedfem.dynamics.system.starts.instant import Flat, Instant
from kedfem.dynamics.system.starts.internal_forces import moved, own
from kedfem.links.reduced import overall_length

OPEN = 1e-4  # of the largest link: what joints may be open in a balance; found ones are at 1e-9
CLOSED = 1e-9  # of displacements at interface points: open by less is closed but for rounding
FAR = 1e4  # of the largest link: displacements of unconstrained links


def gaps(now: Instant, u: Flat, z: Flat) -> list[Flat]:
    """How far the interface points of each body are from where the interface unknowns have them."""
    every = zip(now.of.parts, now.of.system.model.joints, strict=True)
    return [part.W @ u[own(now.of, k)] - joint.B @ z[joint.columns] for k, (part, joint) in enumerate(every)]


def closed(now: Instant, u: Flat) -> Flat:
    """The deflection with closed joints that is nearest to another."""
    out = u.copy()
    for k, open_ in enumerate(gaps(now, u, now.interface(u)) if u.any() else ()):
        W, here = now.of.parts[k].W, own(now.of, k)
        if np.abs(open_).max(initial=0.0) > CLOSED * np.abs(W @ u[here]).max(initial=0.0):
            out[here] -= np.linalg.lstsq(W, open_)[0]
    return out


def stands_off(now: Instant, u: Flat, z1: Flat | None) -> str:
    """Which link a deflection leaves off its joints, or farther off than anything holds it; nothing if it does neither.

    Forces of open joints balance nothing: iterations of large motions may settle there. So may they where what nothing
    holds has gone so far that changes are small beside it.
    """
    system, z = now.of.system, now.interface(u)
    links = system.model.links
    off = [np.abs(x).max(initial=0.0) for x in gaps(now, u, z)]
    largest, far = max(map(overall_length, links)), moved(now.of, u)
    if max(far) > FAR * largest and max(off) <= OPEN * max(far):
        return f"link '{links[int(np.argmax(far))].name}' would move by {max(far):.3g} m"
    size = OPEN * largest
    if max(off) > size:
        return f"link '{links[int(np.argmax(off))].name}' would be {max(off):.3g} m off its joints"
    C, e = now.measured(z, z1)
    open_ = np.abs(e[0]) * now.hard(C)
    if open_.max(initial=0.0) > size:
        return f"{system.constraints[int(open_.argmax())].name} would be open by {open_.max():.3g} (m or rad)"
    return ""
