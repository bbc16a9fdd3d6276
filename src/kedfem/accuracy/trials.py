"""Trial runs of modified copies of one scene with reduced links; what they have in common is computed once."""

from collections.abc import Callable, Collection
from dataclasses import dataclass, field, replace

import numpy as np

from kedfem.accuracy.histories import Histories, counted, histories, is_judged, relative_errors, worst
from kedfem.accuracy.prepared import Prepared, moving
from kedfem.accuracy.reduction import first_reduced
from kedfem.accuracy.resolution import step_error
from kedfem.accuracy.step_estimate import StepErrorMonitor, StepEstimate
from kedfem.accuracy.variants import shortened
from kedfem.arrays import Float
from kedfem.dynamics.elastic_model import elastic_model
from kedfem.dynamics.rigid_body import drive_range
from kedfem.links.build import bare_links
from kedfem.links.record import Link
from kedfem.motion.linkage import Linkage
from kedfem.motion.path import Path
from kedfem.results.recording import recording
from kedfem.scene import Scene, spatial_beams, without_vibration

TRIAL = 0.03  # error of the reduction of a trial run, relative to the required accuracy

Stage = Callable[[str], None]


@dataclass
class Trials:
    """Results of trial runs, and the links and modes that further runs reuse, by the text on which they depend.

    asked : the required accuracy [-]
    stage : called with the name of each stage
    notes : reports for the plan
    """

    asked: float
    stage: Stage
    notes: list[str] = field(default_factory=list)
    runs: dict[str, Histories] = field(default_factory=dict)
    steps: dict[str, tuple[StepEstimate, Collection[str]]] = field(default_factory=dict)
    models: dict[str, Prepared] = field(default_factory=dict)
    links: dict[str, Link] = field(default_factory=dict)
    modes: dict[str, Float[np.ndarray, "_ _"]] = field(default_factory=dict)
    motion: tuple[Linkage, Path] | None = None

    def difference(self, scene: Scene, better: Scene) -> float:
        """Worst relative difference between two scenes."""
        return worst(relative_errors(self.run(scene), self.run(better)))

    def run(self, scene: Scene) -> Histories:
        """A trial run."""
        scene = shortened(scene)
        key = scene.model_dump_json()
        if key not in self.runs:
            self.runs[key] = histories(self.ready(scene))
        return self.runs[key]

    def balances(self, scene: Scene) -> None:
        """Raise the error of a scene that has no static position, which is then not that of a mesh."""
        if without_vibration(scene):
            self.run(scene)

    def step(self, scene: Scene) -> tuple[StepEstimate, Collection[str]]:
        """The step estimate of a trial run with several levels in time, and the judged channels."""
        scene = shortened(scene)
        key = scene.model_dump_json()
        if key not in self.steps:
            ready = self.ready(scene)
            recorded = [x for x in recording(scene, ready.model) if is_judged(x.channel.name)]
            watch = StepErrorMonitor(ready, recorded, step_error(ready))
            base = histories(ready, look=watch.running.add, follow=watch.add)
            self.runs[key], self.steps[key] = base, (watch.estimate, counted(base))
        return self.steps[key]

    def ready(self, scene: Scene) -> Prepared:
        """A scene with its reduced model, which scenes that differ only in the step share."""
        joined, along = self._moving(scene)
        key = scene.model_dump_json(exclude={"analysis"})
        if key not in self.models:
            model = elastic_model(scene, joined, self._bare(scene), along)
            self.models[key] = self._reduced(Prepared(scene, joined, along, model))
        return replace(self.models[key], scene=scene, path=along)

    def _moving(self, scene: Scene) -> tuple[Linkage, Path]:
        """The linkage and its motion, which all trials share unless another step reaches another angle."""
        low, high = drive_range(scene)
        if self.motion is None or not self.motion[1].holds(low, high):
            self.motion = moving(scene)
        return self.motion

    def _bare(self, scene: Scene) -> dict[str, Link]:
        bare = bare_links(scene, self.links_of(scene))
        self.links |= {_text(scene, name): link for name, link in bare.items()}
        return bare

    def links_of(self, scene: Scene) -> dict[str, Link]:
        """Links by name that earlier trial runs had with the same meshes and matrices."""
        known = ((name, self.links.get(_text(scene, name))) for name in scene.links)
        return {name: link for name, link in known if link is not None}

    def _reduced(self, full: Prepared) -> Prepared:
        """The scene reduced with the modes of earlier trials, so that only changed links cause a difference."""
        texts = _texts(full)
        known = [self.modes.get(text) for text in texts]
        ready = first_reduced(full, TRIAL * self.asked, known if any(Q is not None for Q in known) else None)
        for link, text in zip(ready.model.links, texts, strict=True):
            if link.Q is not None and not link.rigid:
                self.modes[text] = link.Q
        return ready


def _texts(full: Prepared) -> list[str]:
    """Keys of the modes: all on which those of each link or segment depend."""
    names = [link.name for link in full.model.links]
    number = [f"{names[:k].count(name)} of {names.count(name)}" for k, name in enumerate(names)]
    return [f"{_text(full.scene, name)} {place}" for name, place in zip(names, number, strict=True)]


def _text(scene: Scene, name: str) -> str:
    """Key of a link: all on which its mesh and matrices depend."""
    text = scene.links[name].model_dump_json(exclude={"reduction"})
    return f"{name} {name in spatial_beams(scene)} {text}"
