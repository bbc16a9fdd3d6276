"""kedfem: how much the links of a moving mechanism bend, vibrate and are stressed.

>>> from kedfem.scene import read_scene
>>> from kedfem.analysis import analyse
"""


def __getattr__(name: str) -> str:
    """`__version__`, looked up when it is asked for: finding it takes as long as importing the command line."""
    if name != "__version__":
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    from importlib.metadata import PackageNotFoundError, version

    try:
        return version(__name__)
    except PackageNotFoundError:  # run from the source tree without being installed
        return "unknown"
