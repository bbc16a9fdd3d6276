"""Records and arrays passed to compiled functions by address, with one pointer instead of all their arrays.

numba divides a named tuple into its arrays, and each array into seven numbers, at every call. All records of a system
are 1,100 such arguments, which cost more to compile and to pass than the work on them. `by_address(record)` stores
these numbers once, in numba's memory layout of a named tuple; in compiled code its `x.name` is the array.

The caller must keep the record as long as the function runs.
"""
# mypy: disable-error-code="misc, no-untyped-call, untyped-decorator, attr-defined, override"
# numba's interface for new types has no types itself

import struct
import sys
from hashlib import sha256
from typing import Any

import numpy as np
from numba import typeof
from numba._dispatcher import compute_fingerprint
from numba.core import types
from numba.core.datamodel import default_manager
from numba.core.datamodel.models import OpaqueModel
from numba.core.typing.templates import AttributeTemplate
from numba.extending import NativeValue, infer_getattr, intrinsic, lower_getattr_generic, register_model, unbox
from numba.np.arrayobj import populate_array

from kedfem.compiled import compiles_for_all
from kedfem.dynamics.system.arrays import Bodies, Ends
from kedfem.dynamics.system.record import COROTATIONAL, STRESSED


class Reference(types.Type):
    """A record, a named tuple, by its address; its name is short, as it stands in those of all functions."""

    def __init__(self, record: Any) -> None:
        self.record = record
        digest = sha256(str(record).encode()).hexdigest()[:8]
        super().__init__(name=f"{record.instance_class.__name__}_{digest}")

    @property
    def key(self) -> Any:
        """What tells types apart."""
        return self.record


register_model(Reference)(OpaqueModel)


@infer_getattr
class _Named(AttributeTemplate):
    key = Reference

    def generic_resolve(self, kind: Reference, name: str) -> Any:
        """The type of an attribute."""
        fields = kind.record.fields
        return kind.record.types[fields.index(name)] if name in fields else None


@lower_getattr_generic(Reference)
def _attribute(context: Any, builder: Any, kind: Reference, address: Any, name: str) -> Any:
    """Code that loads an attribute: of arrays all that numba keeps of them at once."""
    k = kind.record.fields.index(name)
    model = default_manager.lookup(kind.record.types[k])
    at = context.get_constant(types.intp, 8 * sum(_length(each) for each in kind.record.types[:k]))
    place = builder.bitcast(builder.gep(address, [at]), model.get_data_type().as_pointer())
    if model.get_data_type() == model.get_value_type():
        return builder.load(place)
    return model.load_from_data_pointer(builder, place)


def _length(kind: Any) -> int:
    """How many numbers a value has, see `_lay_out`."""
    if isinstance(kind, types.Array):
        return 5 + 2 * int(kind.ndim)
    return sum(_length(each) for each in kind) if isinstance(kind, types.BaseTuple) else 1


@unbox(Reference)
def _unboxed(kind: Reference, given: Any, c: Any) -> Any:
    del kind
    address = c.pyapi.object_getattr_string(given, "address")
    place = c.pyapi.long_as_voidptr(address)
    c.pyapi.decref(address)
    return NativeValue(place)


class RecordAddress:
    """A named tuple of arrays, numbers and tuples of them, as compiled code finds it."""

    __slots__ = ("_numba_type_", "address", "numbers", "record")

    def __init__(self, record: Any) -> None:
        kind = compute_fingerprint(record)
        if kind not in _kinds:
            _kinds[kind] = Reference(typeof(record))
        self._numba_type_, self.record = _kinds[kind], record
        numbers: list[int] = []
        _lay_out(record, numbers)
        self.numbers = np.array(numbers, np.int64)
        self.address = self.numbers.ctypes.data


_kinds: dict[bytes, Reference] = {}


def _lay_out(x: Any, numbers: list[int]) -> None:
    """Append what numba keeps of a value: of arrays owner, parent, sizes, address, shape and strides."""
    if isinstance(x, np.ndarray):
        numbers += (0, 0, x.size, x.itemsize, x.__array_interface__["data"][0], *x.shape, *x.strides)
    elif isinstance(x, tuple):
        for each in x:
            _lay_out(each, numbers)
    elif x is None:
        numbers.append(0)
    elif isinstance(x, float):
        numbers.append(int.from_bytes(struct.pack("=d", x), sys.byteorder, signed=True))
    else:
        numbers.append(int(x))


def by_address(record: Any) -> Any:
    """What compiled functions are given for a record; None stays None.

    Of bodies and ends without what none of them has: what that needs is not compiled, but in loops for all scenes.
    """
    if record is None:
        return None
    unused = () if compiles_for_all() else _unused(record)
    return RecordAddress(record._replace(**dict.fromkeys(unused)) if unused else record)


def _unused(record: Any) -> list[str]:
    """What a record has none of."""
    none: dict[str, Any] = {}
    if isinstance(record, Bodies):
        none = {
            "beams": not len(record.beams.segment),
            "K": not (record.frame == COROTATIONAL).any(),
            "elements": (record.elements.number < 0).all(),
            "turning": not len(record.turning.body),
            "stresses": not (record.frame == STRESSED).any(),
            "mass": record.dense.all(),
            "arrays": record.dense.all(),
        }
    elif isinstance(record, Ends):
        none = {"knots": not len(record.line)}
    return [name for name, yes in none.items() if yes]


def _array_at(number: Any) -> Any:
    kind, size = types.Array(number, 1, "C"), number.bitwidth // 8

    def typed(_: Any, address: Any, length: Any) -> Any:
        def made(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array = context.make_array(kind)(context, builder)
            place = builder.inttoptr(arguments[0], array.data.type)
            populate_array(array, place, [arguments[1]], [context.get_constant(types.intp, size)], size, None)
            return array._getvalue()

        return kind(address, length), made

    return intrinsic(typed)


integers_at, reals_at = _array_at(types.int64), _array_at(types.float64)
"""Called in compiled code with an array's address and its length: the array, which must be kept elsewhere."""
