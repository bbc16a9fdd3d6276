"""The moving mechanism as one glTF file, which browsers, office programs and 3-D tools display.

Links move as rigid bodies in their reference shape, coloured by the highest stress of the whole run. glTF has y upwards
and lengths in metres; a mechanism is rotated so that gravity points down.
"""

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from kedfem.arrays import Float, Int
from kedfem.errors import OutputError
from kedfem.output.motion_file import continuous_quaternions
from kedfem.report.animated import animated
from kedfem.report.surfaces import Surface
from kedfem.report.viewer import EXTRA, scale
from kedfem.results import read_results, replacing, results_file
from kedfem.results.files import of_extra

STRETCHED = 1e-4  # of a spring's size: smaller changes are rounding of the frames
GREY = (0.6, 0.6, 0.6)
ENDING = ".glb"
KINDS = {1: "SCALAR", 3: "VEC3", 4: "VEC4"}
GENERATOR = "kedfem"


@dataclass(frozen=True, slots=True)
class Mechanism:
    """A written glTF file: its links, its number of frames, and descriptions of what was left out."""

    path: Path
    links: tuple[str, ...]
    frames: int
    warnings: tuple[str, ...]


def write_gltf(given: Path, path: Path) -> Mechanism:
    """Write the links of a run, moving over the frames of its animation, as binary glTF 2.0.

    Parameters
    ----------
    given : `results.h5`, or the folder that has it
    path : a file that ends in .glb

    Raises
    ------
    OutputError
        The results cannot be read or have no links, the file cannot be written, or a package is missing.
    """
    of_extra("pygltflib", "--gltf", EXTRA)
    if path.suffix != ENDING:
        raise OutputError(f"{path}: must end in {ENDING}, got '{path.suffix}'")
    file = results_file(Path(given))
    results = read_results(file)
    found = animated(file.parent, 1.0)
    if found is None:
        raise OutputError(
            f"{file.parent}: must have links to show, got neither frames nor an envelope: run the scene with "
            "output.animation"
        )
    scene: Mapping[str, Any] = json.loads(results.scene_json)
    gravity = np.array(scene.get("gravity") or (0.0, 0.0, 0.0), float)
    highest = max((peak.stress for peak in results.peaks.values()), default=0.0)
    builder = _Builder(highest)
    links = [builder.link(surface, found.times) for surface in found.surfaces]
    whole = builder.whole(links, _upwards(gravity), str(scene.get("title") or ""))
    with replacing(path) as part:
        part.write_bytes(b"".join(whole.save_to_bytes()))
    names = tuple(surface.name for surface in found.surfaces)
    return Mechanism(path, names, len(found.times), found.thinned)


def _upwards(gravity: Float[np.ndarray, "3"]) -> Float[np.ndarray, "4"]:
    """The quaternion x, y, z, w of the rotation that takes the upward direction to y; identity without gravity."""
    size = np.linalg.norm(gravity)
    if size == 0:
        return np.array([0.0, 0.0, 0.0, 1.0])
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.align_vectors([[0.0, 1.0, 0.0]], [-gravity / size])[0].as_quat())


