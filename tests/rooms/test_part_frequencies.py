"""`kedfem frequencies PART` and `--link NAME`: supports, motions without strain, files, refusals."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.testing import assert_allclose
from typer.testing import CliRunner

from kedfem.cli import app
from kedfem.errors import KedfemError
from kedfem.frequencies import Wanted, frequencies, link_of_scene, part_frequencies
from kedfem.mesh import SolidMesh
from kedfem.output.vtu import write_mesh
from kedfem.scene import scene_from
from kedfem.tables import part_tables
from tests.rooms.cad_files import written
from tests.rooms.test_resolution import arm
from tests.verification.meshes import box, mapped_mesh


@pytest.mark.parametrize("model", ["beam", "solid", "plane"])
def test_a_link_held_at_its_driven_joint_is_the_linkage_of_that_link_alone(model: str, tmp_path: Path) -> None:
    scene = scene_from(arm(model), tmp_path)
    whole = frequencies(scene, Wanted(modes=3, positions=1), tmp_path / "whole")
    found = part_frequencies(link_of_scene(scene, "arm", ["A"]), 3, tmp_path / "part")
    assert found.still == 0
    # two routes to the same eigenvalues; a joint's ports on its axis hold the surface's stretch along it too
    assert_allclose(found.values, whole.values[0], rtol={"beam": 1e-7}.get(model, 2e-4))


@pytest.mark.parametrize(("model", "motions"), [("beam", 3), ("plane", 3), ("solid", 6)])
def test_motions_without_strain_are_those_of_a_free_body(model: str, motions: int, tmp_path: Path) -> None:
    raw = arm(model)
    del raw["drive"]
    raw["analysis"] = {"end_time": 0.1, "step": 1e-3}
    scene = scene_from(raw, tmp_path)
    free = part_frequencies(link_of_scene(scene, "arm"), 2, tmp_path / "free")
    hinged = part_frequencies(link_of_scene(scene, "arm", ["A"]), 2, tmp_path / "hinged")
    assert (free.still, hinged.still) == (motions, 1)
    assert free.values.min() > 1.0  # no zero among them
    table = np.loadtxt(tmp_path / "free" / "frequencies.csv", delimiter=",", skiprows=1)
    assert_allclose(table, np.column_stack([[1, 2], free.values]), rtol=5e-9)  # nine digits
    assert f"{motions} motions without strain" in str(part_tables(free)[0].caption)


@pytest.fixture
def plate(tmp_path: Path) -> Path:
    mesh: SolidMesh = mapped_mesh((10, 2, 1), box((0.1, 0.02, 0.005)))
    write_mesh(mesh, tmp_path / "plate.vtu")
    return tmp_path / "plate.vtu"


def test_the_command_holds_faces_and_leaves_a_table(plate: Path) -> None:
    hold = "{ plane = 'x', near = [0, 0.01, 0] }"
    command = ["frequencies", str(plate), "--modes", "2", "--hold", hold, "--material", "aluminium"]
    done = CliRunner().invoke(app, command)
    assert done.exit_code == 0, done.output
    f = np.loadtxt(plate.with_name("plate-frequencies") / "frequencies.csv", delimiter=",", skiprows=1)[:, 1]
    # Euler and Bernoulli's cantilever, a little below the plate whose clamped end cannot contract
    first = 1.8751**2 * np.sqrt(70e9 * 0.005**2 / 12 / 2700) / 0.1**2 / (2 * np.pi)
    assert_allclose(f[0], first, rtol=0.03)


def test_the_mesh_of_a_part_without_sizes_is_made_finer(tmp_path: Path) -> None:
    written(tmp_path, "block", lambda occ: occ.addBox(0, 0, 0, 40, 20, 10), ("step",))
    command = ["frequencies", str(tmp_path / "block.step"), "--modes", "1", "--element", "hex8"]

    def first(*options: str) -> float:
        done = CliRunner().invoke(app, [*command, "--hold", "{ plane = 'x', near = [0, 0.01, 0] }", *options])
        assert done.exit_code == 0, done.output
        assert ("meshes must be fine enough for 1 %" in done.output) == bool(options)
        table = np.loadtxt(tmp_path / "block-frequencies" / "frequencies.csv", delimiter=",", skiprows=1, ndmin=2)
        return float(table[0, 1])

    exact = 5080.3  # hex27, 6 elements across
    assert_allclose(first(), exact, rtol=0.01)
    assert first("--across", "2") > 1.05 * exact


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["--free"], "--free: must be left out for a single link or part"),
        (["--size", "3 mm"], "--size: must be left out for a mesh file"),
        (["--link", "arm"], "--link: must be combined with a scene"),
        (["--material", "stel"], "--material: must be one of .*steel"),
        (["--material", "{ density = -1, youngs_modulus = 1e9, poisson_ratio = 0.3 }"], "--material.density: must be"),
        (["--material", "{ density"], "--material: must be a name or a table"),
        (["--hold", "{ cylinder = '8 mm' }"], "--hold: must be a face"),
        (["--hold", "end"], "--hold: must be a face by what it is, got 'end'"),
        (["--element", "quad9"], "element: must be one of hex.*, got 'quad9'"),
        (["--modes", "0"], "--modes: must be at least 1, got 0"),
    ],
)
def test_options_without_a_meaning_are_refused(options: list[str], said: str, plate: Path) -> None:
    done = CliRunner().invoke(app, ["frequencies", str(plate), *options])
    with pytest.raises(KedfemError, match=said):
        raise done.exception or AssertionError(done.output)


@pytest.mark.parametrize(
    ("change", "link", "joints", "said"),
    [
        ({}, "rod", [], "--link: must be arm, got 'rod'"),
        ({}, "arm", ["B"], "--hold: must be A, got 'B'"),
        ({"model": "rigid"}, "arm", [], "--link: must be an elastic link"),
    ],
)
def test_links_and_joints_that_cannot_be_are_refused(
    change: dict[str, Any], link: str, joints: list[str], said: str, tmp_path: Path
) -> None:
    raw = arm("solid")
    raw["links"]["arm"] |= change
    with pytest.raises(KedfemError, match=said):
        link_of_scene(scene_from(raw, tmp_path), link, joints)
