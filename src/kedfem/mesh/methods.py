"""The order of methods to mesh a part from CAD: hexahedra where it can be swept, else tetrahedra, and why."""

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
from kedfem.mesh.cad.solids import USUAL, OtherMethodError, Sizing, Solid
from kedfem.mesh.elements.hexahedra import SolidMesh, frame_along, placed, quadratic
from kedfem.mesh.elements.quality import mesh_quality
from kedfem.mesh.elements.tetrahedra import FORMS
from kedfem.mesh.filling import filled_mesh, subdivided_mesh, tetrahedron_size
from kedfem.mesh.isolated import LONGEST, PART, in_own_process
from kedfem.mesh.layered.layers import layered_mesh
from kedfem.mesh.swept.blends import points_in_file, swept_without_blends
from kedfem.mesh.swept.blocks import block_mesh
from kedfem.mesh.swept.path import path_mesh
from kedfem.mesh.swept.revolved import revolved_mesh
from kedfem.mesh.unknowns import nearest
from kedfem.scene import Cad, LinkScene, MeshFile, Meshing
from kedfem.store import contents, itself, kept

ENOUGH = 0.3  # worst scaled Jacobian of hexahedra with which no other method is tried
FAIR = 0.2  # of hexahedra that are taken before tetrahedra
FLAT = 0.005  # of tetrahedra for which the CAD model is healed: edges of some micrometres are in it
MOST = 150_000  # unknowns of hexahedra above which tetrahedra are taken, where nobody asked for a size
_POWER = 2.5  # by which of the size unknowns fall, between that of plates and that of lumps

#: A method of meshing: gmsh with a solid alone in its model, which is left as it is; how fine. Elements are of 27 nodes,
#: those of the surface on the solid's own faces; an OtherMethodError says what is in the way, or that they are poor.
Method = Callable[[ModuleType, Solid, Sizing], SolidMesh]
#: Places of the scene [m] and names of faces at which a part keeps its blends.
KeptWhole = tuple[tuple[tuple[float, float, float], ...], tuple[str, ...]]
NOTHING: KeptWhole = ((), ())

SWEPT: tuple[Method, ...] = (layered_mesh, block_mesh, revolved_mesh, path_mesh)
#: What is tried in turn, by `mesh.kind` and element.
METHODS: dict[str | None, tuple[Method, ...]] = {
    None: (*SWEPT, swept_without_blends, filled_mesh),
    "hexahedra": (*SWEPT, swept_without_blends, subdivided_mesh),
    "tet10": (filled_mesh,),
}
_HEALED = (0.03, 0.1, 0.3)  # sizes of edges that are healed away in turn, of the elements' size
_SAME = 1e-3  # of the volume that this may change


def cad_mesh(
    keys: CadKeys, name: str, link: LinkScene, shape: Cad, folder: Path, kept_whole: KeptWhole = NOTHING
) -> SolidMesh:
    """hex27 or tet10 mesh of a part from CAD, where the scene has it, its faces known; kept between runs.

    Parameters
    ----------
    name : the link's name, that of its solid in an assembly
    folder : what the file's name is relative to
    kept_whole : places and faces of the part where no blend is left out

    Raises
    ------
    MeshError
        The file cannot be used, or no method gives a mesh.
    """
    file = folder / shape.file
    described = [
        name, shape.model_dump(mode="json"), link.mesh.model_dump(mode="json"), link.element, kept_whole,
    ]  # fmt: skip
    key = sha256(json.dumps(described).encode() + contents([file])).hexdigest()
    made = partial(in_own_process, keys.file, PART, LONGEST, made_mesh, keys, name, link, shape, file, kept_whole)
    mesh: SolidMesh = kept("mesh", key, made, itself, itself)
    return mesh


def made_mesh(
    keys: CadKeys, name: str, link: LinkScene, shape: Cad, file: Path, kept_whole: KeptWhole = NOTHING
) -> SolidMesh:
    """What `cad_mesh` keeps, made in this process."""
    with solid_model(keys, file, name, shape) as (gmsh, solid):
        if link.mesh.size is not None and link.mesh.size > solid.extent:
            wanted = f"must be larger than its mesh.size {link.mesh.size:.6g} [m]"
            raise MeshError(f"{keys.file}: {wanted}, got {solid.extent:.6g}")
        sizing = _wanted(link, shape, kept_whole)
        mesh = with_faces(gmsh, solid, _sized_or_healed(keys.file, gmsh, solid, link, sizing))
        if solid.mended:
            mesh = replace(mesh, method=f"{mesh.method}; {solid.mended}")
    return placed(mesh, np.array(shape.origin), file_axes(shape))


def _sized_or_healed(where: str, gmsh: ModuleType, solid: Solid, link: LinkScene, asked: Sizing) -> SolidMesh:
    """The mesh; where there is none, or flat tetrahedra, one with tiny edges and faces of the CAD model healed away."""
    best: SolidMesh | MeshError
    try:
        best = _sized(where, gmsh, solid, link, asked)
        if not best.tetrahedra or mesh_quality(best).least > FLAT:
            return best
    except MeshError as error:
        if link.mesh.kind is not None:
            raise
        best = error
    for mended, words in healed(gmsh, where, solid, tetrahedron_size(solid, asked)):
        try:
            mesh = filled_mesh(gmsh, mended, asked)
        except OtherMethodError:
            continue
        if mesh_quality(mesh).least > FLAT:
            return replace(mesh, method=f"{mesh.method}; {words}")
    if isinstance(best, MeshError):
        raise best
    return best


