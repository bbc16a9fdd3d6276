"""Parts of random dimensions are meshed or refused with a message; an inverted element is never let through."""

from pathlib import Path

import gmsh
import numpy as np
import pytest
from geometry.make import empty_model

from kedfem.errors import MeshError
from kedfem.links.solid import solid_link
from kedfem.mesh import mesh_quality, part_mesh
from kedfem.mesh.bounds import valid_everywhere
from kedfem.scene import Material, link_from
from tests.random_parts import random_part

SEEDS = range(30)
UNIT = Material(density=1.0, youngs_modulus=1.0, poisson_ratio=0.3)


@pytest.mark.long
def test_parts_of_random_dimensions_are_meshed_or_refused(tmp_path: Path) -> None:
    """Of 30 at most three are refused; the others are valid everywhere and have the volume that CAD gives them."""
    refused = []
    for seed in SEEDS:
        with empty_model() as occ:
            kind, tag = random_part(occ, np.random.default_rng(seed))
            occ.synchronize()
            volume = 1e-9 * occ.getMass(3, tag)
            gmsh.write(str(tmp_path / "part.step"))
        try:
            mesh = part_mesh(link_from({"material": "steel", "step": "part.step"}), tmp_path)
        except MeshError as error:
            refused.append(f"{kind}: {error}")
            continue
        assert mesh_quality(mesh).least >= 0.1
        assert valid_everywhere(mesh.points, mesh.cells).all()
        assert solid_link(kind, mesh, UNIT, np.eye(3)).m1[:, 0].sum() == pytest.approx(volume, rel=3e-4), kind
    assert all(": part.step: " in each for each in refused), refused
    assert len(refused) <= 3, refused
