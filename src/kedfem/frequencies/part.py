"""Natural frequencies of a single link: a part from a file, or one link of a scene, free or held."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path as FilePath

import numpy as np

from kedfem.accuracy.frequencies import USUAL, allowed_error, mesh_warning, resolved, unsimplified
from kedfem.accuracy.variants import refinable, refined, with_links
from kedfem.arrays import Float, Int
from kedfem.dynamics.history import bent
from kedfem.dynamics.modes.frozen import Modes
from kedfem.dynamics.modes.link_modes import Support, clamped_on, held_at, link_modes, single_link, together
from kedfem.errors import MeshError, SceneError
from kedfem.frequencies.linkage import frequencies_folder
from kedfem.links.record import Link
from kedfem.links.recovery import stress_recovery
from kedfem.links.solid import solid_link
from kedfem.links.surfaces.candidates import surfaces
from kedfem.links.surfaces.chosen_faces import chosen_surface
from kedfem.mesh import part_mesh
from kedfem.motion.joint_equations import joint_axis
from kedfem.output.fields import LinkField
from kedfem.output.frames import link_field
from kedfem.output.shapes import Shape, write_shapes
from kedfem.results import claimed
from kedfem.results.frequencies import write_part_frequencies
from kedfem.scene import ChosenFace, LinkScene, Material, Scene, require_elastic
from kedfem.scene.records.wording import either, one_of

Watch = Callable[[str, int, int], None]
HELD = ("revolute", "spherical", "weld")  # joints of which what they hold needs no other link
MANY = 12  # names of faces that a message lists
FROM_FILE = "frequencies: how far off they are by the mesh is not known, as one from a file is not made finer"


@dataclass(frozen=True, slots=True)
class Part:
    """A link on its own.

    held : its support, in words
    folder : where its frequencies go
    allowed : relative error of frequencies, as far as the mesh is open
    open : whether the mesh was left open
    given : its shape and mesh
    remade : it, with another mesh
    """

    name: str
    link: Link
    support: Support
    held: tuple[str, ...]
    folder: FilePath
    allowed: float
    open: bool
    given: LinkScene
    remade: Callable[[LinkScene], "Part"]


@dataclass(frozen=True, slots=True)
class PartFrequencies:
    """Of a single link.

    values : (f,) natural frequencies in rising order [Hz]
    errors : (e,) relative, of the mesh, estimated; none of a mesh from a file, NaN where they are not known
    still : motions without strain, at zero frequency: six of a free part
    """

    folder: FilePath
    part: Part
    values: Float[np.ndarray, " f"]
    errors: Float[np.ndarray, " e"]
    still: int
    warnings: tuple[str, ...]

    @property
    def mass(self) -> float:
        """[kg]."""
        return float(self.part.link.one @ self.part.link.m1[:, 0])


def part_from_file(file: FilePath, given: LinkScene, material: Material, faces: Sequence[str | ChosenFace] = ()) -> Part:
    """A part from CAD or from a mesh file, some of its faces clamped.

    Parameters
    ----------
    given : its shape, mesh and element
    faces : by name or by what they are; of those from CAD no blends are left out

    Raises
    ------
    MeshError
        It cannot be meshed, or has no such face.
    """
    names = tuple(each for each in faces if isinstance(each, str))
    near = tuple(each.near for each in faces if isinstance(each, ChosenFace) and each.near is not None)
    mesh = part_mesh(given, file.parent, (near, names))
    link = solid_link(file.stem, mesh, material, np.eye(3))
    support = together(link, [clamped_on(link, _facets(link, each)) for each in faces])
    words = tuple(each if isinstance(each, str) else each.label for each in faces)
    solid = getattr(given.shape, "solid", None)
    stem = file.stem if solid is None else f"{file.stem}-{solid}"
    folder, remade = file.with_name(f"{stem}-frequencies"), partial(part_from_file, file, material=material, faces=faces)
    return Part(file.name, link, support, words, folder, USUAL, "mesh" not in given.model_fields_set, given, remade)


def _facets(link: Link, face: str | ChosenFace) -> Int[np.ndarray, " f"]:
    """Boundary facets of a face that is clamped."""
    if isinstance(face, ChosenFace):
        near = np.asarray(link.nodes.mean(axis=0) if face.near is None else face.near)
        return chosen_surface(link, "--hold", face, near, surfaces(link)).facets
    known = {each.face.name: each.facets for each in link.faces if len(each.facets)}
    if face not in known:
        other = 'one that has no name by what it is: { plane = "x", near = [0, 0, 0] }'
        names = list(known) if len(known) <= MANY else [next(iter(known)), "…", list(known)[-1]]
        wanted = one_of(names, face) if known else f"must be a face by what it is, got {face!r}"
        raise MeshError(f"--hold: {wanted}; {other}")
    return known[face]


def link_of_scene(scene: Scene, name: str, joints: Sequence[str] = ()) -> Part:
    """A link of a scene, unreduced, with its bodies; held where some of its joints sit, free at the others.

    Parameters
    ----------
    joints : each constrains the link as if its other link were fixed; one with a drive constrains the rotation too
    """
    require_elastic(scene.links, name)
    for joint in joints:
        _check(scene, name, joint)
    scene = unsimplified(scene)
    given, link = scene.links[name], single_link(scene, name)
    support = together(link, [held_at(scene, joint, link, _constrained_rotations(scene, joint)) for joint in joints])
    folder = frequencies_folder(scene)

    def remade(given: LinkScene) -> Part:
        return link_of_scene(with_links(scene, {name: given}), name, joints)

    left_open = scene.analysis.accuracy != "quick" and "mesh" not in given.model_fields_set
    return Part(
        name, link, support, tuple(joints), folder.with_name(f"{folder.name}-{name}"), allowed_error(scene), left_open,
        given, remade,
    )  # fmt: skip


def _check(scene: Scene, name: str, joint: str) -> None:
    """Refuse joints that do not say on their own what they hold of a link."""
    own = [key for key, each in scene.joints.items() if name in each.links]
    if joint not in own:
        wanted = f"{one_of(own, joint)}, the joints of link '{name}'" if own else ""
        raise SceneError(f"--hold: {wanted or f'must be left out for a link without joints, got {joint!r}'}")
    kind = scene.joints[joint].kind
    if kind not in HELD:
        got = f"got '{joint}', a {kind} joint"
        raise SceneError(f"--hold: must be a joint of kind {either(list(HELD))}, {got}")
    if scene.joints[joint].bushing is not None:
        raise SceneError(f"--hold: must be a joint without a bushing, got '{joint}', which has a bushing")


def _constrained_rotations(scene: Scene, joint: str) -> Float[np.ndarray, "r 3"]:
    """Directions about which a joint constrains a link."""
    of = scene.joints[joint]
    if of.kind == "weld" or joint in scene.driven_joints:
        return np.eye(3)
    if of.kind == "spherical":
        return np.zeros((0, 3))
    return np.asarray(np.linalg.svd(joint_axis(of)[None])[2][1:])


def part_frequencies(
    part: Part,
    count: int,
    folder: FilePath | None = None,
    watch: Watch = lambda stage, done, total: None,
    shapes: int = 0,
) -> PartFrequencies:
    """The lowest natural frequencies of a single link at rest, without damping.

    Parameters
    ----------
    shapes : lowest mode shapes that are drawn
    """
    if count < 1:
        raise SceneError(f"--modes: must be at least 1, got {count}")
    if not 0 <= shapes <= count:
        raise SceneError(f"--shapes: must be between 0 and --modes ({count}), got {shapes}")
    if part.support.clamped.all():
        raise SceneError("--hold: must leave something of the part that can move, got all of it")
    watch("frequencies", 0, 0)

    def solved_with(part: Part) -> _Solved:
        return _Solved(part, link_modes(part.link, part.support, count))

    def smaller(made: _Solved, factor: float) -> _Solved:
        return solved_with(made.part.remade(refined(made.part.given, factor)))

    solved, errors = solved_with(part), np.zeros(0)
    if refinable(part.given):
        solved, errors = resolved(solved, smaller, smaller if part.open else None, part.allowed)
    warnings = mesh_warning(errors, part.allowed, "take a finer mesh") if refinable(part.given) else (FROM_FILE,)
    part, modes = solved.part, solved.modes
    with claimed(folder or part.folder) as target:
        write_part_frequencies(target / "frequencies.csv", modes.frequencies)
        if shapes:
            watch("mode shapes", 0, 0)
            write_shapes(target, _shapes(part, modes, shapes))
    return PartFrequencies(target, part, modes.frequencies, errors, modes.still, warnings)


@dataclass(frozen=True, slots=True)
class _Solved:
    part: Part
    modes: Modes

    @property
    def frequencies(self) -> Float[np.ndarray, " f"]:
        return self.modes.frequencies

    @property
    def unknowns(self) -> int:
        return self.part.link.unknowns


def _shapes(part: Part, modes: Modes, count: int) -> list[Shape]:
    """The lowest mode shapes of a link as it is drawn."""
    link, recovery = part.link, stress_recovery(part.link)
    place = np.zeros(3), np.eye(3)

    def fields(mode: int, factor: float, exaggeration: float) -> list[LinkField]:
        u = factor * modes.shapes[0][modes.still + mode]
        return [link_field(link, recovery, place, bent(u, np.eye(link.d)), exaggeration)]

    return [
        Shape(f, f"{part.name}, mode {m + 1}: {f:.4g} Hz", partial(fields, m))
        for m, f in enumerate(modes.frequencies[:count].tolist())
    ]
