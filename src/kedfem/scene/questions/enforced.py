"""Whether a joint of a scene is enforced by constraint equations or by points that its links share."""

from kedfem.scene.questions.modelling import by_constraint_equations, link_frames, masses_alone
from kedfem.scene.questions.planes import plane_scene, spatial_beams
from kedfem.scene.records.links import GROUND
from kedfem.scene.records.scene import Scene

TURNED = ("revolute", "weld")  # joints by shared points that couple rotations of links


def enforced_by_equations(scene: Scene, name: str) -> bool:
    """Whether a joint of a scene is enforced by constraint equations."""
    joint = scene.joints[name]
    kinds = frozenset(scene.links[each].category for each in joint.links if each in scene.links)
    if joint.kind == "weld" and "plane" not in kinds and plane_scene(scene):
        kinds |= {"plane"} if not masses_alone(scene).keys().isdisjoint(joint.links) else set()
    return by_constraint_equations(joint, scene.driven_joints.get(name, ()), kinds - {"rigid"}) or _unlike(scene, name)


def _unlike(scene: Scene, name: str) -> bool:
    """Whether a joint couples rotations of links of which only one has a co-rotational frame, other than by an angle.

    A rotation ψ stretches the cross-section of the other link by ψ²/2, so that shared points would resist it.
    """
    joint = scene.joints[name]
    if joint.kind not in TURNED or len({scene.links[each].frames for each in joint.links if each in scene.links}) < 2:
        return False
    links = [each for each in joint.links if each in scene.links and _displaced(scene, each)]
    if len({link_frames(scene, each) for each in links}) < 2:
        return False
    kinds = {scene.links[each].category for each in links}
    if "solid" in kinds or not spatial_beams(scene).isdisjoint(links):
        return True
    return not plane_scene(scene) if kinds == {"rigid"} else joint.kind == "weld" and "plane" in kinds


def _displaced(scene: Scene, name: str) -> bool:
    """Whether displacements may rotate a link: no drive prescribes it, and no guide on the ground does."""
    link = scene.links[name]
    if link.category != "rigid":
        return True
    driven = ((scene.joints[x], drives) for x, drives in scene.driven_joints.items() if x in scene.joints)
    prescribed = any(name in joint.links and not by_constraint_equations(joint, drives) for joint, drives in driven)
    guide = masses_alone(scene).get(name)
    return not prescribed and (guide is None or GROUND not in scene.joints[guide].links)
