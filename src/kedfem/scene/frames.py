"""Which links have frames that follow their own motion, and which the nominal one."""

from __future__ import annotations

from typing import TYPE_CHECKING, Literal

if TYPE_CHECKING:
    from kedfem.scene.scene import Scene

Frames = Literal["nominal", "following"]


def link_frames(scene: Scene, name: str) -> Frames:
    """The frames of one link: its own choice, else that of the analysis."""
    return scene.links[name].frames or scene.analysis.frames or default_frames(bool(scene.driven_joints))


def default_frames(driven: bool) -> Frames:
    """Frames where none are asked for: nominal with a drive; without one nothing prescribes them."""
    return "nominal" if driven else "following"


def following_links(scene: Scene) -> frozenset[str]:
    """Names of the links with frames that follow their own motion."""
    return frozenset(name for name in scene.links if link_frames(scene, name) == "following")


def following(scene: Scene) -> bool:
    """Whether any link's frames follow its own motion: the equation is then not linear."""
    return bool(following_links(scene))
