"""The choice of a method to mesh a part from CAD: hexahedra if it can be swept, else tetrahedra, with the reason."""

import json
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from types import ModuleType

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import MeshError
from kedfem.mesh.cad.faces import with_faces
from kedfem.mesh.cad.model import CadKeys, leave_only, solid_model
from kedfem.mesh.cad.solid_faces import cad_faces
from kedfem.mesh.cad.solids import USUAL_ANGLE, OtherMethodError, Sizing, Solid
from kedfem.mesh.elements.hexahedra import SolidMesh, frame_along, placed, quadratic
from kedfem.mesh.elements.quality import mesh_quality
from kedfem.mesh.elements.tetrahedra import FORMS
from kedfem.mesh.isolated import LONGEST, PART, in_own_process
from kedfem.mesh.layered.layers import layered_mesh
from kedfem.mesh.swept.blends import points_in_file, swept_without_blends
from kedfem.mesh.swept.blocks import block_mesh
from kedfem.mesh.swept.path import path_mesh
from kedfem.mesh.swept.revolved import revolved_mesh
from kedfem.mesh.tetrahedral import subdivided_mesh, tetrahedral_mesh, tetrahedron_size
from kedfem.mesh.unknowns import TooCoarseError, nearest_mesh
from kedfem.scene import Cad, LinkScene, MeshFile, Meshing
from kedfem.store import contents, itself, kept

ENOUGH = 0.3  # least scaled Jacobian of hexahedra with which no other method is tried
FAIR = 0.2  # the same with which hexahedra are preferred to tetrahedra
FLAT = 0.005  # scaled Jacobian of tetrahedra up to which the CAD model, with edges of some micrometres, is healed
MOST = 150_000  # unknowns of hexahedra above which tetrahedra are used unless a size is asked for
_POWER = 2.5  # unknowns fall with this power of the size, between that of plates and that of compact parts

#: A method of meshing: a function of gmsh, whose model has only the solid and stays as it is, the solid and the
#: sizing. It returns hex27 or tet10 elements, curved onto the solid's faces; an OtherMethodError names the obstacle or
#: says that the elements are bad.
Method = Callable[[ModuleType, Solid, Sizing], SolidMesh]
#: Points of the scene [m] and names of faces at which a part keeps its blends.
KeptBlends = tuple[tuple[tuple[float, float, float], ...], tuple[str, ...]]
NONE_KEPT: KeptBlends = ((), ())

SWEPT: tuple[Method, ...] = (layered_mesh, block_mesh, revolved_mesh, path_mesh)
#: Methods tried in turn, by `mesh.kind` or element.
METHODS: dict[str | None, tuple[Method, ...]] = {
    None: (*SWEPT, swept_without_blends, tetrahedral_mesh),
    "hexahedra": (*SWEPT, swept_without_blends, subdivided_mesh),
    "tet10": (tetrahedral_mesh,),
}
_HEALED = (0.03, 0.1, 0.3)  # tolerances of healing, tried in turn, in element sizes
_SAME = 1e-3  # most relative change of the volume by healing


def cad_mesh(
    keys: CadKeys, name: str, link: LinkScene, shape: Cad, folder: Path, kept_blends: KeptBlends = NONE_KEPT
) -> SolidMesh:
    """hex27 or tet10 mesh of a part from CAD, at its place in the scene, with its faces; kept between runs.

    Parameters
    ----------
    name : the link's name, by default that of its solid in an assembly
    folder : the folder to which the file's name is relative
    kept_blends : points and faces of the part where no blend is left out

    Raises
    ------
    MeshError
        The file cannot be used, or no method gives a mesh.
    """
    file = folder / shape.file
    described = [
        name, shape.model_dump(mode="json"), link.mesh.model_dump(mode="json"), link.element, kept_blends,
    ]  # fmt: skip
    key = sha256(json.dumps(described).encode() + contents([file])).hexdigest()
    made = partial(in_own_process, keys.file, PART, LONGEST, made_mesh, keys, name, link, shape, file, kept_blends)
    mesh: SolidMesh = kept("mesh", key, made, itself, itself)
    return mesh


