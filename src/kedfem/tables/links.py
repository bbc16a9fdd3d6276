"""The links of a model in a table."""

from collections.abc import Sequence

from rich.table import Table
from rich.text import Text

from kedfem.dynamics.model import Model, segments, ways
from kedfem.links.record import Link
from kedfem.mesh import QuadMesh, SolidMesh, mesh_quality

ELEMENTS = {
    "hexahedron27": "hex27",
    "hexahedron20": "hex20",
    "hexahedron": "hex8",
    "tetra10": "tet10",
    "quad9": "quad9",
    "line3": "beam3",
    "line": "beam2",
    **{f"line{nodes}": f"beam{nodes}" for nodes in (4, 5, 7, 9)},
}


def link_table(model: Model) -> Table:
    """What each link is modelled as."""
    table = Table(title="Links")
    for column in ("link", "kind", "elements", "unknowns", "mass", "quality"):
        table.add_column(column, justify="left" if column in ("link", "kind") else "right", overflow="fold")
    for name, parts in segments(model).items():
        elements, unknowns = (
            str(sum(each)) for each in ([len(x.cells) for x in parts], [x.unknowns for x in parts])
        )
        table.add_row(name, _kind(parts), elements, unknowns, _mass(*parts), _quality(*parts))
    for carried in model.carried:
        table.add_row(carried.link.name, "rigid, with the drive", "-", "0", _mass(carried.link), "-")
    for slider in model.sliders:
        table.add_row(
            slider.name,
            "rigid slider",
            "-",
            "1",
            f"{slider.mass:.4g} kg, on {model.links[slider.carrier].name}",
            "-",
        )
    joined = f"{model.unknowns} unknowns in all, {model.coordinates} generalised coordinates once joined"
    table.caption = f"{joined}; mass: with what is attached; quality: worst scaled Jacobian"
    return table


def way_tables(model: Model) -> list[Table]:
    """How parts from CAD were meshed, and why so."""
    table = Table(title="Meshes of parts from CAD", show_header=False)
    for name, way in ways(model).items():
        table.add_row(name, Text(way))
    return [table] if table.row_count else []


def _kind(parts: Sequence[Link]) -> str:
    """Its elements, and what was made of them."""
    first, functions = parts[0], [link.n for link in parts]
    kind = "rigid" if first.rigid else ELEMENTS[first.cell_type]
    if first.fit is not None and not first.rigid:
        kind += f", {len(parts)} co-rotational segments" if len(parts) > 1 else ", 1 co-rotational segment"
    elif first.fit is not None:
        kind += ", co-rotational"
    if first.full and not first.rigid:
        low, high = min(functions), max(functions)
        kind += f", {low} modes" if low == high else f", {low} to {high} modes"
        kind += " each" if len(parts) > 1 else ""
    return kind


def _mass(*parts: Link) -> str:
    return f"{sum(float(link.one @ link.m1[:, 0]) for link in parts):.4g} kg"


def _quality(*parts: Link) -> str:
    """The worst scaled Jacobian of a meshed link."""
    full = [link.full or link for link in parts]
    if not full[0].meshed:
        return "-"
    meshes = [
        QuadMesh(link.X, link.cells, link.thickness)
        if link.kind == "plane"
        else SolidMesh(link.X, link.cells)
        for link in full
    ]
    return f"{min(mesh_quality(mesh).least for mesh in meshes):.2f}"
