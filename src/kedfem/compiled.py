"""Loops compiled by numba, and where they are kept: anew for every state of all of kedfem's compiled code.

numba compiles a function again when its own file has changed, but not when one that it calls in another file has, nor a
constant there. So what it compiled is kept in a folder named after all `*kernel.py` files together, what they import of
kedfem, and this file with its options. Imported by these files only: numba takes a while to load.
"""

import os
import re
from hashlib import sha256
from pathlib import Path
from typing import Any

import numba

ROOT = Path(__file__).parent


def kernel_folder(root: Path) -> Path:
    """The folder of what was compiled of all kernels under a folder."""
    digest = sha256()
    kernels = set(root.rglob("*kernel.py"))
    for file in sorted(kernels | {each for kernel in kernels for each in _imported(kernel, root)}):
        digest.update(file.read_bytes())
    return root / "__pycache__" / f"kernels-{digest.hexdigest()[:16]}"


def _imported(kernel: Path, root: Path) -> set[Path]:
    """The files of the package that a kernel takes functions, constants and options from."""
    names = re.findall(rf"^\s*(?:from|import) {root.name}\.([\w.]+)", kernel.read_text(), re.MULTILINE)
    files = (root / Path(*name.split(".")) for name in names)
    found = (file for path in files for file in (path.with_suffix(".py"), path / "__init__.py"))
    return {file for file in found if file.is_file()}


if not os.environ.get("NUMBA_CACHE_DIR"):
    vars(numba.config)["CACHE_DIR"] = str(kernel_folder(ROOT))

_OPTIONS: dict[str, Any] = {"cache": True, "nogil": True, "error_model": "numpy"}
_FAST: dict[str, Any] = {**_OPTIONS, "fastmath": {"reassoc", "contract", "nsz"}}
compiled: Any = numba.njit(**_FAST)
_INNER: dict[str, Any] = {**_FAST, "no_cpython_wrapper": True, "no_cfunc_wrapper": True, "_nrt": False}
inner: Any = numba.njit(**_INNER)
"""Called by compiled loops only, and allocates nothing, so that no references are counted: compiled in less time."""
compiled_in_order: Any = numba.njit(**_OPTIONS)
"""Sums as written, where their order matters."""
