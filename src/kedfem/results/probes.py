"""Probes: elastic and total motion, deflection and stress at points of links."""

from collections.abc import Callable

import numpy as np

from kedfem.arrays import Float
from kedfem.dynamics.history import Block
from kedfem.dynamics.joints.attachments import used_columns
from kedfem.dynamics.joints.places import on_part
from kedfem.dynamics.model import Model
from kedfem.links.point_rows import stress_rows
from kedfem.links.recovery import von_mises
from kedfem.motion.linkage import Linkage, linkage
from kedfem.motion.released_motions import components
from kedfem.results.channels import STRESS, XYZ, Channel
from kedfem.results.deflections import deflection
from kedfem.results.link_points import LinkPoint, Point, link_point
from kedfem.results.recorded import Recorded, Rows
from kedfem.scene import ForceLoad, LineLoad, Probe, Scene, TorqueLoad

ELASTIC = {"displacement": "u", "velocity": "v", "acceleration": "a"}
UNITS = {"velocity": "m/s", "acceleration": "m/s^2", "total_velocity": "m/s", "total_acceleration": "m/s^2"}


def probe_channels(scene: Scene, model: Model, linked: Linkage | None = None) -> list[Recorded]:
    """The channels of all probes; SceneError of a point outside its link.

    Parameters
    ----------
    linked : the scene's linkage, if available
    """
    if not scene.output.probes:
        return []
    linked = linked or linkage(scene)
    return [_channel(scene, model, linked, name, probe) for name, probe in scene.output.probes.items()]


def _channel(scene: Scene, model: Model, linked: Linkage, name: str, probe: Probe) -> Recorded:
    where = f"output.probes.{name}.at"
    if probe.quantity == "stress":
        return _stress(scene, model, where, name, probe)
    point = link_point(model, linked, where, probe.link, np.asarray(probe.at))
    if probe.quantity == "deflection":
        values, text = deflection(scene, model, linked, name, probe, point)
    else:
        values, text = _motion(probe, point), _words(linked, probe)
    columns = XYZ[:2] if point.planar else XYZ
    unit, place = UNITS.get(probe.quantity, "m"), _place(probe.link, point.X)
    channel = Channel(f"probes/{name}/{probe.quantity}", columns, unit, str(probe.frame), f"{text} {place}")
    return Recorded(channel, lambda block: values(block)[:, : len(columns)])


def _place(link: str, X: Point) -> str:
    return f"of link {link} at {components(X, form='.6g')} m in the reference position"


def _words(linked: Linkage, probe: Probe) -> str:
    """Quantity and frame of a probe of motion."""
    match probe.quantity:
        case "position":
            return "position"
        case "travel":
            return "displacement from the reference position"
        case "total_velocity" | "total_acceleration":
            return f"{probe.quantity.removeprefix('total_')}, rigid and elastic,"
        case quantity if linked.mobility:
            return f"{quantity}, from the rigid motion with the free motions held in the reference position,"
        case quantity:
            return f"elastic {quantity}"


def _motion(probe: Probe, point: LinkPoint) -> Callable[[Block], Rows]:
    """The values of a probe of elastic or total motion."""
    match probe.quantity:
        case "position":
            return point.position
        case "travel":
            return lambda block: point.position(block) - point.X
        case "total_velocity":
            return point.velocity
        case "total_acceleration":
            return point.acceleration
    field, turned = ELASTIC[probe.quantity], probe.frame == "link"

    def elastic(block: Block) -> Rows:
        x = point.elastic(block, field)
        if turned:
            x = (x[:, None] @ block.motion.R[:, point.body])[:, 0] @ point.axes
        return np.asarray(x)

    return elastic


def _stress(scene: Scene, model: Model, where: str, name: str, probe: Probe) -> Recorded:
    drawn, kinks = np.asarray(probe.at), _kinks(scene, probe.link)
    k, at = on_part(dict(enumerate(model.links)), probe.link, drawn, lambda link: stress_rows(link, where, drawn, kinks))
    dofs, dense = used_columns(at.stress)
    nodes, components = np.divmod(dofs, model.links[k].d)

    def stress(block: Block) -> Rows:
        s = block.links[k].g[:, nodes, components] @ dense.T
        return np.column_stack([s, von_mises(s)])

    axes = "" if model.links[k].meshed else " in the axes of its section (x along the beam)"
    text = f"stress{axes} {_place(probe.link, at.X)}"
    return Recorded(Channel(f"probes/{name}/stress", STRESS, "Pa", "link", text), stress)


def _kinks(scene: Scene, link: str) -> Float[np.ndarray, "_ 3"]:
    """Points of a link with single forces, or with ends of forces per length: joints, bodies and loads [m]."""
    joints = [joint.at for joint in scene.joints.values() if link in joint.links]
    bodies = [body.at for body in scene.bodies.values() if body.link == link]
    single = [x for x in scene.loads.values() if isinstance(x, ForceLoad | TorqueLoad) and x.link == link]
    forces = [load.at for load in single if load.at is not None]
    lines = [x.between for x in scene.loads.values() if isinstance(x, LineLoad) and x.link == link and x.between]
    return np.array([*joints, *bodies, *forces, *(end for line in lines for end in line)]).reshape(-1, 3)
