"""`kedfem new --from`: an assembly becomes links, and joints are proposed where its round faces meet."""

import re
import tomllib
from collections.abc import Callable
from dataclasses import replace
from math import acos, atan2, cos, hypot, pi, radians, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from geometry.make import empty_model
from geometry.step_files import write_step

from kedfem.cli import USER_ERROR
from kedfem.mesh.cad.assembly import AssemblySolid, assembly_joints, assembly_solids
from kedfem.mesh.cad.solids import CadFace
from kedfem.scene import GROUND, read_scene
from kedfem.tables.draft import link_names, scene_text

from .cad_files import lever, written
from .test_cli import Command, run_kedfem  # noqa: F401

MM = 1e-3
CRANK, COUPLER, ROCKER, FRAME = 30.0, 90.0, 60.0, 100.0  # [mm]
A, D = (0.0, 0.0), (FRAME, 0.0)
B = (CRANK * cos(radians(60)), CRANK * sin(radians(60)))
_TO_D = hypot(FRAME - B[0], B[1])
_TURN = atan2(-B[1], FRAME - B[0]) + acos((COUPLER**2 + _TO_D**2 - ROCKER**2) / (2 * COUPLER * _TO_D))
C = (B[0] + COUPLER * cos(_TURN), B[1] + COUPLER * sin(_TURN))
NAMES = ("Ground plate", "crank #1", "coupler", 'rocker "R"')


def bar(occ: Any, P: tuple[float, float], Q: tuple[float, float], low: float, high: float) -> int:
    """A plate from before P to behind Q [mm]."""
    length = hypot(Q[0] - P[0], Q[1] - P[1])
    tag = int(occ.addBox(P[0] - 10, P[1] - 8, low, length + 20, 16, high - low))
    occ.rotate([(3, tag)], *P, 0, 0, 0, 1, atan2(Q[1] - P[1], Q[0] - P[0]))
    return tag


def pin(occ: Any, P: tuple[float, float], radius: float, low: float, high: float) -> int:
    return int(occ.addCylinder(*P, low, 0, 0, high - low, radius))


def four_bar(path: Path) -> Path:
    """A plate with two pins, a crank and a rocker on them with a pin each, and a coupler; 0.05 mm of play at A and D."""
    with empty_model() as occ:
        plate = bar(occ, A, D, -10, 0)
        occ.fuse([(3, plate)], [(3, pin(occ, P, 4, 0, 9)) for P in (A, D)])
        for P, Q in ((A, B), (B, C), (D, C)):
            low, high = (9, 15) if P is B else (1, 8)
            part = bar(occ, P, Q, low, high)
            bores = [(P, 3.0), (Q, 3.0)] if P is B else [(P, 4.05)]
            (solid,), _ = occ.cut([(3, part)], [(3, pin(occ, X, r, -20, 30)) for X, r in bores])
            if P is not B:
                occ.fuse([solid], [(3, pin(occ, Q, 3, 8, 16))])
        occ.synchronize()
        write_step(path, NAMES)
    return path


