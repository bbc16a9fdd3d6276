"""The pages of docs/: each is found from the start page; what lessons and how-to pages have typed does what they show."""

import asyncio
import contextlib
import io
import re
import shutil
import tomllib
from pathlib import Path

import pytest
from docs.site.pages import write_pages
from typer.testing import CliRunner

from kedfem.cli import app
from kedfem.cli.screen import err, out
from kedfem.scene import scene_from

ROOT = Path(__file__).parents[1]
DOCS = ROOT / "docs"
BLOCK = re.compile(r"^```(toml|text|console|python)\n(.*?)^```$", re.DOTALL | re.MULTILINE)
NUMBER = re.compile(r"-?\d+(\.\d+)?(e[-+]\d+)?")
NEAR = 0.02  # of a number that a page shows: other processors round other trials


def linked(page: Path) -> set[Path]:
    """Pages of the lists `{toctree}` of a page."""
    text = page.read_text("utf-8") if page.suffix == ".md" else ""
    out: set[Path] = set()
    for options in re.findall(r"^```\{toctree\}\n(.*?)^```$", text, re.DOTALL | re.MULTILINE):
        for line in options.splitlines():
            name = re.sub(r".*<(.*)>", r"\1", line)  # a title may stand before it
            if name and not name.startswith(":"):
                out |= {file.resolve() for ending in (".md", ".ipynb") for file in page.parent.glob(f"{name}{ending}")}
    return out


def test_every_page_is_in_a_list_of_contents() -> None:
    """A new page is a line in a `{toctree}`: how-to/index.md, reference/index.md, theory.md, about.md."""
    found, todo = set(), {DOCS / "index.md"}
    while todo:
        page = todo.pop()
        found.add(page)
        todo |= linked(page) - found
    generated = {DOCS / "reference" / "messages.md", DOCS / "reference" / "command-line.md", *DOCS.glob("gallery/*")}
    pages = {*DOCS.rglob("*.md"), *DOCS.rglob("*.ipynb")} - {DOCS / "README.md"} - generated
    assert sorted(page.relative_to(DOCS).as_posix() for page in pages - found) == []


def words(line: str) -> list[str]:
    """A line of output without the frames of tables."""
    return re.sub(r"[│┃]", " ", line).split()


def same(shown: str, said: str) -> bool:
    """Two words that are equal, or numbers with what stands around them that are near."""
    numbers = [[float(m[0]) for m in NUMBER.finditer(word)] for word in (shown, said)]
    bare = [NUMBER.sub("#", word) for word in (shown, said)]
    return bare[0] == bare[1] and numbers[0] == pytest.approx(numbers[1], rel=NEAR)


def shows(output: str, line: str) -> bool:
    """Whether some line of an output begins as a line of a page."""
    wanted = words(line)
    return any(len(got) >= len(wanted) and all(map(same, wanted, got)) for got in map(words, output.splitlines()))


def followed(page: str) -> int:
    """Lines of output that a page shows, after doing what it says: its files written, its commands and scripts run."""
    output, seen = "", 0
    for kind, text in BLOCK.findall((DOCS / page).read_text("utf-8")):
        name = re.match(r"# ([\w.]+)\n", text)
        if kind in {"toml", "text"} and name:
            Path(name[1]).write_text(text.removeprefix(name[0]) if kind == "text" else text, encoding="utf-8")
        elif kind == "console":
            for command in text.splitlines():
                done = CliRunner().invoke(app, command.removeprefix("kedfem ").split())
                assert done.exit_code == 0, done.output
                output = done.output
        elif kind == "python":
            with contextlib.redirect_stdout(io.StringIO()) as said:
                exec(compile(text, page, "exec"), {"__name__": "page"})
            output = said.getvalue()
        elif kind == "text":
            missing = [line for line in text.splitlines() if not shows(output, line)]
            assert missing == [], output
            seen += len(text.splitlines())
    return seen


@pytest.fixture
def wide(monkeypatch: pytest.MonkeyPatch) -> None:
    """Lines of 110 columns, as pages show them, also on consoles that another test has used."""
    for console in (out, err):
        monkeypatch.setattr(console, "width", 110)


def test_shown_lines_are_looked_for_in_the_output() -> None:
    output = "│ crank │ 6.867 MPa │ (0, 0) m │\n"
    assert shows(output, "│ crank │ 6.87 MPa │")
    assert not shows(output, "│ crank │ 7.2 MPa │")
    assert not shows(output, "│ rocker │ 6.867 MPa │")


@pytest.mark.long
@pytest.mark.usefixtures("wide")
@pytest.mark.parametrize(("page", "lines"), [("tutorial/first-linkage.md", 11), ("tutorial/own-part.md", 8)], ids=str)
def test_a_lesson_does_what_it_says(page: str, lines: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copyfile(ROOT / "geometry" / "connecting_rod.step", "rod.step")
    assert followed(page) == lines


@pytest.mark.usefixtures("wide")
@pytest.mark.parametrize(
    ("page", "lines"),
    [
        ("how-to/drive-from-file.md", 0),
        ("how-to/parameter-study.md", 3),
        pytest.param("how-to/suspension.md", 6, marks=pytest.mark.long),
    ],
    ids=str,
)
def test_a_how_to_does_what_it_says(page: str, lines: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    assert followed(page) == lines
    for file in tmp_path.glob("*.toml"):
        scene_from(tomllib.loads(file.read_text("utf-8")), tmp_path)


@pytest.mark.long
def test_the_notebook_runs_and_shows_its_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    import nbformat
    from nbclient import NotebookClient

    monkeypatch.delenv("MPLBACKEND", raising=False)  # notebooks have one of their own
    book = nbformat.read(DOCS / "how-to" / "notebook.ipynb", 4)
    assert all(not cell.get("outputs") for cell in book.cells), "commit it without outputs"
    asyncio.run(  # closes its loop, unlike `execute`
        NotebookClient(book, timeout=600, kernel_name="python3").async_execute()
    )
    shown = [output for cell in book.cells for output in cell.get("outputs", [])]
    kinds = [kind for output in shown for kind in output.get("data", {})]
    assert "image/png" in kinds
    assert any(re.match(r"done after \d+\.\d s", output.get("data", {}).get("text/html", "")) for output in shown)
    (table,) = (
        output.data["text/plain"]
        for output in shown
        if "stress in the rod" in output.get("data", {}).get("text/plain", "")
    )
    stresses = [float(row.split()[1]) for row in table.splitlines()[2:]]
    assert len(stresses) == 5
    assert sorted(stresses) == stresses  # longer rods bend more under their own inertia


def test_generated_pages_are_made(tmp_path: Path) -> None:
    """Gallery, command line and messages, as the build of the site makes them; it has them checked by Sphinx."""
    write_pages(tmp_path, tmp_path / "site")
    commands = (tmp_path / "reference" / "command-line.md").read_text("utf-8")
    assert {"## `kedfem run`", "## `kedfem sweep`"} <= set(commands.splitlines())
    messages = (tmp_path / "reference" / "messages.md").read_text("utf-8")
    assert "links.crank.materal: unknown key, did you mean 'material'?" in messages.splitlines()
    assert messages.count("```{code-block} none") == messages.count("\n```\n") > 10
    names = {path.parent.name for path in (ROOT / "examples").glob("*/scene.toml")}
    assert {page.stem for page in (tmp_path / "gallery").glob("*.md")} == names | {"index"}
    for name in names:
        page = (tmp_path / "gallery" / f"{name}.md").read_text("utf-8")
        assert f"    kedfem run examples/{name}/scene.toml\n" in page
        assert f"../pictures/{name}.png" in page
