"""Which joints of a scene are enforced by constraint equations, and which by points that their links share."""

from kedfem.scene.questions.modelling import by_constraint_equations, link_frames
from kedfem.scene.questions.planes import spatial_beams
from kedfem.scene.records.scene import Scene

TURNED = ("revolute", "weld")  # joints by shared points that make links rotate together


def enforced_by_equations(scene: Scene, name: str) -> bool:
    """Whether a joint of a scene is enforced by constraint equations."""
    joint = scene.joints[name]
    kinds = frozenset(scene.links[each].category for each in joint.links if each in scene.links)
    return by_constraint_equations(joint, scene.driven_joints.get(name), kinds) or _unlike(scene, name)


def _unlike(scene: Scene, name: str) -> bool:
    """Whether it makes elastic links in space rotate together of which one alone has a co-rotational frame.

    A rotation ψ stretches the cross-section of the other by ψ²/2, so that points which both share would resist it.
    """
    joint = scene.joints[name]
    links = [each for each in joint.links if each in scene.links and scene.links[each].category != "rigid"]
    if joint.kind not in TURNED or len({scene.links[each].frames for each in links}) < 2:
        return False
    if len({link_frames(scene, each) for each in links}) < 2:
        return False
    return any(scene.links[each].category == "solid" for each in links) or not spatial_beams(scene).isdisjoint(links)