@pytest.fixture(scope="module")
def assembly(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return four_bar(tmp_path_factory.mktemp("cad") / "four bar.step")


def confirmed(text: str) -> str:
    """The proposals without their sign."""
    return re.sub(r"^#(?! )", "", text, flags=re.MULTILINE)


def test_an_assembly_becomes_a_scene_whose_joints_close(run_kedfem: Command, assembly: Path) -> None:  # noqa: F811
    said = run_kedfem("new", "--from", assembly, "bars.toml")
    assert (said.code, said.err.strip()) == (0, "")
    assert "bars.toml written; try: kedfem check bars.toml" in said.out
    text = Path("bars.toml").read_text(encoding="utf-8")
    drawn = read_scene("bars.toml")
    assert list(drawn.links) == ["crank_1", "coupler", "rocker_R"]
    assert not drawn.joints
    assert {link.material for link in drawn.links.values()} == {"steel"}
    assert [link.shape.solid for link in drawn.links.values()] == list(NAMES[1:])  # type: ignore[union-attr]
    assert "# Ground_plate may be the frame" in text
    assert "# bore of radius 4.05 mm of crank_1, pin of radius 4 mm of Ground_plate, together along 7 mm" in text

    whole = confirmed(text).replace("[analysis]", '[analysis]\naccuracy = "quick"')
    Path("bars.toml").write_text(whole, encoding="utf-8")
    scene = read_scene("bars.toml")
    found = {tuple(joint.links): joint.at for joint in scene.joints.values()}
    # by half of the heights over which bore and pin are drawn: 1 to 8 at the frame, 9 to 15 at the coupler
    wanted = {("crank_1", GROUND): (*A, 4.5), ("rocker_R", GROUND): (*D, 4.5),
              ("coupler", "crank_1"): (*B, 12), ("coupler", "rocker_R"): (*C, 12)}  # fmt: skip
    assert set(found) == set(wanted)
    for links, at in wanted.items():
        np.testing.assert_allclose(found[links], MM * np.array(at), atol=1e-9, err_msg=str(links))  # [m]
    assert next(iter(scene.joints.values())).links == ("crank_1", GROUND)  # driven: the shortest at the frame
    checked = run_kedfem("check", "bars.toml")
    assert checked.code == 0, checked.err
    assert "crank_1" in checked.out


def test_a_part_alone_in_another_unit_becomes_one_link(run_kedfem: Command, tmp_path: Path) -> None:  # noqa: F811
    (tmp_path / "cad").mkdir()
    written(tmp_path / "cad", "lever", lever, ("step",))
    assert run_kedfem("new", "--from", tmp_path / "cad" / "lever.step", "--scale", "0.0254").code == 0
    scene = read_scene("lever.toml")
    (link,) = scene.links.values()
    assert (link.shape.file, link.shape.scale) == ("cad/lever.step", 0.0254)  # type: ignore[union-attr]
    assert "joints are yours to write" in Path("lever.toml").read_text(encoding="utf-8")


def test_a_file_that_exists_stays(run_kedfem: Command, assembly: Path) -> None:  # noqa: F811
    Path("four bar.toml").write_text("precious")
    said = run_kedfem("new", "--from", assembly)
    wanted = "error: four bar.toml: must be a new file, got one that exists already\n"
    assert (said.code, said.err) == (USER_ERROR, wanted)
    assert Path("four bar.toml").read_text() == "precious"
    said = run_kedfem("new", "--from", assembly, "no/x.toml")
    wanted = "error: no/x.toml: must be in a folder that is there, got none at no\n"
    assert (said.code, said.err) == (USER_ERROR, wanted)


@pytest.mark.parametrize(("name", "text"), [("nothing.step", None), ("bad.step", "no CAD"), ("part.dwg", "x")])
def test_bad_files_are_refused_as_by_mesh(
    run_kedfem: Command,  # noqa: F811
    tmp_path: Path,
    name: str,
    text: str | None,
) -> None:
    if text is not None:
        Path(name).write_text(text)
    before = list(Path().iterdir())
    said = run_kedfem("new", "--from", tmp_path / name)
    assert said.code == USER_ERROR
    assert said.err == run_kedfem("mesh", tmp_path / name).err
    assert f"error: {name}: must " in said.err
    assert list(Path().iterdir()) == before


def test_options_that_do_not_go_together(run_kedfem: Command) -> None:  # noqa: F811
    said = run_kedfem("new", "--from", "a.step", "four-bar")
    assert said.err == "error: KIND: must be left out with --from, got 'four-bar'\n"
    assert run_kedfem("new").err.startswith("error: KIND: must be one of four-bar, ")
    assert run_kedfem("new", "four-bar", "--scale", "1").err.startswith("error: --scale: must be combined with --from")


def test_names_of_links_are_those_of_a_scene() -> None:
    given = ["Crank #1", "crank 1", "ground", "~~", "Bügel\n[links.x]", "x" * 300, "x" * 300]
    names = link_names(given)
    assert names == ["Crank_1", "crank_1_2", "ground_2", "part", "Bügel_links_x", "x" * 80, "x" * 80 + "_2"]
    solids = [AssemblySolid(name, 0.1, ()) for name in given]
    links = tomllib.loads(scene_text(solids, 'a"b.step', None))["links"]
    assert list(links) == names
    assert [link["shape"]["solid"] for link in links.values()] == given
    assert links["part"]["shape"]["file"] == 'a"b.step'


def cylinder(r: float, low: float, high: float, inward: bool, at: tuple[float, float] = (0.0, 0.0)) -> CadFace:
    middle = np.array([*at, (low + high) / 2])
    return CadFace(0, "", "cylinder", middle, np.eye(3)[2], r, inward, np.nan, high - low)


def ball(r: float, at: float, inward: bool) -> CadFace:
    return CadFace(0, "", "sphere", np.array([at, 0.0, 0.0]), np.full(3, np.nan), r, inward, np.nan, np.nan)


def found(*rounds: tuple[CadFace, ...]) -> list[Any]:
    return assembly_joints([AssemblySolid(f"s{i}", 0.1, each) for i, each in enumerate(rounds)])


def cushion(occ: Any) -> None:
    """A block with all edges and corners rounded, a bore, half a bore in its rim, and a ball on a neck."""
    block = occ.addBox(0, 0, 0, 60, 40, 20)
    occ.synchronize()
    edges = [tag for _, tag in occ.getEntities(1)]
    solid = occ.fillet([block], edges, [3.0])
    solid, _ = occ.cut(solid, [(3, pin(occ, P, 5, -1, 21)) for P in ((20, 20), (40, 0))])
    occ.fuse(solid, [(3, pin(occ, (45, 20), 3, 10, 30)), (3, occ.addSphere(45, 20, 32, 5))])


def test_blends_and_halves_of_bores_are_no_coupling_surfaces(tmp_path: Path) -> None:
    written(tmp_path, "cushion", cushion, ("step",))
    (solid,) = assembly_solids(tmp_path / "cushion.step", None)
    seen = sorted((each.kind, each.inward, round(each.radius / MM, 6)) for each in solid.round_faces)
    assert seen == [("cylinder", False, 3), ("cylinder", True, 5), ("sphere", False, 5)]
    (bore,) = (each for each in solid.round_faces if each.inward)
    np.testing.assert_allclose(bore.centre, [20 * MM, 20 * MM, 10 * MM], atol=1e-9)  # [m]
    assert bore.length == pytest.approx(20 * MM, rel=1e-6)


BORE = cylinder(5 * MM, 0, 20 * MM, True)


@pytest.mark.parametrize(("other", "met"), [
    (cylinder(4.6 * MM, -10 * MM, 10 * MM, False), True),  # loose
    (cylinder(5.01 * MM, -10 * MM, 10 * MM, False), True),  # pressed in
    (cylinder(4.4 * MM, -10 * MM, 10 * MM, False), False),  # too thin
    (cylinder(5.1 * MM, -10 * MM, 10 * MM, False), False),  # too thick
    (cylinder(5 * MM, -10 * MM, 0, False), False),  # ends at the rim
    (cylinder(5 * MM, -10 * MM, 10 * MM, False, (0.3 * MM, 0)), False),  # beside
    (replace(cylinder(5 * MM, -10 * MM, 10 * MM, False), direction=np.array([sin(0.01), 0, cos(0.01)])), False),
    (cylinder(5 * MM, 24 * MM, 30 * MM, True), True),  # the next bore of a pin not drawn
    (cylinder(5 * MM, 26 * MM, 30 * MM, True), False),  # too far from it
    (cylinder(4.9 * MM, 20 * MM, 30 * MM, True), False),  # of another pin
])  # fmt: skip
def test_bores_meet_what_fits_them(other: CadFace, met: bool) -> None:
    assert len(found((BORE,), (other,))) == len(found((other,), (BORE,))) == met


def test_balls_meet_their_seats() -> None:
    (one,) = found((ball(5 * MM, 0, False),), (ball(5.1 * MM, 0.05 * MM, True),))
    assert one.ball
    assert one.solids == (1, 0)
    assert not found((ball(5 * MM, 0, False),), (ball(5 * MM, 1 * MM, True),))
    assert not found((ball(5 * MM, 0, False),), (ball(5 * MM, 0, False),))


def test_a_fork_on_its_pin_is_one_joint_between_its_eyes() -> None:
    fork = (cylinder(5 * MM, 0, 4 * MM, True), cylinder(5 * MM, 16 * MM, 20 * MM, True))
    shaft = (cylinder(5 * MM, -5 * MM, 25 * MM, False),)
    (one,) = found(fork, shaft)
    np.testing.assert_allclose(one.at, [0, 0, 10 * MM], atol=1e-12)
    eye = (cylinder(5 * MM, 5 * MM, 15 * MM, True),)
    both = found(fork, shaft, eye)  # fork and eye are joined by the pin, not by each other
    assert sorted(each.solids for each in both) == [(0, 1), (2, 1)]
    (two_bores,) = found(fork, eye)
    assert two_bores.two_bores
    np.testing.assert_allclose(two_bores.at, [0, 0, 10 * MM], atol=1e-12)


def test_a_hollow_pin_is_named_by_its_face() -> None:
    hollow = (cylinder(5 * MM, -5 * MM, 25 * MM, False), cylinder(3 * MM, -5 * MM, 25 * MM, True))
    text = scene_text([AssemblySolid("rod", 0.1, (BORE,)), AssemblySolid("pin", 0.1, hollow)], "a.step", None)
    joint = tomllib.loads(confirmed(text))["joints"]["J1"]
    assert joint["links"] == ["rod", "pin"]
    assert joint["faces"] == {"pin": {"cylinder": "10 mm", "axis": [0, 0, 1], "near": [0, 0, 0.01]}}


def grounds(solids: list[AssemblySolid]) -> tuple[bool, list[list[str]]]:
    text = scene_text(solids, "a.step", None)
    scene = tomllib.loads(confirmed(text))
    return "may be the frame" in text, [joint["links"] for joint in scene["joints"].values()]


def test_a_frame_is_suggested_where_there_is_reason_to() -> None:
    """One of that name, else the largest in a closed loop: of an open chain none."""
    pins: Callable[[int], CadFace] = lambda i: cylinder(5 * MM, 0, 9 * MM, False, (i * pi * MM * 10, 0))  # noqa: E731
    holes: Callable[[int], CadFace] = lambda i: cylinder(5 * MM, 0, 9 * MM, True, (i * pi * MM * 10, 0))  # noqa: E731
    chain = [AssemblySolid("a", 0.1, (holes(1),)), AssemblySolid("b", 0.3, (pins(1), holes(2))),
             AssemblySolid("c", 0.2, (pins(2),))]  # fmt: skip
    assert grounds(chain) == (False, [["a", "b"], ["b", "c"]])
    assert grounds([replace(chain[0], name="machine bed"), *chain[1:]]) == (True, [["ground", "b"], ["b", "c"]])
    loop = [replace(chain[0], round_faces=(*chain[0].round_faces, holes(3))), chain[1],
            replace(chain[2], round_faces=(*chain[2].round_faces, pins(3)))]  # fmt: skip
    tail = AssemblySolid("tail", 0.9, (pins(4),))
    tailed = [replace(loop[0], round_faces=(*loop[0].round_faces, holes(4))), *loop[1:], tail]
    suggested, joints = grounds(tailed)
    assert suggested
    assert [links for links in joints if GROUND in links] == [["a", GROUND], [GROUND, "c"]]
