"""Packages that only some outputs need, and what to install where one is missing."""

from importlib import import_module
from typing import Any

from kedfem.errors import OutputError

DATA = "data"  # the extra with xarray, pandas and what they write files with


def of_extra(package: str, where: str, extra: str = DATA) -> Any:
    """A package of an extra of kedfem.

    Parameters
    ----------
    where : what needs it, as the user wrote it

    Raises
    ------
    OutputError
        It is not installed; with the one command that installs it.
    """
    try:
        return import_module(package)
    except ImportError as error:
        raise OutputError(
            f"{where}: needs {package}, which is not installed: pip install 'kedfem[{extra}]'"
        ) from error
