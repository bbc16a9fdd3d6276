"""A link's matrices for other programs: rigid motions, mass, compliance and frequencies; read back alike."""

from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from scipy.linalg import eigh

from kedfem.errors import OutputError, SceneError
from kedfem.export import ExportedLink, exported_link, read_link, write_link
from kedfem.frequencies import link_of_scene, part_frequencies
from tests.bars import AXES, CASES, FLAT, HEIGHT, KINDS, NU, RHO, START, WIDTH, E, L, bar_scene


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> dict[tuple[str, str], ExportedLink]:
    folder = tmp_path_factory.mktemp("exported")
    return {case: exported_link(bar_scene(*case, folder), "arm") for case in CASES}


@pytest.mark.parametrize(("kind", "axis"), CASES)
def test_rigid_motions_are_what_they_are_called(kind: str, axis: str, found: dict[tuple[str, str], ExportedLink]) -> None:
    """No strain; ports move by e and ω × x and rotate by ω; the mass they carry is that of the bar, its inertia too."""
    link = found[kind, axis]
    flat = kind in FLAT
    moves = [0, 1] if flat else [0, 1, 2]
    turns = [2] if flat else [0, 1, 2]
    assert np.abs(link.stiffness @ link.rigid).max() < 1e-9 * np.abs(link.stiffness).max()
    for p, at in enumerate(link.places):
        T, Theta = link.translation[p] @ link.rigid, link.rotation[p] @ link.rigid
        assert_allclose(T[:, : len(moves)], np.eye(3)[:, moves], atol=1e-9)
        assert_allclose(T[:, len(moves) :], np.array([np.cross(np.eye(3)[k], at) for k in turns]).T, atol=1e-9)
        assert link.turns[p].tolist() == [not flat, not flat, True]
        assert_allclose(Theta[:, : len(moves)], 0, atol=1e-7)
        assert_allclose(Theta[:, len(moves) :], np.eye(3)[:, turns], atol=1e-7)
    M = link.rigid.T @ link.mass @ link.rigid
    m, e = RHO * L * WIDTH * HEIGHT, np.array(AXES[axis], float) / np.linalg.norm(AXES[axis])
    assert_allclose(M[: len(moves), : len(moves)], m * np.eye(len(moves)), rtol=1e-9, atol=1e-9 * m)
    centre = (START * [1, 1, 0] if flat else START) + 0.5 * L * e
    if flat:
        own = m / 12 * (L**2 + WIDTH**2) + m * centre @ centre
        assert M[2, 2] == pytest.approx(own, rel=1e-8)
    else:
        own = m / 12 * (WIDTH**2 + HEIGHT**2) + m * (centre @ centre - (centre @ e) ** 2)
        assert e @ M[3:, 3:] @ e == pytest.approx(own, rel=1e-8)


@pytest.mark.parametrize(("kind", "axis"), CASES)
def test_the_compliance_between_ports_is_a_cantilevers(
    kind: str, axis: str, found: dict[tuple[str, str], ExportedLink]
) -> None:
    """F L³/3EI + F L/κGA across, F L/EA along, from port A to port B; 1 % for the elements and how ends are held."""
    link = found[kind, axis]
    e = np.array(AXES[axis], float) / np.linalg.norm(AXES[axis])
    k = len(link.mass)
    rows = [*link.translation[0], *link.rotation[0][link.turns[0]]]
    C = np.array([row for row in rows if np.abs(row).max() > 0])
    saddle = np.block([[link.stiffness, C.T], [C, np.zeros((len(C), len(C)))]])
    scale = np.abs(link.stiffness).max()
    saddle[k:, :k] *= scale
    saddle[:k, k:] *= scale
    F = link.translation[1].T
    q = np.linalg.solve(saddle, np.concatenate([F, np.zeros((len(C), 3))]))[:k]
    compliance = link.translation[1] @ q
    along = e @ compliance @ e
    assert along == pytest.approx(L / (E * WIDTH * HEIGHT), rel=0.02)
    lateral = np.trace(compliance) - along
    G, kappa = E / 2 / (1 + NU), 5 / 6

    def bend(h: float, b: float) -> float:
        return L**3 / (3 * E * b * h**3 / 12) + L / (kappa * G * b * h)

    wanted = bend(WIDTH, HEIGHT) + (0.0 if kind in FLAT else bend(HEIGHT, WIDTH))
    assert lateral == pytest.approx(wanted, rel=0.01)


