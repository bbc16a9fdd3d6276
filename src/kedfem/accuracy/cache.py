"""Under which key what was found for a scene is kept between runs: its plan, its reduced links."""

import json
from hashlib import sha256

from kedfem.scene import Cad, MeshFile, Part, Scene
from kedfem.store import contents


def key(scene: Scene) -> str:
    """A digest of everything in a scene that a plan or a reduced model depends on, the contents of its files too."""
    said = scene.model_dump(mode="json", exclude={"title", "fatigue"})
    said["output"] = said["output"]["probes"]
    digest = sha256(json.dumps(said).encode())
    shapes = (link.shape for link in scene.links.values())
    digest.update(contents(scene.folder / x.file for x in shapes if isinstance(x, Cad | MeshFile | Part)))
    return digest.hexdigest()
