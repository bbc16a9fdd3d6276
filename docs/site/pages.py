"""Pages of the site that commands make: gallery, command line, messages, changes; written before Sphinx reads the sources."""

from collections.abc import Callable
from pathlib import Path

from docs.site.command_line import command_line
from docs.site.gallery import write_gallery
from docs.site.messages import messages

ROOT = Path(__file__).parents[2]
PAGES: dict[str, Callable[[], str]] = {"reference/command-line.md": command_line, "reference/messages.md": messages}


def changed_text(place: Path, text: str) -> None:
    """Write a page where it is another than before, so that Sphinx reads only what changed."""
    place.parent.mkdir(parents=True, exist_ok=True)
    if not place.exists() or place.read_text("utf-8") != text:
        place.write_text(text, "utf-8")


def write_pages(source: Path, site: Path) -> None:
    """Write all generated pages into the folder of the sources, and reports of examples into the site."""
    for name, text in PAGES.items():
        changed_text(source / name, text())
    write_gallery(source, site, changed_text)
