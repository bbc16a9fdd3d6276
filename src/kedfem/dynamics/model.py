"""The elastic model of a scene: links with their attached bodies, joints, loads, damping."""

from dataclasses import dataclass

from kedfem.dynamics.joints.attachments import Attachment, SharedCut
from kedfem.dynamics.joints.constraint_joints import ConstraintJoint
from kedfem.dynamics.loads import Pattern
from kedfem.dynamics.stepping.state import Rayleigh
from kedfem.dynamics.stepping.step_limit import StepLimit
from kedfem.dynamics.system.record import Driven, Held
from kedfem.links.record import Link
from kedfem.mesh.memory_forecast import least_bytes


@dataclass(frozen=True, slots=True)
class PrescribedBody:
    """A rigid link that the drive turns on the ground: its motion is the rigid-body one, it has no unknowns.

    link : its record, with attached bodies
    body : its number in the linkage
    drive_joint : the driven joint
    loads : per load
    """

    link: Link
    body: int
    drive_joint: str
    loads: tuple[Pattern, ...]


@dataclass(frozen=True, slots=True)
class Model:
    """The constant data of the time integration.

    bodies : number of each link in the linkage
    joints, loads : per link
    prescribed : rigid links that move with the drive
    rows : joints enforced by constraint equations
    cuts : where segments of a link meet, by `link_keys`
    step_limits : per link, of rigid ones that a step keeps from being stiffer; none at all where there are none
    """

    links: tuple[Link, ...]
    bodies: tuple[int, ...]
    joints: tuple[Attachment, ...]
    loads: tuple[tuple[Pattern, ...], ...]
    damping: Rayleigh
    prescribed: tuple[PrescribedBody, ...] = ()
    rows: tuple[ConstraintJoint, ...] = ()
    cuts: tuple[SharedCut, ...] = ()
    step_limits: tuple[StepLimit | None, ...] = ()

    @property
    def unknowns(self) -> int:
        """Elastic unknowns of all links before joints share any."""
        return sum(link.unknowns for link in self.links)

    @property
    def interface_unknowns(self) -> int:
        """Number of the interface unknowns z, which joints share."""
        return self.joints[0].unknowns

    @property
    def coordinates(self) -> int:
        """Generalised coordinates once the joints share theirs."""
        held = sum(len(joint.keep) for joint in self.joints)
        rows = sum(isinstance(each.law, Held | Driven) for row in self.rows for each in row.constraints)
        return self.unknowns - held + self.interface_unknowns - rows


def link_keys(model: Model) -> list[str]:
    """A key for each link of a model; of a segment with its number in its link."""
    names, out = [link.name for link in model.links], []
    for k, name in enumerate(names):
        out.append(name if names.count(name) == 1 else f"{name}/{names[: k + 1].count(name)}")
    return out


def segments(model: Model) -> dict[str, list[Link]]:
    """The segments of each link by its name; of a link with rigid-body frame itself."""
    out: dict[str, list[Link]] = {}
    for link in model.links:
        out.setdefault(link.name, []).append(link)
    return out


def mesh_methods(model: Model) -> dict[str, str]:
    """How the links that are parts from CAD were meshed, in words."""
    links = [*model.links, *(prescribed.link for prescribed in model.prescribed)]
    return {link.name: method for link in links if (method := (link.full or link).method)}


def factor_bytes(model: Model) -> float:
    """Memory of the factors of all links, for one step size."""
    return sum(least_bytes(link.unknowns, plane=link.kind == "plane")[1] for link in model.links)
