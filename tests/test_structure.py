"""The package stays one that can be found one's way in: short files, and folders that are seen at a glance."""

from collections import Counter
from pathlib import Path

import kedfem

PACKAGE = Path(kedfem.__file__).parent
LINES, FILES = 300, 25
"""Most lines of a file, and most files of a folder."""


def test_no_file_is_long() -> None:
    lines = {path: len(path.read_text(encoding="utf-8").splitlines()) for path in sorted(PACKAGE.rglob("*.py"))}
    assert len(lines) > 300
    assert {str(path.relative_to(PACKAGE)): count for path, count in lines.items() if count > LINES} == {}, (
        "split it by what its parts are about"
    )


def test_no_folder_has_many_files() -> None:
    count = Counter(str(path.parent.relative_to(PACKAGE)) for path in PACKAGE.rglob("*.py"))
    assert {folder: files for folder, files in count.items() if files > FILES} == {}, "group them in folders"
