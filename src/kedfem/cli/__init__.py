"""The command line: the only place that prints. Heavy imports happen inside the commands."""

import gc
import os
import sys
from collections.abc import Callable
from functools import wraps
from typing import Annotated, Any

import typer

from kedfem.cli.exporting import export
from kedfem.cli.new import KINDS, new
from kedfem.cli.options import DEFECT, INTERRUPTED, UNRELIABLE, USER_ERROR, flag
from kedfem.cli.parts import frequencies, mesh
from kedfem.cli.results import compare, loads, report, view
from kedfem.cli.running import accuracy, check, kinematics, run, sweep
from kedfem.cli.screen import out, progress, say, warn
from kedfem.errors import KedfemError, OutputError
from kedfem.processes import end_as_interrupted, import_quickly, interruption_asked, one_blas_thread

app = typer.Typer(
    name="kedfem", help="How much the links of a moving mechanism bend, vibrate and are stressed.",
    no_args_is_help=True, add_completion=False, pretty_exceptions_enable=False, rich_markup_mode=None,
)  # fmt: skip


@app.callback(invoke_without_command=True)
def _root(
    context: typer.Context, version: Annotated[bool, flag("--version", "Show the version and exit.")] = False
) -> None:
    if version:
        from kedfem import __version__

        out.print(f"kedfem {__version__}")
        raise typer.Exit
    del context


def cache(clear: Annotated[bool, flag("--clear", "Remove all that is kept.")] = False) -> None:
    """Show what is kept between runs, and where."""
    from kedfem.folders import cache_folder, named_cache
    from kedfem.store import clear as cleared
    from kedfem.store import entries

    named, folder = named_cache(), cache_folder()
    if named is None:
        out.print("nothing is kept: KEDFEM_CACHE switches it off")
    elif folder is None:
        raise OutputError(
            f"{named}: must be a folder that you own and that nobody else can write (entries can run code), got another "
            "one; nothing is kept until it is, or KEDFEM_CACHE names another folder"
        )
    elif clear:
        say(folder, f"{_count(cleared(folder))} removed")
    else:
        sizes = [path.stat().st_size for path in entries(folder)]
        say(folder, f"{_count(len(sizes))}, {sum(sizes) / 1e6:.1f} MB")


def _count(entries: int) -> str:
    return f"{entries} entr{'y' if entries == 1 else 'ies'}"


def compile_() -> None:
    """Compile what scenes need, once for this version; otherwise the first runs do."""
    from kedfem.precompile import precompile

    with progress() as watch:
        precompile(watch)
    out.print("compiled")


def _interruptible(command: Callable[..., None]) -> Callable[..., None]:
    """The command, which says so when it is interrupted: typer would end without a word."""

    @wraps(command)
    def reporting(*given: Any, **named: Any) -> None:
        try:
            command(*given, **named)
        except KeyboardInterrupt:
            warn("interrupted")
            raise typer.Exit(INTERRUPTED) from None

    return reporting


for each in (
    run, check, kinematics, mesh, accuracy, new, cache, compile_,
    sweep, frequencies, loads, compare, report, export, view,
):  # fmt: skip
    app.command(name=each.__name__.removesuffix("_"))(_interruptible(each))


def main() -> None:
    """Entry point: errors of kedfem become messages and an exit code, never a traceback."""
    import_quickly()
    end_as_interrupted()
    one_blas_thread()
    try:
        app()
    except KedfemError as error:
        warn(f"error: {error}" if "\n" not in str(error) else f"errors:\n{error}", "red")
        sys.exit(USER_ERROR)
    except KeyboardInterrupt:
        warn("interrupted")
        sys.exit(INTERRUPTED)
    except MemoryError:
        wanted = "must fit in memory, got more unknowns than it holds; take larger elements"
        warn(f"error: analysis: {wanted}", "red", soft_wrap=False)
        sys.exit(USER_ERROR)
    except Exception as error:
        if os.environ.get("KEDFEM_DEBUG"):
            raise
        if interruption_asked():  # raised within a library that went on without what it interrupted
            warn("interrupted")
            sys.exit(INTERRUPTED)
        what = f"internal error: {type(error).__name__}: {error}"
        warn(f"{what}\nThis is a defect of kedfem; KEDFEM_DEBUG=1 shows where.", "red", soft_wrap=False)
        sys.exit(DEFECT)
    finally:
        gc.freeze()  # else Python looks through all that was imported once more before it ends: half a second
