"""The tables of a meshed part: names that are there to be copied are whole, however narrow the terminal."""

import io

import numpy as np
import pytest
from rich.console import Console

from kedfem.links.surfaces.part_candidates import part_candidates
from kedfem.mesh import SolidMesh
from kedfem.mesh.elements.hexahedra import Face
from kedfem.mesh.elements.shape_functions import HEX8
from kedfem.tables import mesh_tables


@pytest.mark.parametrize("width", [60, 80, 140])
def test_names_of_faces_are_whole_in_a_narrow_terminal(width: int) -> None:
    names = [f"face {k}" for k in (7, 12, 123)]
    oblique, sides = np.array([0.781234, -0.624712, 0.0123]), np.array([[0, 1, 2, 3]])
    faces = tuple(
        Face(name, "plane", np.array([-0.123456, 0.0123456, 0.2]), oblique, np.nan, False, sides) for name in names
    )
    mesh = SolidMesh(0.1 * HEX8, np.arange(8)[None], faces=faces)
    said = io.StringIO()
    for table in mesh_tables("part.step", mesh, part_candidates(mesh)):
        Console(file=said, width=width).print(table)
    text = said.getvalue()
    assert all(f" {name} " in text for name in names)
    assert "…" not in text
    digits = "".join(character for character in text if character.isdigit() or character == ".")
    assert "0.781" in digits or "781" in digits
    assert max(map(len, text.splitlines())) <= width
