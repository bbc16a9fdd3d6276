"""Indexing of arrays in compiled code with a third of numba's instructions, so that compiling takes less time.

numba makes code for slices of any step, and keeps each array in memory to ask for its shape. What an index means is the
same: negative ones count from the end, slices end where the array does. All other indices are left to numba, and so is
all that it compiles for others.
"""
# mypy: disable-error-code="attr-defined, no-untyped-call, untyped-decorator"
# numba's interface for code of its own types has no types itself

import operator
from collections.abc import Sequence
from contextvars import ContextVar
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.datamodel import default_manager
from numba.core.imputils import impl_ret_borrowed
from numba.extending import lower_builtin
from numba.np import arrayobj

compact: ContextVar[bool] = ContextVar("compact", default=False)
"""Whether this thread compiles code whose indices are made here."""


def _plain(context: Any, array: Any, index: Any) -> tuple[Any, ...] | None:
    """The types of one or several indices; None if there are others than integers and slices without a step."""
    if not compact.get():
        return None
    kinds = index.types if isinstance(index, types.BaseTuple) else (index,)
    slices = [kind for kind in kinds if isinstance(kind, types.SliceType)]
    integers = [kind for kind in kinds if isinstance(kind, types.Integer)]
    plain = array.layout in "CA" and not context.enable_boundscheck and not any(x.has_step for x in slices)
    return kinds if plain and kinds and len(slices) + len(integers) == len(kinds) else None


def _within(builder: Any, bound: Any, size: Any) -> Any:
    """A slice's bound in an array of a size."""
    bound = arrayobj.slicing.fix_index(builder, bound, size)
    bound = builder.select(builder.icmp_signed("<", bound, size.type(0)), size.type(0), bound)
    return builder.select(builder.icmp_signed(">", bound, size), size, bound)


def _located(
    context: Any, builder: Any, signature: Any, arguments: Any, kinds: Sequence[Any]
) -> tuple[Any, list[Any], list[Any]]:
    """Where what an index chooses begins, its shape and strides."""
    (kind, index), (array, value) = signature.args[:2], arguments[:2]
    model, several = default_manager.lookup(kind), isinstance(index, types.BaseTuple)
    sizes = cgutils.unpack_tuple(builder, model.get(builder, array, "shape"), kind.ndim)
    steps = cgutils.unpack_tuple(builder, model.get(builder, array, "strides"), kind.ndim)
    values = cgutils.unpack_tuple(builder, value, len(kinds)) if several else [value]
    at, shape, strides = [], [], []
    for each, chosen, size, step in zip(kinds, values, sizes, steps, strict=False):
        if isinstance(each, types.Integer):
            at.append(arrayobj.fix_integer_index(context, builder, each, chosen, size))
            continue
        start, stop = (_within(builder, builder.extract_value(chosen, k), size) for k in range(2))
        length = builder.sub(stop, start)
        shape.append(builder.select(builder.icmp_signed("<", length, size.type(0)), size.type(0), length))
        strides.append(step)
        at.append(start)
    at += [size.type(0) for size in sizes[len(kinds) :]]
    place = cgutils.get_item_pointer2(context, builder, model.get(builder, array, "data"), sizes, steps, kind.layout, at)
    return place, [*shape, *sizes[len(kinds) :]], [*strides, *steps[len(kinds) :]]


@lower_builtin(operator.getitem, types.Array, types.Integer)
@lower_builtin(operator.getitem, types.Array, types.SliceType)
@lower_builtin(operator.getitem, types.Array, types.BaseTuple)
def _chosen(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """An element, or a view of some."""
    (kind, index), out = signature.args, signature.return_type
    kinds = _plain(context, kind, index)
    if kinds is None:
        numbas = arrayobj.getitem_array_tuple if isinstance(index, types.BaseTuple) else arrayobj.getitem_arraynd_intp
        return numbas(context, builder, signature, arguments)
    array = arguments[0]
    place, shape, strides = _located(context, builder, signature, arguments, kinds)
    if not isinstance(out, types.Array):
        return impl_ret_borrowed(context, builder, out, arrayobj.load_item(context, builder, kind, place))
    model, made = default_manager.lookup(kind), default_manager.lookup(out)
    count = shape[0]
    for size in shape[1:]:
        count = builder.mul(count, size)
    fields = {
        "meminfo": model.get(builder, array, "meminfo"), "parent": model.get(builder, array, "parent"),
        "nitems": count, "itemsize": model.get(builder, array, "itemsize"), "data": place,
        "shape": cgutils.pack_array(builder, shape), "strides": cgutils.pack_array(builder, strides),
    }  # fmt: skip
    view = ir.Constant(made.get_value_type(), ir.Undefined)
    for name, value in fields.items():
        view = made.set(builder, view, value, name)
    return impl_ret_borrowed(context, builder, out, view)


@lower_builtin(operator.setitem, types.Array, types.Integer, types.Any)
@lower_builtin(operator.setitem, types.Array, types.BaseTuple, types.Any)
def _set(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
    """An element gets a value."""
    kind, index, given = signature.args
    kinds = _plain(context, kind, index)
    if kinds is None or len(kinds) < kind.ndim or any(isinstance(each, types.SliceType) for each in kinds):
        return arrayobj.setitem_array(context, builder, signature, arguments)
    place, _, _ = _located(context, builder, signature, arguments, kinds)
    value = context.cast(builder, arguments[2], given, kind.dtype)
    arrayobj.store_item(context, builder, kind, value, place)
    return context.get_dummy_value()
