"""Side effects of damping: the error by numerical damping, and free motions that mass-proportional damping slows.

With a small ρ∞ a mode with ω h of 0.3 decays within some periods, and one with ω h of 3 within a few steps, both in
steps of h and in steps of 2 h, so that the two differ by less than their errors. In the same steps with ρ∞ = 0.95 it
stays. The difference from these is 0.5 to 1.4 of the true error at ρ∞ ≤ 0.3, whether the steps resolve the vibration or
not.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from kedfem.accuracy.histories import Histories, histories, relative_errors
from kedfem.accuracy.prepared import Prepared
from kedfem.accuracy.resolution import fewest_steps
from kedfem.accuracy.variants import with_analysis
from kedfem.dynamics.history import Block
from kedfem.dynamics.stepping.scheme import stable_rotation
from kedfem.errors import KedfemError
from kedfem.motion.linkage import linearised_linkage
from kedfem.motion.released_motions import free_motions
from kedfem.scene import Scene, percentage, time_grid, without_vibration

STRONG = 0.7  # ρ∞ up to which a run is compared; above, steps twice as long show 0.55 and more of the true error
LITTLE = 0.95, 0.9, 0.8  # ρ∞ of the compared run: the first in which no vibration grows
# share of the speed of free motion lost over the run, or of the energy exchanged, below which nothing is reported
LOST = 0.01


def damped_errors(ready: Prepared, base: Histories, zeros: set[str] | None = None) -> dict[str, float]:
    """Error of each channel by numerical damping, at the worst time, relative to its peak; empty if there is little.

    Parameters
    ----------
    base : the channels of the prepared scene
    zeros : set to which the names of channels that are zero beside others are added
    """
    if ready.scene.analysis.rho_inf > STRONG:
        return {}
    for rho_inf in LITTLE:
        scene, rotation = with_analysis(ready.scene, rho_inf=rho_inf), _LargestRotation()
        if time_grid(scene).steps < fewest_steps(scene):
            continue
        grows = fewest_steps(with_analysis(scene, rho_inf=1.0)) == math.inf  # in links that rotate too far in a step
        try:
            found = histories(replace(ready, scene=scene), look=rotation.add if grows else _unwatched, near=base.begun)
        except KedfemError:  # the run needs the damping
            continue
        if rotation.most <= stable_rotation(rho_inf):
            return relative_errors(base, found, zeros)
    return {}


def damping_remedy(scene: Scene, step: Mapping[str, float], damped: Mapping[str, float]) -> str:
    """Advice to reduce the error of the step if most of it is numerical damping; else empty."""
    if max(damped.values(), default=0.0) <= max(step.values(), default=0.0):
        return ""
    return (
        f"analysis.rho_inf = {scene.analysis.rho_inf:g} damps vibration that its steps do not resolve: a shorter step "
        "resolves it, 0.95 keeps it, a smoother start or load excites less of it"
    )


@dataclass
class _LargestRotation:
    """The largest rotation of a link in a step so far [rad]."""

    most: float = 0.0

    def add(self, block: Block) -> None:
        """Evaluate the steps of a block."""
        for R in (link.R for link in block.links if len(link.R) > 1):
            rotations = np.einsum("tji,tjk->tik", R[:-1], R[1:])
            sine = np.linalg.norm(rotations - rotations.transpose(0, 2, 1), axis=(1, 2)) / math.sqrt(8)
            self.most = max(self.most, float(np.arcsin(np.minimum(sine, 1.0)).max()))


def _unwatched(block: Block) -> None:
    pass


def mass_damping_warning(ready: Prepared, taken: float | None = None) -> tuple[str, ...]:
    """A warning if alpha slows motions that no drive prescribes: speed falls as exp(−α t), vibration as exp(−α t/2).

    Rods that spin between spherical joints are not counted.

    Parameters
    ----------
    taken : energy dissipated by alpha, relative to the largest energy exchanged [-]; None before the run
    """
    scene, damping, end = ready.scene, ready.model.damping, time_grid(ready.scene).end
    lost = 1.0 - float(np.exp(-damping.alpha * end))
    if not ready.linkage.mobility or without_vibration(scene) or lost < LOST:
        return ()
    if taken is not None and taken < LOST:
        return ()
    meant = [each for each in free_motions(linearised_linkage(scene)) if not each.spin]
    if not meant:
        return ()
    links = list(dict.fromkeys(name for each in meant for name in each.links))
    from_ratio = " (from ratio and frequencies)" if scene.damping.ratio is not None else ""
    share = "" if taken is None else f"; it took {percentage(taken)} of the largest energy exchanged"
    instead = f"beta = {damping.beta:.3g} [s] alone" if damping.beta else "beta"
    ratio = damping.alpha / (4 * np.pi)
    return (
        f"damping: alpha = {damping.alpha:.3g} 1/s{from_ratio} resists links {', '.join(links)} as they move freely: "
        f"they lose {percentage(lost)} of their speed in the {end:.3g} s of this scene, a vibration at 1 Hz has "
        f"{percentage(ratio)} of its critical damping from it{share}; take {instead}, which leaves rigid motion alone, "
        "and dampers where there are some",
    )
