"""`kedfem frequencies`."""

from collections.abc import Iterable
from pathlib import Path
from typing import Annotated, Any

import typer

from kedfem.cli.options import Within
from kedfem.cli.screen import out, progress, show
from kedfem.errors import SceneError

OF_LINKAGES = ("positions", "free", "harmonics")
OF_CAD = ("solid", "size", "across", "unknowns")
OF_FILES = ("material", "solid", "size", "across", "unknowns", "element", "scale")


def frequencies(
    what: Annotated[
        Path,
        typer.Argument(metavar="SCENE", help="The scene file (TOML); or a part: a CAD file or a mesh file."),
    ],
    context: typer.Context,
    modes: Annotated[int, typer.Option(help="Frequencies at each position, or of the part.")] = 6,
    positions: Annotated[int, typer.Option(help="Over a turn, or over the whole run.")] = 16,
    free: Annotated[bool, typer.Option("--free", help="Drives let go of their joints.")] = False,
    harmonics: Annotated[int, typer.Option(help="Of the drive that are compared.")] = 5,
    shapes: Annotated[
        int, typer.Option(help="Lowest mode shapes that are drawn, and animated for ParaView.")
    ] = 0,
    link: Annotated[str | None, typer.Option(metavar="NAME", help="One link of the scene alone.")] = None,
    hold: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME",
            help="A joint of the link, or a face of the part, that is held; several: given again. Default: free.",
        ),
    ] = None,
    material: Annotated[
        str, typer.Option(metavar="NAME", help="Of a part: one that is built in, or '{ density = … }'.")
    ] = "steel",
    solid: Annotated[str | None, typer.Option(metavar="NAME", help="Which solid of an assembly.")] = None,
    size: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="Edge length of a part's elements, e.g. '3 mm'.")
    ] = None,
    across: Annotated[int | None, typer.Option(help="Elements across a part's smallest width.")] = None,
    unknowns: Annotated[int | None, typer.Option(help="About so many unknowns of a part.")] = None,
    element: Annotated[
        str, typer.Option(metavar="KIND", help="Of a part: hex27, hex20, hex8 or tet10.")
    ] = "hex27",
    scale: Annotated[
        float | None, typer.Option(help="Metres per unit of a part's file, if not its own unit.")
    ] = None,
    folder: Annotated[
        Path | None, typer.Option(help="Where all goes; default: SCENE-frequencies beside the scene.")
    ] = None,
    within: Within = False,
) -> None:
    """Natural frequencies: of the linkage frozen at positions over a turn, or of one link or part, free or held."""
    from kedfem.frequencies import Wanted, link_of_scene, part_frequencies, part_from_file
    from kedfem.frequencies import frequencies as found_of
    from kedfem.mesh import CAD_ENDINGS
    from kedfem.scene import face_from, link_from, material_from, read_scene
    from kedfem.scene.records.shapes import MESH_ENDINGS
    from kedfem.tables import frequencies_tables, part_tables

    cad = what.suffix.lower() in CAD_ENDINGS
    of_file = cad or what.suffix.lower() in MESH_ENDINGS
    _refuse(context, OF_LINKAGES if of_file or link else (), "must be left out for a single link or part")
    _refuse(context, () if of_file else OF_FILES, "must be left out for a scene, which says it")
    _refuse(
        context,
        OF_CAD if of_file and not cad else (),
        "must be left out for a mesh file, which has its elements",
    )
    _refuse(context, ("link", "within") if of_file else (), "must be combined with a scene")
    _refuse(context, () if of_file or link else ("hold",), "must be combined with --link, or with a part")
    with progress() as watch:
        watch("mesh and matrices", 0, 0)
        if of_file:
            shape = {"kind": "cad" if cad else "mesh", "file": what.name, "solid": solid, "scale": scale}
            sizes = {"size": size, "elements_across": across, "unknowns": unknowns}
            given = link_from(_given({"shape": _given(shape), "mesh": _given(sizes), "element": element}))
            faces = [face_from("--hold", each) for each in hold or []]
            part = part_from_file(what, given, material_from("--material", material), faces)
            alone = part_frequencies(part, modes, folder, watch, shapes)
        else:
            loaded = read_scene(what, within=within)
            if link is not None:
                alone = part_frequencies(
                    link_of_scene(loaded, link, hold or []), modes, folder, watch, shapes
                )
            else:
                done = found_of(loaded, Wanted(modes, positions, free, harmonics, shapes), folder, watch)
    if of_file or link is not None:
        show(part_tables(alone))
        out.print(f"{alone.folder}  table{', mode shapes' * (shapes > 0)}", markup=False, soft_wrap=True)
    else:
        show(frequencies_tables(loaded, done), done.warnings)
        out.print(
            f"{done.folder}  table, plots{', mode shapes' * (shapes > 0)}", markup=False, soft_wrap=True
        )


def _refuse(context: typer.Context, options: Iterable[str], wanted: str) -> None:
    """Refuse options that have no meaning for what was named."""
    for option in options:
        source = context.get_parameter_source(option)
        if source is not None and source.name == "COMMANDLINE":
            got = context.params[option]
            raise SceneError(f"--{option}: {wanted}, got {'it' if isinstance(got, bool) else got}")


def _given(keys: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in keys.items() if value is not None}
