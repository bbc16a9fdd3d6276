"""Facts about the model of each link: elements, unknowns, mass properties."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from kedfem.dynamics.inertias import Inertias, inertias_of_model
from kedfem.dynamics.model import Model, segments
from kedfem.links.bodies import inertia_of
from kedfem.links.record import Link
from kedfem.motion.linkage import Linkage
from kedfem.scene import Scene, moments_of_inertia

ELEMENTS = {
    "hexahedron27": "hex27", "hexahedron20": "hex20", "hexahedron": "hex8", "tetra10": "tet10",
    "quad9": "quad9", "line3": "beam3", "line": "beam2",
    **{f"line{nodes}": f"beam{nodes}" for nodes in (4, 5, 7, 9)},
}  # fmt: skip
"""What users call elements, by their name in meshio."""


def link_facts(scene: Scene, linkage: Linkage, model: Model) -> dict[str, Mapping[str, Any]]:
    """Link → facts about it, as `Results.links` has them."""
    inertias = inertias_of_model(scene, linkage, model)
    out = {name: element_facts(parts) for name, parts in segments(model).items()}
    out |= {prescribed.link.name: {"model": "rigid, with the drive"} for prescribed in model.prescribed}
    return {name: {**facts, **_masses(inertias, linkage.bodies.index(name))} for name, facts in out.items()}


def element_facts(parts: Sequence[Link]) -> Mapping[str, Any]:
    """Facts of a link, or of its segments: `model`, `elements`, `unknowns`."""
    elements, unknowns = sum(len(part.cells) for part in parts), sum(part.unknowns for part in parts)
    return {"model": element_words(parts), "elements": elements, "unknowns": unknowns}


def element_words(parts: Sequence[Link]) -> str:
    """The elements of a link, or of its segments, with frames and modes, in words."""
    first, functions = parts[0], [link.n for link in parts]
    kind = "rigid" if first.rigid else ELEMENTS[first.cell_type]
    if first.fit is not None and not first.rigid:
        kind += f", {len(parts)} co-rotational segments" if len(parts) > 1 else ", 1 co-rotational segment"
    elif first.fit is not None:
        kind += ", co-rotational"
    if first.full and not first.rigid:
        low, high = min(functions), max(functions)
        kind += f", {low} modes" if low == high else f", {low} to {high} modes"
        kind += " each" if len(parts) > 1 else ""
    return kind


def _masses(inertias: Inertias, body: int) -> Mapping[str, Any]:
    """Mass, centre and inertia of a body; nothing of one without mass."""
    centre = inertias.centre_of(body)
    if centre is None:
        return {}
    mass, arm = float(inertias.mass[body]), centre - inertias.centre
    J = inertia_of(inertias.second[body] - mass * np.outer(arm, arm))
    J[2, 2] += inertias.spin[body]
    inertia = np.array(moments_of_inertia(J))
    return {"mass [kg]": mass, "centre of mass [m]": centre, "inertia [kg m^2]": inertia}
