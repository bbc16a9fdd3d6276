"""``python -m docs.site.run_examples [NAME ...]`` runs the examples for the gallery: results, report, seconds, pictures.

What a run leaves stays beside the example, as with ``kedfem run``; the next build of the site takes pictures and
reports from there. Seconds go to docs/gallery.toml, pictures to docs/pictures; both are committed.
"""

import os
import resource
import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

ROOT = Path(__file__).parents[2]
SECONDS = ROOT / "docs" / "gallery.toml"
HEAD = "# Processor seconds of `kedfem run` and `kedfem report`: written by `python -m docs.site.run_examples`.\n"


def names() -> list[str]:
    """The examples, each a folder with a scene."""
    return sorted(path.parent.name for path in (ROOT / "examples").glob("*/scene.toml"))


def seconds(*command: str, cache: str) -> float:
    """Processor seconds of one command of kedfem, with one thread and the code of the steps compiled beforehand."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    environment = os.environ | {"OMP_NUM_THREADS": "1", "KEDFEM_CACHE": cache}
    subprocess.run([sys.executable, "-m", "kedfem", *command], cwd=ROOT, env=environment, check=True)
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime


def kept() -> dict[str, dict[str, float]]:
    """Seconds of former runs, by example."""
    return tomllib.loads(SECONDS.read_text("utf-8")) if SECONDS.exists() else {}


def keep(measured: dict[str, dict[str, float]]) -> None:
    """Write the seconds of all examples that are still there."""
    lines = [f"{name} = {{ run = {measured[name]['run']:.1f}, report = {measured[name]['report']:.1f} }}\n"
             for name in names() if name in measured]  # fmt: skip
    SECONDS.write_text(HEAD + "".join(lines), "utf-8")


def picture(name: str) -> None:
    """The run's picture of the highest stress, in place of an older one in docs/pictures."""
    from PIL import Image

    made = ROOT / "examples" / name / "scene-results" / "worst.png"
    place = ROOT / "docs" / "pictures" / f"{name}.png"
    if made.exists():
        shown = Image.open(made).convert("RGB")
        shown.thumbnail((1200, 900))
        shown.quantize(256).save(place, optimize=True)


def main(chosen: list[str]) -> None:
    """Run the examples that are named, or all."""
    with tempfile.TemporaryDirectory() as cache:
        seconds("compile", cache=cache)
        for name in chosen or names():
            scene = f"examples/{name}/scene.toml"
            run = seconds("run", scene, cache=cache)
            report = seconds("report", f"examples/{name}/scene-results", cache=cache)
            keep(kept() | {name: {"run": run, "report": report}})
            picture(name)


if __name__ == "__main__":
    main(sys.argv[1:])
