"""The mesh of a link of any shape: plates from scene records, parts from CAD or from mesh files."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import MeshError, SceneError
from kedfem.mesh.cad.model import CadKeys
from kedfem.mesh.cad.solids import Sizing
from kedfem.mesh.elements.hexahedra import SolidMesh, frame_along, placed, rectangle_quads
from kedfem.mesh.elements.quality import checked_mesh
from kedfem.mesh.elements.tetrahedra import FORMS
from kedfem.mesh.files.read import mesh_from_file
from kedfem.mesh.layered.outlines import outline_quads, profile_outline, rotated_outline
from kedfem.mesh.memory_forecast import NODES_EACH, check_count, check_memory, check_size, size_key
from kedfem.mesh.methods import NONE_KEPT, KeptBlends, cad_mesh, file_axes, sizing
from kedfem.mesh.planar.flat import Plate, QuadMesh, middle_mesh, swept_mesh
from kedfem.mesh.planar.plate import PlateSizes, plate_quads
from kedfem.mesh.swept.blends import points_in_file
from kedfem.mesh.unknowns import nearest_mesh
from kedfem.scene import (
    Arc,
    Bar,
    Cad,
    Extrusion,
    LinkScene,
    MeshFile,
    Meshing,
    Part,
    PartGeometry,
    PlateLink,
    part_geometry,
)

_FOUND = np.pi / 8  # [rad], largest angle of an element around bores, which joints find from the mesh alone
_EYE_GAP = 1.1  # least distance of the bores, in diameters of eyes that are wider than the waist


def link_mesh(name: str, link: LinkScene, folder: Path, kept_blends: KeptBlends = NONE_KEPT) -> SolidMesh:
    """The mesh of a solid link in the scene's reference position, with elements of the kind `link.element`.

    Parameters
    ----------
    folder : the folder to which the names of part and mesh files are relative
    kept_blends : points of joints, loads and probes, and faces that they name: a part from CAD keeps its blends there,
        and `mesh.fillet_angle` does not apply to bores around these points

    Raises
    ------
    MeshError
        The shape cannot be meshed as asked, a file cannot be used, the memory does not suffice, or an element is of less
        than `link.min_quality`.
    """
    where = f"links.{name}"
    match link.shape:
        case MeshFile() as shape:
            read = mesh_from_file(f"{where}.shape.file", folder / shape.file, shape.scale)
            mesh = placed(read, np.array(shape.origin), file_axes(shape))
        case Cad() as shape:
            keys = CadKeys(f"{where}.shape.file", f"{where}.shape.solid")
            mesh = cad_mesh(keys, name, link, shape, folder, kept_blends)
        case _:
            mesh = _swept(where, link, link_plate(where, link, folder, kept_blends))
    mesh = FORMS[str(link.element)](mesh)
    check_memory(where, 3.0 * len(mesh.points), link.model != "rigid")
    return checked_mesh(where, mesh, link.min_quality)


def part_mesh(link: LinkScene, folder: Path, kept_blends: KeptBlends = NONE_KEPT) -> SolidMesh:
    """The mesh of a part on its own, in the file's frame unless it is from CAD; messages name its file.

    Parameters
    ----------
    link : its shape must be a part from CAD or a mesh file
    folder, kept_blends : as of `link_mesh`
    """
    match link.shape:
        case Cad() as shape:
            keys = CadKeys(shape.file, "--solid")
            mesh = cad_mesh(keys, Path(shape.file).stem, link, shape, folder, kept_blends)
        case MeshFile() as shape:
            mesh = mesh_from_file(shape.file, folder / shape.file, shape.scale)
        case _:
            raise TypeError("a part on its own comes from CAD or a mesh file")
    return checked_mesh(shape.file, FORMS[str(link.element)](mesh), link.min_quality)


def plane_mesh(name: str, link: LinkScene, folder: Path, kept_blends: KeptBlends = NONE_KEPT) -> QuadMesh:
    """The quad9 mesh of a plane link: the middle plane of its plate, in the scene's reference position.

    Parameters and errors are those of `link_mesh`.
    """
    mesh = middle_mesh(link_plate(f"links.{name}", link, folder, kept_blends))
    check_memory(f"links.{name}", 2.0 * len(mesh.points), link.model != "rigid", plane=True)
    return checked_mesh(f"links.{name}", mesh, link.min_quality)


def link_plate(where: str, link: LinkScene, folder: Path, kept_blends: KeptBlends = NONE_KEPT) -> Plate:
    """The plate that a link's shape describes, with about the number of unknowns asked for.

    Parameters
    ----------
    where : the link, for messages: ``links.rod``
    folder, kept_blends : as of `link_mesh`

    Raises
    ------
    MeshError
        The shape is not a plate or cannot be meshed as asked, or a part's file cannot be used.
    """
    usual = _plate(where, link, link.mesh, folder, kept_blends)
    wanted = link.mesh.unknowns
    if wanted is None:
        return usual

    def unknowns(plate: Plate) -> int:
        if link.family == "plane":
            return 2 * len(plate.quads[0])
        return 3 * len(FORMS[str(link.element)](_swept(where, link, plate)).points)

    def sized(size: float) -> tuple[Plate, int]:
        plate = _plate(where, link, link.mesh.model_copy(update={"size": size}), folder, kept_blends)
        return plate, unknowns(plate)

    points, cells = usual.quads
    p, q, r, s = np.moveaxis(points[cells[:, :4]], 1, 0)
    size = math.sqrt(float(np.linalg.det(np.stack([r - p, s - q], axis=1)).mean()) / 2)
    most = float(np.linalg.norm(np.ptp(points, axis=0))) / 2
    plate, note = nearest_mesh(wanted, size * math.sqrt(unknowns(usual) / wanted), most, 2.0, sized)
    return replace(plate, method="; ".join(filter(None, (plate.method, note))))


def _swept(where: str, link: LinkScene, plate: Plate) -> SolidMesh:
    """The hex27 mesh of a plate, if it fits in the memory."""
    layers = _layers(link)
    unknowns = 3.0 * NODES_EACH[str(link.element)] * len(plate.quads[1]) * layers
    check_memory(where, unknowns, link.model != "rigid")
    return swept_mesh(plate, layers)


def _plate(where: str, link: LinkScene, mesh: Meshing, folder: Path, kept_blends: KeptBlends) -> Plate:
    """The plate with elements as the keys `mesh` ask for."""
    match link.shape:
        case Bar() as shape:
            return bar_plate(where, shape, mesh)
        case PlateLink() as shape:
            return eye_plate(where, shape, mesh)
        case Extrusion() as shape:
            return extrusion_plate(where, shape, mesh, kept_blends)
        case Part() as shape:
            return part_plate(where, shape, mesh, folder, kept_blends)
        case other:
            kind = "no shape" if other is None else other.kind
            wanted = "must be bar, plate_link, extrusion, part, mesh or cad"
            raise MeshError(f"{where}.shape: {wanted}, got {kind}")


def bar_plate(where: str, shape: Bar, mesh: Meshing) -> Plate:
    """A box between two points, in equal elements."""
    elements = mesh.elements or 4
    along, across, *layers = elements if isinstance(elements, tuple) else (elements, 2)
    check_count(f"{where}.mesh.elements", float(math.prod([along, across, *layers])))
    P, Q = np.array(shape.between)
    quads = rectangle_quads(math.dist(P, Q), shape.width, along, across)
    return Plate(quads, shape.thickness, P, frame_along(Q - P, np.array(shape.upward)))


def eye_plate(where: str, shape: PlateLink, mesh: Meshing) -> Plate:
    """A plate with a bore at each of two points."""
    P, Q = np.array(shape.between)
    length = math.dist(P, Q)
    sizes = PlateSizes(length, shape.width, shape.eye_diameter, shape.bore_diameter)
    if sizes.waisted and length < _EYE_GAP * shape.eye_diameter:
        raise MeshError(
            f"{where}.shape.eye_diameter: must be at most {length / _EYE_GAP:.6g} [m], the distance of the "
            f"bores over {_EYE_GAP}, for eyes wider than the waist, got {shape.eye_diameter:.6g}"
        )
    extent, size = length + shape.eye_diameter, mesh.size or shape.width / (mesh.elements_across or 2)
    check_size(where, mesh.size, size, extent)
    check_count(size_key(where, mesh.size), mesh.layers * extent * shape.width / size**2)
    axes = frame_along(Q - P)
    return Plate(plate_quads(sizes, size), shape.thickness, P + shape.offset * axes[2], axes)


def extrusion_plate(where: str, shape: Extrusion, mesh: Meshing, kept_blends: KeptBlends) -> Plate:
    """A plate of any outline, in a z plane."""
    start = shape.outline[0]
    middle = np.array([0.0, 0.0, (start.to if isinstance(start, Arc) else start)[2] + shape.offset])
    quads, note = outline_quads(where, profile_outline(shape), _sizing(mesh, kept_blends, middle, np.eye(3)))
    return Plate(quads, shape.thickness, middle, np.eye(3), note)


def part_plate(where: str, shape: Part, mesh: Meshing, folder: Path, kept_blends: KeptBlends) -> Plate:
    """A plate that a file describes, between two points."""
    part = _part(where, shape, folder)
    origin, x_point = np.array(part.origin[:2]), np.array(part.x_point[:2])
    outline = rotated_outline(profile_outline(part), origin, x_point - origin)
    P, Q = np.array(shape.between)
    axes = frame_along(Q - P)
    quads, note = outline_quads(where, outline, _sizing(mesh, kept_blends, P, axes))
    return Plate(quads, part.thickness, P, axes, note)


def _sizing(
    mesh: Meshing, kept_blends: KeptBlends, origin: Float[np.ndarray, "3"], axes: Float[np.ndarray, "3 3"]
) -> Sizing:
    """The sizing that the keys `mesh` ask for, with kept points in the plate's own frame and fine arcs for joints."""
    return replace(sizing(mesh), angle=_FOUND, kept_points=points_in_file(kept_blends[0], origin, axes))


def _layers(link: LinkScene) -> int:
    """Number of elements through the thickness; a bar has a key of its own."""
    if not isinstance(link.shape, Bar):
        return link.mesh.layers
    elements = link.mesh.elements
    return elements[2] if isinstance(elements, tuple) and len(elements) == 3 else 1


def _part(where: str, shape: Part, folder: Path) -> PartGeometry:
    """The geometry in a part's file; a MeshError if it does not fit between the part's two points."""
    try:
        part = part_geometry(folder / shape.file)
    except SceneError as error:
        raise MeshError("\n".join(f"{where}.shape.file: {fault}" for fault in error.faults)) from error
    wanted, got = math.dist(part.origin, part.x_point), math.dist(*shape.between)
    if abs(wanted - got) > 1e-6 * wanted:
        raise MeshError(
            f"{where}.shape.between: must be as far apart as origin and x_point of {shape.file}, "
            f"{wanted:.9g} [m], got {got:.9g}"
        )
    return part
