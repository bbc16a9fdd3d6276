"""Parts from CAD: one solid of a STEP, IGES or BREP file in gmsh's model, in metres, everything else removed."""

from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType

import numpy as np

from kedfem.arrays import Float
from kedfem.errors import MeshError
from kedfem.mesh.cad.file import CadFile, cad_file, check_size, imported, read_solids
from kedfem.mesh.cad.solid_faces import SAME_VOLUME, cad_faces, enclosed_volume, solid_box
from kedfem.mesh.cad.solids import Solid
from kedfem.mesh.cad.text import Body, own_name, step_bodies, step_products, step_text
from kedfem.mesh.session import boundary, gmsh_model
from kedfem.scene.records.shapes import Cad
from kedfem.scene.records.wording import nearest

MOST_FACES = 3000  # each takes some 10 ms, and pairs of them are compared
_SAME = 1e-5  # of the solid's size: most difference between corners in gmsh and in the file's text


@dataclass(frozen=True, slots=True)
class CadKeys:
    """Names for messages of the file and of the choice of a solid: keys of the scene, or options of a command."""

    file: str
    solid: str


@contextmanager
def solid_model(keys: CadKeys, path: Path, name: str, shape: Cad) -> Iterator[tuple[ModuleType, Solid]]:
    """gmsh with one solid of a CAD file in its model, in metres and the file's own frame.

    Parameters
    ----------
    name : the link's name, which selects the solid of an assembly unless `shape.solid` does
    shape : its `solid` and `scale` are used; the caller places the mesh

    Raises
    ------
    MeshError
        The file cannot be read, has no solid or none of the name asked for, or the solid cannot be meshed.
    """
    file = cad_file(keys.file, path, shape.scale)
    with gmsh_model() as gmsh:
        yield gmsh, chosen_solid(gmsh, file, keys.solid, name, shape.solid)


def chosen_solid(gmsh: ModuleType, file: CadFile, key: str, link: str, wanted: str | None) -> Solid:
    """One solid of a file, which is read into gmsh's empty model; everything else is removed from it."""
    tags, names, bodies, mended = _named_solids(gmsh, file)
    tag = tags[_choice(key, file, names, link, wanted)]
    leave_only(gmsh, tag)
    solid = _solid(gmsh, file, tag, names[tags.index(tag)], bodies[tag])
    return replace(solid, mended=mended) if mended else solid


def all_solids(gmsh: ModuleType, file: CadFile) -> list[Solid]:
    """Every solid of a file, which is read into gmsh's empty model and stays at its place.

    Errors are those of `solid_model`.
    """
    tags, names, bodies, _ = _named_solids(gmsh, file)
    return [_solid(gmsh, file, tag, name, bodies[tag]) for tag, name in zip(tags, names, strict=True)]


def _named_solids(gmsh: ModuleType, file: CadFile) -> tuple[list[int], list[str], dict[int, Body | None], str]:
    """Tags, names and bodies (in the file's text) of a file's solids, now in gmsh's model, and what was mended."""
    tags, mended = read_solids(gmsh, file)
    most = max(len(boundary(gmsh, 3, tag)) for tag in tags)
    if most > MOST_FACES:
        raise MeshError(
            f"{file.where}: must hold solids of at most {MOST_FACES:,} faces, got one of {most:,} in {file.path}; "
            "export surfaces instead of facets, leave out threads, knurls and lettering, or mesh it with another "
            "program (shape.kind = 'mesh')"
        )
    bodies = _bodies(gmsh, file, tags)
    return tags, _solid_names(gmsh, file, tags, bodies), bodies, mended


def _solid(gmsh: ModuleType, file: CadFile, tag: int, name: str, body: Body | None) -> Solid:
    """The record of a solid in the model; a MeshError if it is not a closed solid of positive volume."""
    box = np.array(gmsh.model.getBoundingBox(3, tag))
    extent = float(np.linalg.norm(box[3:] - box[:3]))
    volume = float(gmsh.model.occ.getMass(3, tag))
    check_size(file, repr(name), extent)
    if volume <= 1e-9 * extent**3:
        raise MeshError(
            f"{file.where}: must hold a solid of positive volume [m³], got {volume:.3g} for {name!r} in "
            f"{file.path}; its faces may be turned inwards or lie on each other: mend the part in CAD"
        )
    faces = sorted(boundary(gmsh, 3, tag))
    named = {face: text for face, text in zip(faces, body.faces, strict=True) if text} if body else {}
    known = cad_faces(gmsh, file.where, tag, extent, named)
    enclosed = enclosed_volume(gmsh, known)
    if abs(enclosed - volume) > SAME_VOLUME * volume:
        raise MeshError(
            f"{file.where}: must be a solid whose faces enclose its volume, got {enclosed:.6g} [m³] within the "
            f"faces and {volume:.6g} for the solid {name!r} in {file.path}; export it again, as STEP if you can"
        )
    low, high = solid_box(gmsh, known)
    return Solid(tag, name, volume, low, high, known)


