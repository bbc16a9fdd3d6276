"""The links of a model in a table."""

from rich.table import Table
from rich.text import Text

from kedfem.dynamics.model import Model, mesh_methods, segments
from kedfem.links.record import Link
from kedfem.mesh import QuadMesh, SolidMesh, mesh_quality
from kedfem.results.modelled import element_facts


def link_table(model: Model) -> Table:
    """What each link is modelled as."""
    table = Table(title="Links")
    for column in ("link", "kind", "elements", "unknowns", "mass", "quality"):
        table.add_column(column, justify="left" if column in ("link", "kind") else "right", overflow="fold")
    for name, parts in segments(model).items():
        facts = map(str, element_facts(parts).values())
        table.add_row(name, *facts, _mass(*parts), _quality(*parts))
    for prescribed in model.prescribed:
        table.add_row(prescribed.link.name, "rigid, with the drive", "-", "0", _mass(prescribed.link), "-")
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
    for name, method in mesh_methods(model).items():
        table.add_row(name, Text(method))
    return [table] if table.row_count else []


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
