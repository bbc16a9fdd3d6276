"""Parts of random dimensions are meshed, without an inverted element."""

from pathlib import Path

import gmsh
import numpy as np
import pytest
from geometry.make import empty_model

from kedfem.links.solid import solid_link
from kedfem.mesh import mesh_quality, part_mesh
from kedfem.mesh.elements.bounds import valid_everywhere
from kedfem.scene import Material, link_from
from tests.random_parts import random_part

SEEDS = {"fifteen": range(15), "fifteen others": range(15, 30)}
UNIT = Material(density=1.0, youngs_modulus=1.0, poisson_ratio=0.3)


@pytest.mark.long
@pytest.mark.parametrize("seeds", SEEDS.values(), ids=SEEDS)
def test_parts_of_random_dimensions_are_meshed(seeds: range, tmp_path: Path) -> None:
    """Of these none is refused; all are valid everywhere and have the volume that CAD gives them."""
    for seed in seeds:
        with empty_model() as occ:
            kind, tag = random_part(occ, np.random.default_rng(seed))
            occ.synchronize()
            volume = 1e-9 * occ.getMass(3, tag)
            gmsh.write(str(tmp_path / "part.step"))
        mesh = part_mesh(link_from({"material": "steel", "shape": {"file": "part.step"}}), tmp_path)
        assert mesh_quality(mesh).least >= (0.04 if mesh.tetrahedra else 0.1), kind
        assert valid_everywhere(mesh.points, mesh.cells).all()
        assert solid_link(kind, mesh, UNIT, np.eye(3)).m1[:, 0].sum() == pytest.approx(volume, rel=5e-4), (
            kind
        )  # balls by coarse elements