def _choice(key: str, file: CadFile, names: list[str], link: str, wanted: str | None) -> int:
    """Index of the solid asked for: that of the name given, the only one, or that of the link's name."""
    if wanted is None and len(names) == 1:
        return 0
    asked = link if wanted is None else wanted
    if asked in names:
        return names.index(asked)
    close = nearest(asked, names)
    known = f"{', '.join(names)}" + (f"; did you mean {close!r}?" if close else "")
    if wanted is not None:
        raise MeshError(f"{key}: must name a solid of {file.path}, got {wanted!r}, there are: {known}")
    raise MeshError(
        f"{key}: is required, or a solid called {link!r} like the link, for a file with {len(names)} "
        f"solids, got {file.path} with: {known}"
    )


def leave_only(gmsh: ModuleType, solid: int) -> None:
    """Remove everything else from the model."""
    kept = {(3, solid), *((2, tag) for tag in boundary(gmsh, 3, solid))}
    for dimension in (1, 0):
        above = [tag for at, tag in kept if at == dimension + 1]
        kept |= {(dimension, tag) for tag in boundary(gmsh, dimension + 1, *above)}
    for dimension in (3, 2, 1, 0):
        others = [entity for entity in gmsh.model.getEntities(dimension) if tuple(entity) not in kept]
        gmsh.model.occ.remove(others)
    gmsh.model.occ.synchronize()


def _solid_names(gmsh: ModuleType, file: CadFile, tags: list[int], bodies: dict[int, Body | None]) -> list[str]:
    """A unique name for each solid: that of its product, else of its body; equal names are numbered."""
    names = _product_names(gmsh, file, len(tags))
    often = Counter(names)
    own = [(body.name if body else "") for body in bodies.values()]
    names = [mine if mine and (not name or often[name] > 1) else name for name, mine in zip(names, own, strict=True)]
    names = [name or "solid" for name in names]
    often, seen = Counter(names), Counter[str]()
    for i, name in enumerate(names):
        seen[name] += 1
        if often[name] > 1 or (name == "solid" and len(names) > 1):
            names[i] = f"{name} {seen[name]}"
    return names


def _product_names(gmsh: ModuleType, file: CadFile, count: int) -> list[str]:
    """The product names of the solids, from gmsh's labels of an import without scaling, which would lose them."""
    if file.format != "STEP":
        return [file.path.stem] if count == 1 else [""] * count
    if count == 1:
        products = step_products(step_text(file.path))
        return [products[0] if len(products) == 1 else file.path.stem]
    gmsh.model.add("names")
    try:
        imported(gmsh, file, 1.0, sewing=None)
        labels = [gmsh.model.getEntityName(3, tag) for _, tag in gmsh.model.getEntities(3)]
    finally:
        gmsh.model.remove()
    names = [own_name(label.rpartition("/")[2]) for label in labels]
    return names if len(names) == count else [""] * count


def _bodies(gmsh: ModuleType, file: CadFile, tags: list[int]) -> dict[int, Body | None]:
    """For each solid its body in a STEP file's text, None where that is not certain."""
    texts = list(step_bodies(step_text(file.path))) if file.format == "STEP" else []
    return {tag: _body(gmsh, tag, texts) for tag in tags}


def _body(gmsh: ModuleType, tag: int, texts: list[Body]) -> Body | None:
    """The body whose faces have the same corners as the solid's faces, in order.

    Distances between the faces' mean corners are compared, because they do not depend on the place in an assembly.
    """
    faces = sorted(boundary(gmsh, 3, tag))
    likely = [body for body in texts if len(body.faces) == len(faces)]
    if not likely:
        return None
    corners = np.array([_corner_mean(gmsh, face) for face in faces])
    found = [body for body in likely if same_shape(corners, body.corners)]
    sure = found and all(body.faces == found[0].faces and body.name == found[0].name for body in found)
    return found[0] if sure else None


def _corner_mean(gmsh: ModuleType, face: int) -> Float[np.ndarray, "3"]:
    """The mean of a face's vertices; nan for a face without vertices."""
    vertices = {tag for _, tag in gmsh.model.getBoundary([(2, face)], combined=False, recursive=True)}
    points = [gmsh.model.getValue(0, tag, []) for tag in sorted(vertices)]
    return np.mean(points, axis=0) if points else np.full(3, np.nan)


def same_shape(corners: Float[np.ndarray, "f 3"], text: Float[np.ndarray, "f 3"]) -> bool:
    """Whether two sets of points are congruent up to a scale factor; at most one point may be unknown (nan)."""
    known = np.isfinite(corners).all(axis=1) & np.isfinite(text).all(axis=1)
    if known.sum() < max(len(known) - 1, 1):
        return False
    mine, theirs = (np.linalg.norm(X[known, None] - X[None, known], axis=2) for X in (corners, text))
    ratio = float(np.linalg.norm(mine)) / max(float(np.linalg.norm(theirs)), 1e-300)
    return bool(np.abs(mine - ratio * theirs).max() <= _SAME * max(mine.max(), 1e-300))
