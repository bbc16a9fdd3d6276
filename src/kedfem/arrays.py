"""Types of arrays in annotations: jaxtyping's for whoever checks them, names alone in a run, which reads none of them.

Type checkers see jaxtyping's, and so does what imports jaxtyping before kedfem, as tests do to check shapes.
"""

import sys
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING or "jaxtyping" in sys.modules:
    from jaxtyping import Bool, Complex, Float, Inexact, Int, UInt8
else:

    class _Unchecked:
        """In place of an array's type its class: making jaxtyping's takes a fifteenth of a short run."""

        def __class_getitem__(cls, kind: tuple[type, str]) -> Any:
            return kind[0]

    Bool = Complex = Float = Inexact = Int = UInt8 = _Unchecked

__all__ = ["Bool", "Complex", "Float", "Inexact", "Int", "UInt8"]
