"""The gallery: a page an example, with picture, command, seconds, scene, script, and the report where a run has left one."""

import re
import shutil
import tomllib
from collections.abc import Callable
from pathlib import Path

from docs.site.run_examples import ROOT, kept, names

Writer = Callable[[Path, str], None]


def heading(name: str) -> tuple[str, str, list[str]]:
    """Title of an example's scene, what the comment above it says, and the commands in that comment."""
    text = (ROOT / "examples" / name / "scene.toml").read_text("utf-8")
    comment = [line.removeprefix("#") for line in text.split("\n\n", 1)[0].splitlines() if line.startswith("#")]
    commands = [part.strip() for line in comment if line.startswith("   ") for part in re.split(r"   +(?=\w)", line.strip())
                if part.strip().startswith("kedfem ")]  # fmt: skip
    said = " ".join(line.strip() for line in comment if not line.startswith("   "))
    return tomllib.loads(text)["title"], said, commands


def picture(name: str) -> str | None:
    """A picture of docs/pictures, by its place seen from the gallery."""
    return f"../pictures/{name}.png" if (ROOT / "docs" / "pictures" / f"{name}.png").exists() else None


def report(name: str, site: Path) -> str:
    """The report in a frame, if a run has left one: it is copied into the site."""
    made = ROOT / "examples" / name / "scene-results" / "report.html"
    if not made.exists():
        return (
            f"\nIts [report](../report.md): `kedfem report examples/{name}/scene.toml`; on this page after "
            f"`python -m docs.site.run_examples {name}`.\n"
        )
    place = site / "reports" / f"{name}.html"
    place.parent.mkdir(parents=True, exist_ok=True)
    shutil.copyfile(made, place)
    source = f"../reports/{name}.html"
    return (
        f'\n## Report\n\n<p><a href="{source}">The report on a page of its own.</a></p>\n\n'
        f'<iframe class="report" src="{source}" loading="lazy" title="Report of the run"></iframe>\n'
    )


def cost(name: str) -> str:
    """What a run took, as it was measured."""
    measured = kept().get(name)
    if measured is None:
        return ""
    return (
        f"A first run takes {measured['run']:.0f} s of processor time with its trials, on one core; "
        f"its report {measured['report']:.0f} s more.\n\n"
    )


def page(name: str, site: Path) -> str:
    """One example."""
    title, comment, commands = heading(name)
    shown = picture(name)
    return "".join(
        (
            f"# {title}\n\n{comment}\n\n",
            "".join(f"    {command}\n" for command in commands) + "\n",
            cost(name),
            f"![{title}]({shown})\n" if shown else "",
            report(name, site),
            f"\n## Scene\n\n```{{literalinclude}} ../../examples/{name}/scene.toml\n:language: toml\n```\n",
            "\n## What holds\n\nThe script beside the scene runs it and asserts this; it is one of the tests.\n",
            f"\n```{{literalinclude}} ../../examples/{name}/run.py\n:language: python\n```\n",
        )
    )


def index(titles: dict[str, str]) -> str:
    """The page with all pictures."""
    cards = "".join(
        f"[![{title}]({picture(name)})\\\n{title}]({name}.md)\n\n" if picture(name) else f"[{title}]({name}.md)\n\n"
        for name, title in titles.items()
    )
    return (
        "# Gallery\n\nEvery folder of `examples/` is a scene that runs as it is. Find the one nearest to your machine and change it.\n\n"
        f":::{{container}} pictures\n{cards}:::\n\n"
        "Seconds and reports were made by `python -m docs.site.run_examples`.\n\n"
        "```{toctree}\n:hidden:\n\n" + "\n".join(titles) + "\n```\n"
    )


def write_gallery(source: Path, site: Path, write: Writer) -> None:
    """All pages of the gallery, into the folder `gallery` of the sources."""
    titles = {name: heading(name)[0] for name in names()}
    for name in titles:
        write(source / "gallery" / f"{name}.md", page(name, site))
    write(source / "gallery" / "index.md", index(titles))
    for stale in (source / "gallery").glob("*.md"):
        if stale.stem not in {*titles, "index"}:
            stale.unlink()
