"""A run on a disk that is full before it ends: a real one of few kilobytes, in a name space of its own."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from kedfem.results import read_results

EXAMPLE = Path(__file__).parents[2] / "examples" / "four_bar_beams" / "scene.toml"
SMALL_DISK = ["unshare", "--user", "--map-root-user", "--mount", "bash", "-c"]
RUN = """
mount -t tmpfs -o size=$1 none "$2" && cp "$3" "$2/scene.toml" && cd "$2" || exit 77
"$4" -m kedfem run --quick scene.toml
echo "exit $?"
cp -r scene-results "$5"
"""


def allowed(folder: Path) -> bool:
    """Whether this user may have a small disk of their own."""
    if shutil.which("unshare") is None:
        return False
    tried = subprocess.run([*SMALL_DISK, 'mount -t tmpfs none "$1"', "-", folder], capture_output=True, check=False)
    return tried.returncode == 0


@pytest.mark.long
@pytest.mark.parametrize(("size", "begun"), [("200k", False), ("1500k", True), ("3m", True)])
def test_a_full_disk_ends_a_run_in_words_and_its_rows_are_kept(tmp_path: Path, size: str, begun: bool) -> None:
    disk, kept = tmp_path / "disk", tmp_path / "kept"
    disk.mkdir()
    if not allowed(disk):
        pytest.skip("needs a name space with a disk of its own (unshare)")
    command = [*SMALL_DISK, RUN, "-", size, disk, EXAMPLE, sys.executable, kept]
    done = subprocess.run(command, capture_output=True, text=True, check=False, env={**os.environ, "COLUMNS": "200"})
    said = done.stdout + done.stderr
    assert "exit 2" in said, said
    assert "must be a file that can be written, got No space left on device" in said
    assert "Traceback" not in said
    assert not list(kept.glob("*.part*"))
    if begun:  # how many rows were written before depends on how fast the machine is
        results = read_results(kept / "results.h5")
        assert results.status == "interrupted"
        assert "No space left" in results.reason
        assert len(results.time) >= 1
        assert all(np.isfinite(values).all() for _, values in results.channels.values())
    else:
        assert not kept.exists()  # refused before anything was kept