def made_mesh(
    keys: CadKeys, name: str, link: LinkScene, shape: Cad, file: Path, kept_blends: KeptBlends = NONE_KEPT
) -> SolidMesh:
    """The mesh of `cad_mesh`, made in this process."""
    with solid_model(keys, file, name, shape) as (gmsh, solid):
        if link.mesh.size is not None and link.mesh.size > solid.extent:
            wanted = f"must be larger than its mesh.size {link.mesh.size:.6g} [m]"
            raise MeshError(f"{keys.file}: {wanted}, got {solid.extent:.6g}")
        sizing = _wanted(link, shape, kept_blends)
        mesh = with_faces(gmsh, solid, _sized_or_healed(keys.file, gmsh, solid, link, sizing))
        if solid.mended:
            mesh = replace(mesh, method=f"{mesh.method}; {solid.mended}")
    return placed(mesh, np.array(shape.origin), file_axes(shape))


def _sized_or_healed(where: str, gmsh: ModuleType, solid: Solid, link: LinkScene, asked: Sizing) -> SolidMesh:
    """The mesh; if it fails or has flat tetrahedra, that of the CAD model without tiny edges and faces."""
    best: SolidMesh | MeshError
    try:
        best = _sized(where, gmsh, solid, link, asked, METHODS["tet10" if link.element == "tet10" else link.mesh.kind])
        if not best.tetrahedra or mesh_quality(best).least > FLAT:
            return best
    except MeshError as error:
        if link.mesh.kind is not None:
            raise
        best = error
    for mended, words in healed(gmsh, where, solid, tetrahedron_size(solid, asked)):
        try:
            mesh = _sized(where, gmsh, mended, link, asked, (tetrahedral_mesh,))
        except MeshError:
            continue
        if mesh_quality(mesh).least > FLAT:
            return replace(mesh, method=f"{mesh.method}; {words}")
    if isinstance(best, MeshError):
        raise best
    return best


def file_axes(shape: Cad | MeshFile) -> Float[np.ndarray, "3 3"]:
    """Axes of a file in the scene (3, 3), as rows."""
    along = (1.0, 0.0, 0.0) if shape.towards is None else np.subtract(shape.towards, shape.origin)
    return frame_along(np.array(along), None if shape.z is None else np.array(shape.z))


def sizing(mesh: Meshing) -> Sizing:
    """The sizing that the keys of a link's mesh ask for."""
    return Sizing(
        size=mesh.size, across=mesh.elements_across or 2, layers=mesh.layers, defeature_size=mesh.defeature_size,
        concave_angle=USUAL_ANGLE if mesh.fillet_angle is None else mesh.fillet_angle,
    )  # fmt: skip


def _wanted(link: LinkScene, shape: Cad, kept_blends: KeptBlends) -> Sizing:
    """The sizing that the keys of a link's mesh ask for, with the points and faces that keep their blends."""
    points, names = kept_blends
    inside = points_in_file(points, np.array(shape.origin), file_axes(shape))
    return replace(sizing(link.mesh), kept_points=inside, kept_faces=names)


def _sized(
    where: str, gmsh: ModuleType, solid: Solid, link: LinkScene, asked: Sizing, methods: tuple[Method, ...]
) -> SolidMesh:
    """The mesh of the size or of about the number of unknowns asked for."""
    wanted, element = link.mesh.unknowns, str(link.element)
    form = FORMS[element]
    if wanted is None:
        return best_mesh(where, gmsh, solid, asked, form, methods)

    def sized(size: float) -> tuple[SolidMesh, int]:
        nonlocal methods
        try:
            mesh = best_mesh(where, gmsh, solid, replace(asked, size=size), form, methods)
        except MeshError as error:
            raise TooCoarseError(str(error)) from error
        if mesh.tetrahedra:
            methods = (tetrahedral_mesh,)  # other sizes cannot be swept either
            if mesh_quality(mesh).least <= FLAT:
                raise TooCoarseError(
                    f"{where}: must be meshed without flat elements, got some of {1e3 * size:.3g} mm; take another size "
                    "(mesh.size)"
                )
        return mesh, 3 * len(form(mesh).points)

    nodes_each = {"hex8": 2, "hex20": 8, "hex27": 16, "tet10": 13}[element]  # for each cube of the size
    size = (solid.volume * 3 * nodes_each / wanted) ** (1 / 3)
    mesh, note = nearest_mesh(wanted, size, solid.extent / 2, _POWER, sized)
    return replace(mesh, method=f"{mesh.method}; {note}") if note else mesh


