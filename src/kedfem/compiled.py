"""Loops compiled by numba, and where they are kept: anew for every state of all of kedfem's compiled code.

numba compiles a function again when its own file has changed, but not when one that it calls in another file has. So what
it compiled is kept in a folder named after all `*_kernel.py` files together. Imported by these files only: numba takes a
while to load.
"""

import os
from hashlib import sha256
from pathlib import Path
from typing import Any

import numba

ROOT = Path(__file__).parent


def kernel_folder(root: Path) -> Path:
    """The folder of what was compiled of all kernels under a folder."""
    digest = sha256()
    for file in sorted(root.rglob("*kernel.py")):
        digest.update(file.read_bytes())
    return root / "__pycache__" / f"kernels-{digest.hexdigest()[:16]}"


if not os.environ.get("NUMBA_CACHE_DIR"):
    vars(numba.config)["CACHE_DIR"] = str(kernel_folder(ROOT))

compiled: Any = numba.njit(
    cache=True, nogil=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz"}
)
compiled_in_order: Any = numba.njit(cache=True, nogil=True, error_model="numpy")
"""Sums as written, where their order matters."""
