"""The reference of the command line, from the help texts of the commands."""

import re

import typer
from typer.cli import get_docs_for_click
from typer.main import get_command

INTRODUCTION = """\
# Command line

Every command says with `--help` what stands here. Exit statuses:

| status | meaning |
|---|---|
{statuses}

Warnings go to the error stream, and are kept in the results. Progress bars appear on terminals only.

"""


def statuses() -> str:
    """The rows of the table of exit statuses."""
    from kedfem import cli

    meanings = {
        0: "done",
        cli.USER_ERROR: "refused: the message says where, what is required and what was given",
        cli.UNRELIABLE: "done, but the results mean nothing by their own estimates; they are marked `unreliable`",
        cli.INTERRUPTED: "interrupted; what was computed is kept and marked",
        cli.DEFECT: "a defect of kedfem; `KEDFEM_DEBUG=1` shows where",
    }
    return "\n".join(f"| {status} | {meanings[status]} |" for status in sorted(meanings))


def command_line() -> str:
    """The text of the page."""
    from kedfem.cli import app

    command = get_command(app)
    text = get_docs_for_click(obj=command, ctx=typer.Context(command, info_name="kedfem"), name="kedfem")
    text = re.sub(r"\A# .*\n", "", text)  # the page has its own title
    text = re.sub(r"\*\*Commands\*\*:\n\n(\* .*\n)+\n", "", text)  # cut short, and the contents list them
    text = re.sub(r"^\* `--help`: .*\n", "", text, flags=re.MULTILINE)
    return INTRODUCTION.format(statuses=statuses()) + text.lstrip()
