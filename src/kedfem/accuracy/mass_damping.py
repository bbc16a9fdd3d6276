"""A warning if mass-proportional damping resists motions that no drive prescribes."""

import numpy as np

from kedfem.accuracy.prepared import Prepared
from kedfem.motion.linkage import reference_linkage
from kedfem.motion.released_motions import free_motions
from kedfem.scene import time_grid, without_vibration

# of the speed of what moves freely over the run, and of the energy exchanged: less is not reported
LOST = 0.01


def mass_damping_warning(ready: Prepared, taken: float | None = None) -> tuple[str, ...]:
    """Effect of alpha on motions that no drive prescribes: their speed falls as exp(−α t), vibrations as exp(−α t/2).

    Rods that idly spin between balls, and mechanisms that the drive moves altogether, are not meant.

    Parameters
    ----------
    taken : energy dissipated by alpha, relative to the largest exchanged; None before the run
    """
    scene, damping, end = ready.scene, ready.model.damping, time_grid(ready.scene).end
    lost = 1.0 - float(np.exp(-damping.alpha * end))
    if not ready.linkage.mobility or without_vibration(scene) or lost < LOST:
        return ()
    if taken is not None and taken < LOST:
        return ()
    meant = [each for each in free_motions(reference_linkage(scene)) if not each.spin]
    if not meant:
        return ()
    links = list(dict.fromkeys(name for each in meant for name in each.links))
    from_ratio = " (from ratio and frequencies)" if scene.damping.ratio is not None else ""
    share = "" if taken is None else f"; it took {100 * taken:.2g} % of the largest energy exchanged"
    instead = f"beta = {damping.beta:.3g} [s] alone" if damping.beta else "beta"
    ratio = 100 * damping.alpha / (4 * np.pi)
    return (
        f"damping: alpha = {damping.alpha:.3g} 1/s{from_ratio} resists links {', '.join(links)} as they move freely: "
        f"they lose {100 * lost:.2g} % of their speed in the {end:.3g} s of this scene, a vibration at 1 Hz has "
        f"{ratio:.2g} % of its critical damping from it{share}; take {instead}, which leaves rigid motion alone, and "
        "dampers where there are some",
    )
