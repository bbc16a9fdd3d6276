"""``python -m tests.hard_cases`` writes docs/hard-cases.md, from the root of the repository."""

from pathlib import Path

from .cases import all_cases
from .table import page

if __name__ == "__main__":
    Path("docs/hard-cases.md").write_text(page(all_cases()), encoding="utf-8")
