"""Equations of [KED]: docs/theory.md and the docstrings agree; docs/notation.md names what is there."""

import ast
import re
from collections.abc import Iterator
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGE = ROOT / "src" / "kedfem"
DOCS = ROOT / "docs"
SOURCE = {2, 3, 4, 5, 6, 9, *range(11, 23)}  # the numbers of [KED] that docs/theory.md states
CITATION = re.compile(r"\[KED, eqs?\. ([^\]]*)\]")
OTHER = {"[KED]", "[KED, App. A]"}  # cite no equation
NUMBERS = re.compile(r"\(\d+[a-z]?\)(?:(?:, ?|[-–])?\(\d+[a-z]?\))*")

Named = tuple[str, ast.FunctionDef | ast.ClassDef]


@cache
def modules() -> dict[str, ast.Module]:
    """Syntax tree of every module, by its name within the package."""
    return {
        ".".join(file.relative_to(PACKAGE).with_suffix("").parts): ast.parse(file.read_text("utf-8"))
        for file in sorted(PACKAGE.rglob("*.py"))
    }


def defined(tree: ast.AST, prefix: str) -> Iterator[Named]:
    """Functions and classes, methods and inner functions included, under their full names."""
    for node in ast.iter_child_nodes(tree):
        if isinstance(node, ast.FunctionDef | ast.ClassDef):
            name = f"{prefix}.{node.name}"
            yield name, node
            yield from defined(node, name)
        else:
            yield from defined(node, prefix)


@cache
def docstrings() -> tuple[tuple[str, str], ...]:
    """Name and docstring of every function and class; modules are left out."""
    named = (pair for module, tree in modules().items() for pair in defined(tree, module))
    return tuple((name, ast.get_docstring(node) or "") for name, node in named)


def numbers(text: str) -> set[int]:
    """Equations of `(17)`, `(9)(11)`, `(9), (11)`, `(14)-(20)`, `(4a)(4b)`; letters do not count."""
    if not NUMBERS.fullmatch(text):
        raise ValueError(f"not a list of equations: {text!r}")
    found = [(int(m[1]), m.end()) for m in re.finditer(r"\((\d+)[a-z]?\)", text)]
    out = {number for number, _ in found}
    for (first, end), (last, _) in pairwise(found):
        if text[end] in "-–":
            out |= set(range(first, last + 1))
    return out


def cited() -> set[tuple[int, str]]:
    """Equation and function, from the docstrings."""
    return {
        (number, name) for name, text in docstrings() for where in CITATION.findall(text) for number in numbers(where)
    }


def table(file: str, heading: str) -> list[list[str]]:
    """Rows of all tables of a page from a heading on, up to the table of words."""
    text = (DOCS / file).read_text("utf-8").split(f"{heading}\n", 1)[1].split("\n## Words\n", 1)[0]
    rows = [line.strip().strip("|").split("|") for line in text.splitlines() if line.startswith("|")]
    body = [[cell.strip() for cell in row] for row in rows]
    return [row for row in body if not set(row[0]) <= set("-:") and row[0] not in {"equation", "symbol"}]


def listed() -> set[tuple[int, str]]:
    """Equation and function, from docs/theory.md."""
    return {
        (number, name)
        for where, functions in table("theory.md", "## Equations and functions")
        for number in numbers(where)
        for name in re.findall(r"`([^`]+)`", functions)
    }


def test_every_equation_of_a_docstring_is_in_the_table_with_its_function() -> None:
    assert sorted(cited() - listed()) == []


def test_every_function_of_the_table_exists_and_its_docstring_carries_the_number() -> None:
    there = {name for name, _ in docstrings()}
    assert sorted({name for _, name in listed()} - there) == []
    assert sorted(listed() - cited()) == []


def test_every_equation_of_the_source_has_a_function() -> None:
    assert {number for number, _ in listed()} == SOURCE


def test_every_equation_of_the_source_is_stated() -> None:
    text = (DOCS / "theory.md").read_text("utf-8").split("## The equation\n", 1)[1].split("\n## ", 1)[0]
    first = [line.split("|")[1].strip() for line in text.splitlines() if line.startswith("| (")]
    assert set().union(*(numbers(where) for where in first)) == SOURCE


def test_every_mention_of_the_source_is_a_citation_that_can_be_read() -> None:
    """`[KED, eq 17]` or `[KED (17)]` would otherwise go unnoticed; modules count here."""
    wrong = []
    for file in sorted(PACKAGE.rglob("*.py")):
        for mention in re.findall(r"\[KED[^\]]*\]", file.read_text("utf-8")):
            citation = CITATION.fullmatch(mention)
            known = numbers(citation[1]) <= SOURCE if citation else mention in OTHER
            wrong += [] if known else [(file.name, mention)]
    assert wrong == []


@pytest.mark.parametrize(
    ("text", "wanted"),
    [("(17)", {17}), ("(9)(11)", {9, 11}), ("(9), (11)", {9, 11}), ("(17)–(19)", {17, 18, 19}),
     ("(14)-(16), (20)", {14, 15, 16, 20}), ("(4a)(4b)", {4})],
)  # fmt: skip
def test_lists_of_equations_are_read_in_all_their_forms(text: str, wanted: set[int]) -> None:
    assert numbers(text) == wanted


@pytest.mark.parametrize("text", ["17", "(9) and (11)", "", "(9)(11"])
def test_other_lists_of_equations_are_refused(text: str) -> None:
    with pytest.raises(ValueError, match="not a list of equations"):
        numbers(text)


def members(node: ast.ClassDef) -> set[str]:
    """Fields, methods and attributes of `self` of a class; of a named tuple the names that it lists."""
    fields = {x.target.id for x in node.body if isinstance(x, ast.AnnAssign) and isinstance(x.target, ast.Name)}
    methods = {x.name for x in node.body if isinstance(x, ast.FunctionDef)}
    own = {x.attr for x in ast.walk(node) if isinstance(x, ast.Attribute) and isinstance(x.ctx, ast.Store)}
    listed = {
        name for base in node.bases if isinstance(base, ast.Call) for name in ast.literal_eval(base.args[1]).split()
    }
    return fields | methods | own | listed


def code_names() -> set[str]:
    """Functions, variables, and `Class.member`, of the whole package."""
    out = set()
    for module, tree in modules().items():
        out |= {x.id for x in ast.walk(tree) if isinstance(x, ast.Name) and isinstance(x.ctx, ast.Store)}
        for name, node in defined(tree, module):
            last = name.rsplit(".", 1)[1]
            out.add(last)
            if isinstance(node, ast.ClassDef):
                out |= {f"{last}.{member}" for member in members(node)}
    return out


def test_every_name_of_the_notation_is_in_the_code() -> None:
    rows = table("notation.md", "# Notation")
    assert all(len(row) == 6 for row in rows)
    names = [re.findall(r"`([^`]+)`", row[1]) for row in rows]
    assert all(names)
    assert sorted({name for row in names for name in row} - code_names()) == []


def test_equations_of_the_notation_are_of_the_source() -> None:
    equations = [row[5] for row in table("notation.md", "# Notation") if row[5]]
    assert equations
    assert set().union(*(numbers(where) for where in equations)) <= SOURCE
