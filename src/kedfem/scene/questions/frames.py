"""Which links have co-rotational frames, and which rigid-body ones."""

from __future__ import annotations

from kedfem.scene.records.links import Frames
from kedfem.scene.records.scene import Scene


def link_frames(scene: Scene, name: str) -> Frames:
    """The frames of one link: its own choice, else that of the analysis."""
    return scene.links[name].frames or scene.analysis.frames or default_frames(bool(scene.driven_joints))


def default_frames(driven: bool) -> Frames:
    """Frames where none are asked for: rigid-body ones with a drive; without one nothing prescribes them."""
    return "rigid-body" if driven else "co-rotational"


def corotational_links(scene: Scene) -> frozenset[str]:
    """Names of the links with co-rotational frames."""
    return frozenset(name for name in scene.links if link_frames(scene, name) == "co-rotational")


def corotational(scene: Scene) -> bool:
    """Whether any link has co-rotational frames: the equation is then not linear."""
    return bool(corotational_links(scene))
