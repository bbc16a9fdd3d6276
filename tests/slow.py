"""``python -m tests.slow LOG``: which tests are left to `scripts/test --long`, from the durations of a run of all others.

    CI=1 scripts/test -m "not long or slow" --durations=0 --durations-min=0.5 > LOG

The slowest go into `tests/slow.txt`, so many that the others in LOG take MOST seconds; `conftest.py` marks them `slow`
and `long`. Tests of less than half a second took 380 s in all.
"""

import re
import sys
from pathlib import Path

MOST = 180.0  # seconds of all workers together: with shorter tests less than 5 minutes of two
LIST = Path(__file__).with_name("slow.txt")
ASIDE = Path(__file__).with_name("aside.txt")
"""Tests that the default run leaves out, and no other."""
STUDIES = Path(__file__).with_name("studies.txt")
"""Tests that .ci/run leaves out too: dear kinds of what cheaper kinds show as well."""
KEPT = "tests/laws/test_mechanisms.py::test_twenty_random_mechanisms_keep_all_laws"
"""Two hundred random mechanisms: by default, whatever they take."""
LINE = re.compile(r"(\d+\.\d+)s (?:call|setup|teardown) +(\S.*)")
HEAD = "# Tests that the default run leaves out; written by `python -m tests.slow`\n"


def listed(file: Path) -> frozenset[str]:
    """Names of the tests in a list."""
    return frozenset(file.read_text(encoding="utf-8").splitlines()[1:]) if file.exists() else frozenset()


def slowest(log: str, most: float = MOST) -> list[str]:
    """Names of the slowest tests in the durations that pytest wrote, without which the rest takes at most so much."""
    seconds: dict[str, float] = {}
    for taken, name in LINE.findall(log):
        seconds[name] = seconds.get(name, 0.0) + float(taken)
    left, out = sum(seconds.values()), []
    for name, taken in sorted(seconds.items(), key=lambda item: -item[1]):
        if left <= most:
            break
        if name.startswith(KEPT):
            continue
        left -= taken
        out.append(name)
    return sorted(out)


if __name__ == "__main__":
    LIST.write_text(HEAD + "\n".join(slowest(Path(sys.argv[1]).read_text(encoding="utf-8"))) + "\n", encoding="utf-8")
