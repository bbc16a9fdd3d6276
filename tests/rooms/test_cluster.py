"""`kedfem sweep --cluster`: points on the workers of a Dask scheduler."""

import threading
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import pytest
from distributed import LocalCluster

from kedfem.errors import OutputError
from kedfem.sweep import BaseScene, axes_of, cluster, sweep
from kedfem.sweep.points import Row
from tests.rooms.test_cli import Command, run_kedfem
from tests.rooms.test_sweep import QUICK, arm, swept

__all__ = ["run_kedfem"]  # a fixture

pytestmark = [pytest.mark.long, pytest.mark.filterwarnings("ignore::ResourceWarning")]
OVER = "drive.speed=100rpm:300rpm:4"


@pytest.fixture(scope="module")
def address() -> Iterator[str]:
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=":0") as there:
        yield there.scheduler_address


def loops() -> set[threading.Thread]:
    """Threads of clients and clusters."""
    return {each for each in threading.enumerate() if each.name == "IO loop"}


def left(row: Row) -> str:
    """What a row says but for how long it took."""
    return replace(row, seconds=0.0).text()


def test_workers_of_a_cluster_find_the_same_rows_and_go_on_with_those_of_a_pool(address: str, tmp_path: Path) -> None:
    (tmp_path / "one").mkdir()
    wanted, _ = swept(tmp_path / "one", OVER)
    raw = arm()

    def run(over: str) -> list[object]:
        executor = cluster.cluster(address, tmp_path)
        done = sweep(BaseScene(raw, tmp_path, "arm"), axes_of([over], raw), QUICK, tmp_path / "out", executor=executor)
        assert [row.status for row in done.rows] == ["complete"] * len(done.rows)
        return [done.before, *map(left, done.rows)]

    every = list(map(left, wanted.rows))
    assert run("drive.speed=100rpm,300rpm") == [0, every[0], every[3]]
    assert run(OVER) == [2, *every]


def test_what_cannot_run_points_is_refused(address: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(OutputError, match=r"--cluster: its workers must see the scene's folder .*nowhere, got one that"):
        cluster.cluster(address, tmp_path / "nowhere")
    monkeypatch.setattr(cluster, "installed_version", lambda: "9.9")
    with pytest.raises(OutputError, match=r"--cluster: its workers must have kedfem 9\.9, got "):
        cluster.cluster(address, tmp_path)
    monkeypatch.setattr(cluster, "PATIENCE", 1)
    before = loops()
    for wrong in ("tcp://127.0.0.1:1", "nonsense://x"):
        with pytest.raises(OutputError, match=r"--cluster: must be the address of a Dask scheduler, .* got " + wrong):
            cluster.cluster(wrong, tmp_path)
    assert loops() == before
    with (
        LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=":0") as two,
        pytest.raises(OutputError, match=r"--cluster: its workers must have one thread each, got 2 of "),
    ):
        cluster.cluster(two.scheduler_address, tmp_path)


def test_workers_are_those_of_one_or_the_other(run_kedfem: Command, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text('title = "x"\n[drive]\nmotion = { kind = "constant_speed", speed = 1 }\n')
    both = "--cluster", "tcp://127.0.0.1:1", "--workers", "2"
    said = run_kedfem("sweep", "scene.toml", "--over", "drive.speed=1,2", *both)
    assert said.code == 2
    assert "--workers: cannot be combined with --cluster" in said.err