@pytest.mark.parametrize("kind", ["solid", "reduced", "beam"])
def test_free_frequencies_are_those_of_the_link(
    kind: str, tmp_path: Path, found: dict[tuple[str, str], ExportedLink]
) -> None:
    """In full to rounding; reduced ones from above: modes are chosen for what the scene does."""
    link = found[kind, "x"]
    scene = bar_scene(kind, "x", tmp_path)
    full = part_frequencies(link_of_scene(scene, "arm"), 8, tmp_path / "f")
    own = np.sqrt(np.abs(eigh(link.stiffness, link.mass, eigvals_only=True))) / (2 * np.pi)
    elastic = own[link.rigid.shape[1] :]
    wanted = full.values[full.values > 1.0][:2]
    if kind == "reduced":
        assert (elastic[:2] > wanted * (1 - 1e-9)).all()
        assert elastic[0] == pytest.approx(wanted[0], rel=0.01)
    else:
        assert_allclose(elastic[:2], wanted, rtol=1e-6)


@pytest.mark.parametrize("ending", [".npz", ".mat"])
@pytest.mark.parametrize("kind", KINDS)
def test_files_are_read_back_alike(
    kind: str, ending: str, tmp_path: Path, found: dict[tuple[str, str], ExportedLink]
) -> None:
    link, path = found[kind, "x"], tmp_path / f"arm{ending}"
    write_link(link, path)
    again = read_link(path)
    for name in ExportedLink.__slots__:
        one, other = getattr(link, name), getattr(again, name)
        assert np.shape(one) == np.shape(other)
        assert np.array_equal(one, other), name
    assert again.damping[1] > 0


def test_nodes_move_by_modes(found: dict[tuple[str, str], ExportedLink]) -> None:
    """A translation of a reduced link moves every node alike, a turn by ω × x."""
    link = found["reduced", "oblique"]
    for column, wanted in ((1, np.tile([0.0, 1, 0], (len(link.nodes), 1))), (5, np.cross([0, 0, 1], link.nodes))):
        q = link.rigid[:, column].reshape(-1, 3)
        assert_allclose(link.modes @ q, wanted, atol=1e-9)
    assert link.cells.max() == len(link.nodes) - 1


def test_what_cannot_be_exported(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    scene = bar_scene("solid", "x", tmp_path)
    with pytest.raises(SceneError, match="--link: must be one of arm, tip, got 'leg'"):
        exported_link(scene, "leg")
    with pytest.raises(SceneError, match="must be an elastic link, got a rigid one"):
        exported_link(scene, "tip")
    bent = scene.model_copy(update={"analysis": scene.analysis.model_copy(update={"frames": "co-rotational"})})
    with pytest.raises(SceneError, match=r"analysis\.frames: must be rigid-body"):
        exported_link(bent, "arm")
    monkeypatch.setattr("kedfem.export.link.MOST", 100)
    with pytest.raises(SceneError, match=r"links.arm: must have 100 unknowns at most, .* take `reduction = \"modal\"`"):
        exported_link(scene, "arm")
    with pytest.raises(OutputError, match=r"must end in .npz or .mat, got '.txt'"):
        write_link(None, tmp_path / "arm.txt")  # type: ignore[arg-type]
    for name, content in (("a.npz", b"PK"), ("b.mat", b"MATLAB"), ("c.npz", None)):
        path = tmp_path / name
        if content:
            path.write_bytes(content)
        with pytest.raises(OutputError, match="must be a link that kedfem wrote"):
            read_link(path)
    np.savez(tmp_path / "d.npz", format="another")
    with pytest.raises(OutputError, match="got another file"):
        read_link(tmp_path / "d.npz")
