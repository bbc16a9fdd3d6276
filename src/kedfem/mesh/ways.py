"""The ladder of ways to fill a part from CAD with hexahedra: the best that it allows, and why not a better one."""

import json
from collections.abc import Callable
from dataclasses import replace
from hashlib import sha256
from pathlib import Path
from types import ModuleType
from typing import Any, TypeVar

import numpy as np
from jaxtyping import Float

from kedfem.errors import MeshError
from kedfem.mesh.blocks import block_mesh
from kedfem.mesh.cad.faces import with_faces
from kedfem.mesh.cad.model import CadKeys, solid_model
from kedfem.mesh.cad.solids import OtherWayError, Sizing, Solid
from kedfem.mesh.cut.subdivided import subdivided_mesh
from kedfem.mesh.hexahedra import FORMS, HexMesh, frame_along, placed, quadratic
from kedfem.mesh.layered.layers import layered_mesh
from kedfem.mesh.quality import mesh_quality
from kedfem.scene import Cad, LinkScene, MeshFile, Meshing
from kedfem.store import contents, itself, kept

ENOUGH = 0.3  # worst scaled Jacobian with which the next way is not tried
NEAR = 1.15  # ratio of unknowns got and asked for that is near enough
TRIES = 5  # meshes made in search of a number of unknowns
LONGEST = 300  # seconds after which a part is given up

T = TypeVar("T")

WAYS: tuple[Callable[[ModuleType, Solid, Sizing], HexMesh], ...] = (
    layered_mesh,
    block_mesh,
    subdivided_mesh,
)


def cad_mesh(keys: CadKeys, name: str, link: LinkScene, shape: Cad, folder: Path) -> HexMesh:
    """hex27 mesh of a part from CAD, where the scene has it, its faces known; kept between runs.

    Parameters
    ----------
    keys : for messages
    name : the link's name, that of its solid in an assembly
    folder : what the file's name is relative to

    Raises
    ------
    MeshError
        The file cannot be used, or no way gives hexahedra.
    """
    file = folder / shape.file
    said = [name, shape.model_dump(mode="json"), link.mesh.model_dump(mode="json"), link.element]
    key = sha256(json.dumps(said).encode() + contents([file])).hexdigest()
    mesh: HexMesh = kept(
        "mesh", key, lambda: apart(keys.file, _made, keys, name, link, shape, file), itself, itself
    )
    return mesh


def apart(where: str, work: Callable[..., T], *given: Any) -> T:
    """What a function returns in a process of its own: gmsh and OpenCASCADE break down or hang on some parts.

    Raises
    ------
    MeshError
        The process broke down, or took more than LONGEST seconds; or what the function raises.
    """
    from joblib.externals.loky import TimeoutError as LateError
    from joblib.externals.loky import get_reusable_executor
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    executor = get_reusable_executor(max_workers=1, timeout=LONGEST)
    try:
        found: T = executor.submit(work, *given).result(timeout=LONGEST)
    except LateError:
        executor.shutdown(kill_workers=True)
        reason = f"got none within {LONGEST} s"
    except TerminatedWorkerError:
        reason = "got one at which they broke down"
    else:
        return found
    raise MeshError(
        f"{where}: must be a part that gmsh and OpenCASCADE can work on, {reason}; "
        "mend or simplify it in CAD (fillets that are thinner than an element first), or take another mesh.size"
    )


def _made(keys: CadKeys, name: str, link: LinkScene, shape: Cad, file: Path) -> HexMesh:
    with solid_model(keys, file, name, shape) as (gmsh, solid):
        if link.mesh.size is not None and link.mesh.size > solid.extent:
            raise MeshError(
                f"{keys.file}: must be larger than its mesh.size {link.mesh.size:.6g} [m], got {solid.extent:.6g}"
            )
        mesh = with_faces(gmsh, solid, _sized(keys.file, gmsh, solid, link))
    return placed(mesh, np.array(shape.origin), file_axes(shape))


def file_axes(shape: Cad | MeshFile) -> Float[np.ndarray, "3 3"]:
    """Where the x, y, z axes of a file go, as rows."""
    along = (1.0, 0.0, 0.0) if shape.towards is None else np.subtract(shape.towards, shape.origin)
    return frame_along(np.array(along), None if shape.z is None else np.array(shape.z))


def sizing(mesh: Meshing) -> Sizing:
    """What the keys of a link's mesh ask for."""
    return Sizing(size=mesh.size, across=mesh.elements_across or 2, layers=mesh.layers)


def _sized(where: str, gmsh: ModuleType, solid: Solid, link: LinkScene) -> HexMesh:
    """The mesh of the size asked for, or of the number of unknowns: then the nearest of at most TRIES."""
    asked, wanted = sizing(link.mesh), link.mesh.unknowns
    form = FORMS[str(link.element)]
    if wanted is None:
        return best_mesh(where, gmsh, solid, asked, form)
    nodes_each = {"hex8": 1, "hex20": 4, "hex27": 8}[str(link.element)]  # in the middle of a mesh
    size = (solid.volume * 3 * 2 * nodes_each / wanted) ** (1 / 3)
    found: list[tuple[float, HexMesh]] = []
    for _ in range(TRIES):
        mesh = best_mesh(where, gmsh, solid, replace(asked, size=min(size, solid.extent / 2)), form)
        ratio = 3 * len(form(mesh).points) / wanted
        found.append((abs(np.log(ratio)), mesh))
        if 1 / NEAR < ratio < NEAR:
            break
        size *= ratio ** (1 / 2.5)  # in between what plates and lumps need
    off, mesh = min(found, key=lambda each: each[0])
    if off <= np.log(NEAR):
        return mesh
    return replace(mesh, way=f"{mesh.way}; the nearest found to the {wanted:,} unknowns asked for")


def best_mesh(
    where: str, gmsh: ModuleType, solid: Solid, sizing: Sizing, form: Callable[[HexMesh], HexMesh] = quadratic
) -> HexMesh:
    """The mesh by the first way that is good enough, else by the best; in `way` what was done, and why not better.

    Parameters
    ----------
    form : what becomes of its elements, whose quality counts: of 20 nodes they may be worse than of 27

    Raises
    ------
    MeshError
        No way gives hexahedra; with the reasons of each.
    """
    found: list[tuple[float, HexMesh]] = []
    reasons: list[str] = []
    for way in WAYS:
        try:
            mesh = way(gmsh, solid, sizing)
        except OtherWayError as error:
            reasons.append(str(error))
            continue
        least = mesh_quality(form(mesh)).least
        found.append((least, replace(mesh, way="; ".join([mesh.way, *reasons]))))
        if least >= ENOUGH:
            break
        reasons.append(f"{mesh.way}: worst scaled Jacobian {least:.2g}")
    if not found:
        raise MeshError(
            f"{where}: must be a solid that hexahedra can fill, got none: {'; '.join(reasons)}; "
            "take smaller elements (mesh.size) or simplify the part there"
        )
    return max(found, key=lambda each: each[0])[1]
