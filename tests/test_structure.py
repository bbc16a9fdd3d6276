"""The package stays one that can be found one's way in: short files, and folders that are seen at a glance."""

import ast
import re
from collections import Counter
from graphlib import CycleError, TopologicalSorter
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


def test_no_imports_go_in_circles() -> None:
    """Those within functions count too; those for type checkers alone do not."""
    depends: dict[str, set[str]] = {}
    files = {module_of(path): path for path in PACKAGE.rglob("*.py")}
    for module, path in files.items():
        tree = ast.parse(path.read_text(encoding="utf-8"))
        typed = [
            node for node in ast.walk(tree) if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test)
        ]
        left_out = {id(node) for each in typed for node in ast.walk(each)}
        found = [node for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) and id(node) not in left_out]
        names = {
            full if (full := f"{node.module}.{alias.name}") in files else str(node.module)
            for node in found
            for alias in node.names
        }
        depends[module] = (names & files.keys()) - {module}
    try:
        order = list(TopologicalSorter(depends).static_order())
    except CycleError as circle:
        raise AssertionError(" → ".join(circle.args[1])) from None
    assert len(order) == len(files)


def module_of(path: Path) -> str:
    """Name by which a file of the package is imported."""
    return ".".join(path.relative_to(PACKAGE.parent).with_suffix("").parts).removesuffix(".__init__")


FOREIGN = {"_replace", "_fields", "_asdict", "_compiler", "_cache", "_cache_file", "_save_index", "_mesh", "_exit"}
"""Private by their spelling, of named tuples, numba, meshio and os; not kedfem's."""


def test_tests_use_no_private_name_of_the_package() -> None:
    """A folder may be rebuilt as long as its records and public functions stay."""
    used = []
    for file in sorted(Path(__file__).parent.rglob("*.py")):
        for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
            names: list[str] = []
            if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("kedfem"):
                names = [alias.name for alias in node.names]
            elif isinstance(node, ast.Attribute) and not (isinstance(node.value, ast.Name) and node.value.id == "self"):
                names = [node.attr]
            elif isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute) and node.func.attr == "setattr":
                texts = [x.value for x in node.args if isinstance(x, ast.Constant) and isinstance(x.value, str)]
                names = [texts[0].rpartition(".")[2]] if texts else []
            used += [f"{file.name}: {name}" for name in names if re.match("_[^_]", name) and name not in FOREIGN]
    assert used == []


def test_where_changes_begin_names_files_that_exist() -> None:
    """The table of CONTRIBUTING.md: paths from the root or within the package, or beside what its row named before."""
    root = Path(__file__).parents[1]
    rows = (root / "CONTRIBUTING.md").read_text(encoding="utf-8").split("\n| change | first file | then |\n")[1]
    missing = []
    for row in rows.splitlines()[1:]:
        named = [each for each in re.findall(r"`([\w./]+)`", row) if each.endswith((".py", "/"))]
        places = [root, PACKAGE]
        for each in named:
            found = next((place / each for place in places if (place / each).exists()), None)
            if found is None:
                missing.append(each)
            else:
                places.append(found if each.endswith("/") else found.parent)
        assert named, row
    assert missing == []
