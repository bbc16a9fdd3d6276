"""A system prepared for steps of one length, with its rigid-body motion and loads over time as flat arrays."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.matrices.dense import rows_of, work_over_time
from kedfem.dynamics.rigid_body import forcing_of, forcings
from kedfem.dynamics.stepping.scheme import Scheme
from kedfem.dynamics.system.arrays import Bodies, Coefficients, Constraints, Ends
from kedfem.dynamics.system.ends import line_weights
from kedfem.dynamics.system.forces.follower_loads import own_patterns
from kedfem.dynamics.system.forces.stresses import NO_TERMS, Stressed, stressed
from kedfem.dynamics.system.layout import TOLERANCE, as_arrays, coefficients, factored
from kedfem.dynamics.system.record import System, is_affine, stiffness_factors, without_unknowns
from kedfem.dynamics.system.sparse import Part
from kedfem.dynamics.system.state import Driving
from kedfem.motion.rigid import RigidMotion

Motion = Callable[[Float[np.ndarray, " T"]], RigidMotion]
"""Rigid-body motion at given times."""


@dataclass(frozen=True, slots=True)
class Ready:
    """A system made ready for steps of one length: all bodies factored once, everything as flat arrays.

    stressed : stress stiffness on the coordinates, if geometric stiffening counts
    halves : the same for steps half as long, once these have been needed
    condensed : with large bodies in static modes, once a balance has been sought: `starts.condensed`
    """

    system: System
    scheme: Scheme
    c: Coefficients
    parts: list[Part]
    bodies: Bodies
    ends: Ends
    constraints: Constraints
    stressed: Stressed | None = None
    halves: list["Ready"] = field(default_factory=list)
    condensed: list[Any] = field(default_factory=list)


def ready(system: System, scheme: Scheme, tolerance: float = TOLERANCE) -> Ready:
    """Factor all bodies of a system for a scheme."""
    model = system.model
    linear = all(without_unknowns(system, each) or is_affine(system, each) for each in system.constraints)
    single = linear and all(link.fit is None for link in model.links) and system.stiffening is None
    c = coefficients(scheme, model.damping, model.links, single, tolerance)
    parts = factored(model.links, model.joints, c)
    modes = None if system.stiffening is None else stressed(system.stiffening, parts)
    return Ready(system, scheme, c, parts, *as_arrays(system, parts), modes)


Loads = Sequence[Float[np.ndarray, "T _ _"]]
"""P − M R0'' of all bodies over time, world components."""


def driving(of: Ready, motion: RigidMotion, loads: Loads | None = None) -> Driving:
    """The rigid-body motion and loads on all coordinates over the times of a motion.

    Parameters
    ----------
    loads : if they are there already
    """
    model = of.system.model
    forcing = forcings(model, motion) if loads is None else forcing_of(model, motion, loads)
    F = [work_over_time(part, x.F).reshape(len(motion.t), -1) for part, x in zip(of.parts, forcing, strict=True)]
    drives = motion.drives if motion.drives.shape[1] else np.zeros((len(motion.t), 1))
    stations = [line_weights(end, motion) for end in of.system.ends if end.line is not None]
    weights = np.concatenate([np.zeros((len(motion.t), 0)), *stations], axis=1)
    varied = [getattr(each.law, "factor", None) for each in of.system.constraints]
    springs = stiffness_factors(varied, motion.t, motion.phi)
    rows = (motion.t, motion.R, motion.p, motion.v, motion.omega, drives, np.concatenate(F, axis=1), amounts(of, motion))
    terms = NO_TERMS if of.stressed is None else of.stressed.over(forcing, motion)
    # other strides would be compiled for anew
    return Driving(*(np.ascontiguousarray(x) for x in (*rows, weights, springs, *terms)))


def amounts(of: Ready, motion: RigidMotion) -> Float[np.ndarray, "T w"]:
    """Amounts of the follower loads over time."""
    every = [load.factor(motion.t, motion.phi) for _, load in own_patterns(of.system.model.loads)]
    return np.stack(every, axis=1) if every else np.zeros((len(motion.t), 0))


def shortened(of: Ready, h: float) -> Ready:
    """The same for steps of another length."""
    made = ready(of.system, replace(of.scheme, h=h), of.c.tolerance)
    return replace(made, constraints=of.constraints)


def displacements(of: Ready, k: int, x: Float[np.ndarray, "T N"]) -> Float[np.ndarray, "T n d"]:
    """Rows of body k's state, or of its rates, over time from the coordinates of all bodies."""
    link, bodies = of.system.model.links[k], of.bodies
    own = x[:, bodies.at[k] : bodies.at[k + 1]].reshape(len(x), link.d, link.n)
    return rows_of(link, of.parts[k], own)
