"""``python -m tests.verification`` writes docs/verification.md, from the root of the repository."""

from pathlib import Path

from .cases import all_cases
from .table import page

if __name__ == "__main__":
    Path("docs/verification.md").write_text(page(all_cases()), encoding="utf-8")
