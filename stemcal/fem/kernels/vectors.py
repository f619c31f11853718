"""What the kernels say to LLVM in its own words: a cache line asked for, nodes read and written a run at a time.

A run is `RUN` nodes that follow one another in a nodal array (N, 3). LLVM finds by itself neither that their components
can be read as whole vectors nor how to part them: both are spelled out here, as vectors of any width that LLVM breaks
down to what the processor has. A run may reach past the last node: nodal arrays have `RUN` rows to spare behind it.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

RUN = 8

_NUMBER, _WORD, _BYTE = ir.DoubleType(), ir.IntType(32), ir.IntType(8)
_RUN, _NODES = ir.VectorType(_NUMBER, RUN), ir.VectorType(_NUMBER, 3 * RUN)


def _prefetch(_typing: Any, values: Any, place: Any) -> Any:
    """Ask for the cache line of ``values[place]``, flat and contiguous, so that it is there when it is needed."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        address = builder.bitcast(builder.gep(array.data, [arguments[1]]), _BYTE.as_pointer())
        to_write, keep_close, data = _WORD(1), _WORD(3), _WORD(1)
        form = ir.FunctionType(ir.VoidType(), [_BYTE.as_pointer(), _WORD, _WORD, _WORD])
        function = builder.module.declare_intrinsic("llvm.prefetch", (_BYTE.as_pointer(),), form)
        builder.call(function, [address, to_write, keep_close, data])
        return context.get_dummy_value()

    return types.void(values, place), build


def _read_run(_typing: Any, nodal: Any, node: Any, origin: Any, values: Any, place: Any, stride: Any) -> Any:
    """Set ``values[place + i * stride + k] = nodal[node + k, i] - nodal[origin + k, i]``, k < `RUN`, i = 0, 1, 2.

    The difference is rounded to the precision of the values.
    """

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        source, node, origin, target, place, stride = arguments
        there, from_there = (
            _load(builder, _nodes(context, builder, signature.args[0], source, first)) for first in (node, origin)
        )
        apart = builder.fsub(there, from_there)
        form = _run_of(signature.args[3])
        for i in range(3):
            component = builder.shuffle_vector(apart, apart, _order(range(i, 3 * RUN, 3)))
            if form != _RUN:
                component = builder.fptrunc(component, form)
            _store(builder, component, _component(context, builder, signature.args[3], target, place, stride, i))
        return context.get_dummy_value()

    return types.void(nodal, node, origin, values, place, stride), build


def _subtract_run(_typing: Any, nodal: Any, node: Any, values: Any, place: Any, stride: Any) -> Any:
    """Do ``nodal[node + k, i] -= values[place + i * stride + k]`` for the nodes k of a run and i = 0, 1, 2."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        target, first, source, place, stride = arguments
        components = (
            _load(builder, _component(context, builder, signature.args[2], source, place, stride, i)) for i in range(3)
        )
        single = _run_of(signature.args[2]) != _RUN
        x, y, z = (builder.fpext(values, _RUN) if single else values for values in components)
        both = builder.shuffle_vector(x, y, _order(range(2 * RUN)))
        rest = builder.shuffle_vector(z, z, _order(range(2 * RUN)))
        one_by_one = [i * RUN + k for k in range(RUN) for i in range(3)]
        nodes = _nodes(context, builder, signature.args[0], target, first)
        change = builder.shuffle_vector(both, rest, _order(one_by_one))
        _store(builder, builder.fsub(_load(builder, nodes), change), nodes)
        return context.get_dummy_value()

    return types.void(nodal, node, values, place, stride), build


def _run_of(kind: Any) -> Any:
    """Return the vector that a run of values of an array's type makes."""
    return ir.VectorType(ir.FloatType() if kind.dtype == types.float32 else _NUMBER, RUN)


def _order(places: Iterable[int]) -> Any:
    chosen = [_WORD(place) for place in places]
    return ir.Constant(ir.VectorType(_WORD, len(chosen)), chosen)


def _nodes(context: Any, builder: Any, kind: Any, nodal: Any, first: Any) -> Any:
    """Return the address of a run of rows of a nodal array."""
    return _address(context, builder, kind, nodal, builder.mul(first, first.type(3)), _NODES)


def _component(context: Any, builder: Any, kind: Any, values: Any, place: Any, stride: Any, i: int) -> Any:
    """Return the address of component i of a run in flat values."""
    at = builder.add(place, builder.mul(stride, stride.type(i)))
    return _address(context, builder, kind, values, at, _run_of(kind))


def _address(context: Any, builder: Any, kind: Any, values: Any, place: Any, form: Any) -> Any:
    array = context.make_array(kind)(context, builder, values)
    return builder.bitcast(builder.gep(array.data, [place]), form.as_pointer())


def _load(builder: Any, address: Any) -> Any:
    return builder.load(address, align=4)


def _store(builder: Any, vector: Any, address: Any) -> None:
    builder.store(vector, address, align=4)


prefetch: Any = intrinsic(_prefetch)
read_run: Any = intrinsic(_read_run)
subtract_run: Any = intrinsic(_subtract_run)