@dataclass
class _Builder:
    """The file while it is built: one buffer of arrays, with its views and accessors.

    highest : stress at the upper end of the colours [Pa]
    """

    highest: float
    data: bytearray = field(default_factory=bytearray)
    views: list[Any] = field(default_factory=list)
    accessors: list[Any] = field(default_factory=list)
    meshes: list[Any] = field(default_factory=list)
    channels: list[Any] = field(default_factory=list)
    samplers: list[Any] = field(default_factory=list)
    times: int | None = None

    def link(self, surface: Surface, times: Float[np.ndarray, " f"]) -> Any:
        """A node with a link's surface in the reference position, and its motion."""
        import pygltflib as g

        X, moves = surface.points[0], placed_shape(surface)
        if surface.spring and surface.placements:
            X = moves.own
        attributes = g.Attributes(
            POSITION=self.array(X, bounded=True), NORMAL=self.array(normals(X, surface.triangles)),
            COLOR_0=self.array(self.colours(surface.stress[0])),
        )  # fmt: skip
        shape = g.Primitive(attributes=attributes, indices=self.array(surface.triangles.ravel()), material=0)
        self.meshes.append(g.Mesh(name=surface.name, primitives=[shape]))
        node, number = g.Node(name=surface.name, mesh=len(self.meshes) - 1), len(self.meshes)
        if not surface.placements:
            return node
        p, q = moves.p, continuous_quaternions(moves.R)[:, [1, 2, 3, 0]]
        node.translation, node.rotation = p[0].tolist(), q[0].tolist()
        every = [("translation", p), ("rotation", q)]
        if surface.spring:
            node.scale = moves.scale[0].tolist()
            every.append(("scale", moves.scale))
        if len(times) > 1:
            if self.times is None:
                self.times = self.array(times - times[0], bounded=True)
            for what, values in every:
                self.samplers.append(g.AnimationSampler(input=self.times, output=self.array(values)))
                target = g.AnimationChannelTarget(node=number, path=what)
                self.channels.append(g.AnimationChannel(sampler=len(self.samplers) - 1, target=target))
        return node

    def whole(self, links: list[Any], up: Float[np.ndarray, "4"], title: str) -> Any:
        """The file: node 0 has the rotation to y, and links are its children."""
        import pygltflib as g

        root = g.Node(name=title or GENERATOR, children=list(range(1, len(links) + 1)), rotation=up.tolist())
        material = g.Material(
            name="links", doubleSided=True,
            pbrMetallicRoughness=g.PbrMetallicRoughness(metallicFactor=0.1, roughnessFactor=0.6),
        )  # fmt: skip
        out = g.GLTF2(
            asset=g.Asset(version="2.0", generator=GENERATOR), scene=0, scenes=[g.Scene(nodes=[0])],
            nodes=[root, *links], meshes=self.meshes, materials=[material], accessors=self.accessors,
            bufferViews=self.views, buffers=[g.Buffer(byteLength=len(self.data))],
        )  # fmt: skip
        if self.channels:
            out.animations = [g.Animation(name="motion", channels=self.channels, samplers=self.samplers)]
        out.set_binary_blob(bytes(self.data))
        return out

    def array(self, x: np.ndarray, bounded: bool = False) -> int:
        """Append an array, of integers for indices; returns the number of its accessor."""
        import pygltflib as g

        whole = np.issubdtype(x.dtype, np.integer)
        x = np.ascontiguousarray(x, np.uint32 if whole else np.float32)
        rows = x.reshape(len(x), -1)
        self.views.append(g.BufferView(buffer=0, byteOffset=len(self.data), byteLength=x.nbytes))
        accessor = g.Accessor(
            bufferView=len(self.views) - 1, componentType=g.UNSIGNED_INT if whole else g.FLOAT, count=len(x),
            type=KINDS[rows.shape[1]],
        )  # fmt: skip
        if bounded:
            accessor.min, accessor.max = rows.min(axis=0).tolist(), rows.max(axis=0).tolist()
        self.accessors.append(accessor)
        self.data += x.tobytes()
        return len(self.accessors) - 1

    def colours(self, stress: Float[np.ndarray, " n"]) -> Float[np.ndarray, "n 3"]:
        """Colours of stresses, grey without stress; in linear light, as glTF requires."""
        parts, colours = (np.array(x) for x in zip(*scale(), strict=True))
        share = np.clip(np.nan_to_num(stress) / (self.highest or 1.0), 0.0, 1.0)
        shown = np.stack([np.interp(share, parts, c) for c in colours.T], axis=1)
        shown[~np.isfinite(stress)] = GREY
        return np.where(shown <= 0.04045, shown / 12.92, ((shown + 0.055) / 1.055) ** 2.4)


@dataclass(frozen=True, slots=True)
class PlacedShape:
    """Motion of a node: x = p + R (scale * own)."""

    own: Float[np.ndarray, "n 3"]
    p: Float[np.ndarray, "f 3"]
    R: Float[np.ndarray, "f 3 3"]
    scale: Float[np.ndarray, "f 3"]


def placed_shape(surface: Surface) -> PlacedShape:
    """Shape and motion of a surface: the placements of a link; a spring is stretched along the z axis of its frame."""
    X, count = surface.points[0], len(surface.placements)
    p = np.array([placed.p for placed in surface.placements]).reshape(count, 3)
    R = np.array([placed.R for placed in surface.placements]).reshape(count, 3, 3)
    if not surface.spring:
        return PlacedShape(X, p, R, np.ones((count, 3)))
    axes = np.linalg.svd(_along(surface.points)[None])[2][[1, 2, 0]].T
    axes[:, 0] *= np.linalg.det(axes)
    lengths = [float(np.ptp(points @ axes[:, 2])) for points in surface.points]
    scale = np.ones((count, 3))
    scale[:, 2] = np.array(lengths[1:]) / lengths[0]
    centres = np.array([points.mean(axis=0) for points in surface.points[1:]]).reshape(count, 3)
    return PlacedShape((X - X.mean(axis=0)) @ axes, p + np.einsum("fij,fj->fi", R, centres), R @ axes, scale)


def _along(every: Sequence[Float[np.ndarray, "n 3"]]) -> Float[np.ndarray, "3"]:
    """The direction in which a spring stretches, as a short coil may be wider than long; of a rigid one the longest."""
    X, *later = (points - points.mean(axis=0) for points in every)
    stretched = max((points - X for points in later), key=lambda x: float(np.abs(x).max(initial=0.0)), default=X)
    long = np.abs(stretched).max(initial=0.0) > STRETCHED * np.abs(X).max(initial=0.0)
    return np.asarray(np.linalg.svd(stretched if long else X, full_matrices=False)[2][0])


def normals(X: Float[np.ndarray, "n 3"], triangles: Int[np.ndarray, "t 3"]) -> Float[np.ndarray, "n 3"]:
    """Unit normals at points: area-weighted means of those of the triangles."""
    a, b, c = (X[triangles[:, k]] for k in range(3))
    area = np.cross(b - a, c - a)
    out = np.zeros_like(X)
    for k in range(3):
        np.add.at(out, triangles[:, k], area)
    size = np.linalg.norm(out, axis=1)
    out[size == 0], size[size == 0] = (0.0, 0.0, 1.0), 1.0
    return np.asarray(out / size[:, None])