def best_mesh(
    where: str,
    gmsh: ModuleType,
    solid: Solid,
    sizing: Sizing,
    form: Callable[[SolidMesh], SolidMesh] = quadratic,
    methods: tuple[Method, ...] = METHODS[None],
) -> SolidMesh:
    """The mesh by the first method whose elements are good enough, else the best mesh; `method` has the reasons.

    Parameters
    ----------
    where : the file's key, for messages
    form : conversion to the link's element, whose quality is judged: 20 nodes may be worse than 27
    methods : tried in turn

    Raises
    ------
    MeshError
        No method gives a mesh.
    """
    found: list[tuple[float, SolidMesh]] = []
    reasons: list[str] = []
    for method in methods:
        best = max((least for least, _ in found), default=-1.0)
        if method in (tetrahedral_mesh, subdivided_mesh) and best >= FAIR:
            break
        try:
            mesh = method(gmsh, solid, sizing)
        except OtherMethodError as error:
            reasons.append(str(error).removeprefix(f"{solid.name}: "))
            continue
        least = mesh_quality(form(mesh)).least
        many = sizing.size is None and sizing.across <= 2 and 3 * len(form(mesh).points) > MOST
        notes = [mesh.method, *reasons[: method not in SWEPT]]  # the first reason is that against layers
        if mesh.tetrahedra or (least >= ENOUGH and not many):
            return replace(mesh, method="; ".join(notes))
        found.append((least - many, replace(mesh, method="; ".join(notes))))  # one with too many unknowns comes last
        unfit = f"{3 * len(form(mesh).points):,} unknowns" if many else f"worst scaled Jacobian {least:.2g}"
        reasons.append(f"{mesh.method}: {unfit}")
    if not found:
        raise MeshError(
            f"{where}: must be a solid that can be meshed, got none: {'; '.join(reasons)}; "
            "take another size (mesh.size) or simplify the part there"
        )
    return max(found, key=lambda each: each[0])[1]


def healed(gmsh: ModuleType, where: str, solid: Solid, size: float) -> Iterator[tuple[Solid, str]]:
    """The solid of gmsh's model without edges and faces below growing sizes, which healing removes.

    Parameters
    ----------
    where : the file's key, for messages
    size : of the elements [m]; the sizes are shares of it

    Yields
    ------
    The solid and a description, as long as it stays one solid of the same volume.
    """
    tag = solid.tag
    for share in _HEALED:
        try:
            made = gmsh.model.occ.healShapes([(3, tag)], tolerance=share * size)
            gmsh.model.occ.synchronize()
        except Exception as error:
            if type(error) is not Exception:  # gmsh raises nothing more special
                raise
            return  # OpenCASCADE cannot close a face without the removed edges
        solids = {tag for dim, tag in made if dim == 3}
        if len(solids) != 1:
            return
        (tag,) = solids
        leave_only(gmsh, tag)
        volume = float(gmsh.model.occ.getMass(3, tag))
        if abs(volume / solid.volume - 1) > _SAME:
            return
        faces = cad_faces(gmsh, where, tag, solid.extent, {})
        words = f"edges and faces below {1e3 * share * size:.2g} mm healed away"
        yield replace(solid, tag=tag, volume=volume, faces=faces), words