def file_axes(shape: Cad | MeshFile) -> Float[np.ndarray, "3 3"]:
    """Where the x, y, z axes of a file go, as rows."""
    along = (1.0, 0.0, 0.0) if shape.towards is None else np.subtract(shape.towards, shape.origin)
    return frame_along(np.array(along), None if shape.z is None else np.array(shape.z))


def sizing(mesh: Meshing) -> Sizing:
    """What the keys of a link's mesh ask for."""
    hollow = USUAL if mesh.fillet_angle is None else mesh.fillet_angle
    return Sizing(
        size=mesh.size, across=mesh.elements_across or 2, layers=mesh.layers, ignore=mesh.defeature_size,
        hollow=hollow,
    )  # fmt: skip


def _wanted(link: LinkScene, shape: Cad, kept_whole: KeptWhole) -> Sizing:
    """What the keys of a link's mesh ask for, and where nothing may be left out."""
    points, names = kept_whole
    inside = points_in_file(points, np.array(shape.origin), file_axes(shape))
    return replace(sizing(link.mesh), kept=inside, named=names)


def _sized(where: str, gmsh: ModuleType, solid: Solid, link: LinkScene, asked: Sizing) -> SolidMesh:
    """The mesh of the size asked for, or of about so many unknowns."""
    wanted, element = link.mesh.unknowns, str(link.element)
    methods, form = METHODS["tet10" if element == "tet10" else link.mesh.kind], FORMS[element]
    if wanted is None:
        return best_mesh(where, gmsh, solid, asked, form, methods)

    def sized(size: float) -> tuple[SolidMesh, int]:
        nonlocal methods
        mesh = best_mesh(where, gmsh, solid, replace(asked, size=size), form, methods)
        if mesh.tetrahedra:
            methods = (filled_mesh,)  # what cannot be swept cannot in other sizes
        return mesh, 3 * len(form(mesh).points)

    nodes_each = {"hex8": 2, "hex20": 8, "hex27": 16, "tet10": 13}[element]  # to a cube of the size
    size = (solid.volume * 3 * nodes_each / wanted) ** (1 / 3)
    mesh, note = nearest(wanted, size, solid.extent / 2, _POWER, sized)
    return replace(mesh, method=f"{mesh.method}; {note}") if note else mesh


def best_mesh(
    where: str,
    gmsh: ModuleType,
    solid: Solid,
    sizing: Sizing,
    form: Callable[[SolidMesh], SolidMesh] = quadratic,
    methods: tuple[Method, ...] = METHODS[None],
) -> SolidMesh:
    """The mesh by the first method that is good enough, else by the best; in `method` what was done, and why not better.

    Parameters
    ----------
    form : what becomes of hexahedra, whose quality counts: of 20 nodes they may be worse than of 27
    """
    found: list[tuple[float, SolidMesh]] = []
    reasons: list[str] = []
    for method in methods:
        best = max((least for least, _ in found), default=-1.0)
        if method in (filled_mesh, subdivided_mesh) and best >= FAIR:
            break
        try:
            mesh = method(gmsh, solid, sizing)
        except OtherMethodError as error:
            reasons.append(str(error).removeprefix(f"{solid.name}: "))
            continue
        least = mesh_quality(form(mesh)).least
        many = sizing.size is None and sizing.across <= 2 and 3 * len(form(mesh).points) > MOST
        notes = [mesh.method, *reasons[: method not in SWEPT]]  # the first says what is in the way, of layers
        if mesh.tetrahedra or (least >= ENOUGH and not many):
            return replace(mesh, method="; ".join(notes))
        found.append((least - many, replace(mesh, method="; ".join(notes))))  # many: behind all others
        unfit = f"{3 * len(form(mesh).points):,} unknowns" if many else f"worst scaled Jacobian {least:.2g}"
        reasons.append(f"{mesh.method}: {unfit}")
    if not found:
        raise MeshError(
            f"{where}: must be a solid that can be meshed, got none: {'; '.join(reasons)}; "
            "take another size (mesh.size) or simplify the part there"
        )
    return max(found, key=lambda each: each[0])[1]


def healed(gmsh: ModuleType, where: str, solid: Solid, size: float) -> Iterator[tuple[Solid, str]]:
    """The solid of gmsh's model with edges and faces below growing sizes healed away, and what was done in words.

    Parameters
    ----------
    size : of the elements [m]; what is healed is much smaller

    Yields
    ------
    Solid and words, as long as it is a solid and the volume stays what it was.
    """
    tag = solid.tag
    for share in _HEALED:
        try:
            made = gmsh.model.occ.healShapes([(3, tag)], tolerance=share * size)
            gmsh.model.occ.synchronize()
        except Exception as error:
            if type(error) is not Exception:  # gmsh raises nothing more special
                raise
            return  # OpenCASCADE cannot close a face without what was healed away
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
