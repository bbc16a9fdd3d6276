"""Commands that take parts from CAD, on their own or as links: `kedfem mesh`, `frequencies`."""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated

import typer

from kedfem.cli.options import Across, ElementKind, Scale, Size, Solid, Unknowns, Within, flag, given, goes_to, option
from kedfem.cli.screen import progress, say, show, warn
from kedfem.errors import OutputError, SceneError

OF_LINKAGES = ("positions", "free", "harmonics")
OF_CAD = ("solid", "size", "across", "unknowns")
OF_FILES = (*OF_CAD, "material", "element", "scale")


def mesh(
    part: Annotated[Path, typer.Argument(metavar="PART", help="A CAD file: STEP, IGES or BREP.")],
    solid: Solid = None,
    size: Size = None,
    across: Across = None,
    unknowns: Unknowns = None,
    element: ElementKind = "hex27",
    min_quality: Annotated[float | None, option("Least scaled Jacobian of the elements.", "NUMBER")] = None,
    scale: Scale = None,
    folder: Annotated[Path | None, goes_to("PART-mesh beside the part", "mesh and picture go")] = None,
) -> None:
    """Mesh one part from CAD: what joints can sit on, a mesh file, a picture, its quality."""
    from kedfem.links.surfaces.part_candidates import part_candidates
    from kedfem.mesh import part_mesh
    from kedfem.output.mesh_picture import write_mesh_picture
    from kedfem.output.vtu import write_mesh
    from kedfem.results import ready_folder
    from kedfem.scene import link_from
    from kedfem.tables import mesh_tables

    shape = given(kind="cad", file=part.name, solid=solid, scale=scale)
    sizes = given(size=size, elements_across=across, unknowns=unknowns)
    link = link_from(given(shape=shape, mesh=sizes, element=element, min_quality=min_quality))
    with progress() as watch:
        watch("mesh", 0, 0)
        made = part_mesh(link, part.parent)
        found = part_candidates(made)
    show(mesh_tables(part.name, made, found))
    stem = part.stem if solid is None else f"{part.stem}-{solid}"
    target = ready_folder(folder or part.with_name(f"{stem}-mesh"))
    write_mesh(made, target / "mesh.vtu")
    say(target / "mesh.vtu", "the mesh, for ParaView or shape.kind = 'mesh'")
    try:
        write_mesh_picture([(part.name, made)], target / "mesh.png", f"{part.name}: {made.method}", found)
    except OutputError as error:
        warn(f"warning: {error}")
    else:
        say(target / "mesh.png", "its picture")


def frequencies(
    what: Annotated[
        Path, typer.Argument(metavar="SCENE", help="The scene file (TOML); or a part: a CAD file or a mesh file.")
    ],
    context: typer.Context,
    modes: Annotated[int, option("Frequencies at each position, or of the part.")] = 6,
    positions: Annotated[int, option("Over a revolution, or over the whole run.")] = 16,
    free: Annotated[bool, flag("--free", "Drives release their joints.")] = False,
    harmonics: Annotated[int, option("Of the drive that are compared.")] = 5,
    shapes: Annotated[int, option("Lowest mode shapes that are drawn, and animated for ParaView.")] = 0,
    link: Annotated[str | None, option("One link of the scene alone.", "NAME")] = None,
    hold: Annotated[
        list[str] | None,
        option("A joint of the link, or a face of the part, that is held; several: given again. Default: free.", "NAME"),
    ] = None,
    material: Annotated[str, option("Of a part: one that is built in, or '{ density = … }'.", "NAME")] = "steel",
    solid: Solid = None,
    size: Size = None,
    across: Across = None,
    unknowns: Unknowns = None,
    element: ElementKind = "hex27",
    scale: Scale = None,
    folder: Annotated[Path | None, goes_to("SCENE-frequencies beside the scene")] = None,
    within: Within = False,
) -> None:
    """Natural frequencies: of the linkage frozen at positions over a revolution, or of one link or part, free or held."""
    from kedfem.frequencies import Wanted, link_of_scene, part_frequencies, part_from_file
    from kedfem.frequencies import frequencies as found_of
    from kedfem.mesh import CAD_ENDINGS
    from kedfem.scene import face_from, link_from, material_from, read_scene
    from kedfem.scene.records.shapes import MESH_ENDINGS
    from kedfem.tables import frequencies_tables, part_tables

    cad = what.suffix.lower() in CAD_ENDINGS
    of_file = cad or what.suffix.lower() in MESH_ENDINGS
    alone = of_file or link is not None
    for refused, options, wanted in (
        (alone, OF_LINKAGES, "must be left out for a single link or part"),
        (not of_file, OF_FILES, "must be left out for a scene, which says it"),
        (of_file and not cad, OF_CAD, "must be left out for a mesh file, which has its elements"),
        (of_file, ("link", "within"), "must be combined with a scene"),
        (not alone, ("hold",), "must be combined with --link, or with a part"),
    ):
        _refuse(context, options if refused else (), wanted)
    with progress() as watch:
        watch("mesh and matrices", 0, 0)
        if of_file:
            shape = given(kind="cad" if cad else "mesh", file=what.name, solid=solid, scale=scale)
            sizes = given(size=size, elements_across=across, unknowns=unknowns)
            meshed = link_from(given(shape=shape, mesh=sizes or None, element=element))
            faces = [face_from("--hold", each) for each in hold or []]
            part = part_from_file(what, meshed, material_from("--material", material), faces)
            found = part_frequencies(part, modes, folder, watch, shapes)
        elif link is not None:
            part = link_of_scene(read_scene(what, within=within), link, hold or [])
            found = part_frequencies(part, modes, folder, watch, shapes)
        else:
            loaded = read_scene(what, within=within)
            done = found_of(loaded, Wanted(modes, positions, free, harmonics, shapes), folder, watch)
    if alone:
        show(part_tables(found), found.warnings)
        say(found.folder, f"table{', mode shapes' * (shapes > 0)}")
    else:
        show(frequencies_tables(loaded, done), done.warnings)
        say(done.folder, f"table, plots{', mode shapes' * (shapes > 0)}")


def _refuse(context: typer.Context, options: Iterable[str], wanted: str) -> None:
    """Refuse options that have no meaning for what was named."""
    for name in options:
        source = context.get_parameter_source(name)
        if source is not None and source.name == "COMMANDLINE":
            got = context.params[name]
            raise SceneError(f"--{name}: {wanted}, got {'it' if isinstance(got, bool) else got}")
