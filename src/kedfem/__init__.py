"""kedfem: how much the links of a moving mechanism bend, vibrate and are stressed.

>>> from kedfem.scene import read_scene
>>> from kedfem.analysis import analyse
"""

from importlib.metadata import PackageNotFoundError, version

try:
    __version__ = version("kedfem")
except PackageNotFoundError:  # run from the source tree without being installed
    __version__ = "unknown"
