"""Records handed on by address: what a compiled function calls gets one pointer instead of all arrays. Arrays, too.

numba takes a named tuple apart into its arrays, and each array into seven numbers, at every call: with all records of
a system 1,100 arguments, which cost more to compile and to call than what is done with them. `reference(record)` keeps
a record where it is made; `x.name` of it is the array, as of the record itself.

Used as long as the function that made it runs, and in compiled code only.
"""
# mypy: disable-error-code="misc, no-untyped-call, untyped-decorator, attr-defined, override"
# numba's interface for new types has no types itself

from typing import Any

from numba.core import cgutils, types
from numba.core.datamodel import default_manager
from numba.core.datamodel.models import PrimitiveModel
from numba.core.imputils import impl_ret_borrowed
from numba.core.typing.templates import AttributeTemplate
from numba.extending import infer_getattr, intrinsic, lower_getattr_generic, register_model
from numba.np.arrayobj import populate_array


class Reference(types.Type):
    """Where a record, a named tuple, is."""

    def __init__(self, record: Any) -> None:
        self.record = record
        super().__init__(name=f"Reference({record})")


@register_model(Reference)
class _Address(PrimitiveModel):
    def __init__(self, manager: Any, kind: Reference) -> None:
        super().__init__(manager, kind, manager.lookup(kind.record).get_data_type().as_pointer())


@infer_getattr
class _Named(AttributeTemplate):
    key = Reference

    def generic_resolve(self, kind: Reference, name: str) -> Any:
        """The type of an attribute."""
        fields = kind.record.fields
        return kind.record.types[fields.index(name)] if name in fields else None


@lower_getattr_generic(Reference)
def _attribute(context: Any, builder: Any, kind: Reference, address: Any, name: str) -> Any:
    """Code that loads an attribute."""
    k = kind.record.fields.index(name)
    of = kind.record.types[k]
    place = cgutils.gep_inbounds(builder, address, 0, k)
    value = default_manager.lookup(of).load_from_data_pointer(builder, place)
    return impl_ret_borrowed(context, builder, of, value)


def _kept(_: Any, record: Any) -> Any:
    if isinstance(record, types.NoneType):
        return record(record), lambda context, builder, signature, arguments: arguments[0]

    def stored(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        data = default_manager.lookup(record).as_data(builder, arguments[0])
        place = cgutils.alloca_once(builder, data.type)
        builder.store(data, place)
        return place

    return Reference(record)(record), stored


reference: Any = intrinsic(_kept)
"""Called in compiled code with a record: where it is kept; None stays None."""


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
