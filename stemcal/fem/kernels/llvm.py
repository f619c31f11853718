"""Kernel operations written directly in LLVM's intermediate language: prefetch, vector access to nodes, atomics.

LLVM does not recognise that a component of a run of nodes is one vector, so these functions load and store vectors,
which LLVM splits to the width of the processor; for the speed without them see
`docs/explanation/how-it-is-tested.md`.
"""

from typing import Any

import llvmlite.binding
from llvmlite import ir
from numba import types
from numba.extending import intrinsic

from stemcal.fem.kernels.compile import RUN

_NUMBER, _WORD, _BYTE = ir.DoubleType(), ir.IntType(32), ir.IntType(8)
_YIELDS = ("sched_yield", "SwitchToThread")  # functions of POSIX and Windows that yield the processor


def _prefetch(_typing: Any, values: Any, place: Any) -> Any:
    """Prefetch the cache line of ``values[place]`` of a flat, contiguous array into the second-level cache."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = context.make_array(signature.args[0])(context, builder, arguments[0])
        address = builder.bitcast(builder.gep(array.data, [arguments[1]]), _BYTE.as_pointer())
        to_read, second_cache, data = _WORD(0), _WORD(2), _WORD(1)
        form = ir.FunctionType(ir.VoidType(), [_BYTE.as_pointer(), _WORD, _WORD, _WORD])
        function = builder.module.declare_intrinsic("llvm.prefetch", (_BYTE.as_pointer(),), form)
        builder.call(function, [address, to_read, second_cache, data])
        return context.get_dummy_value()

    return types.void(values, place), build


def _read_corners(_typing: Any, nodal: Any, unit: Any, runs: Any, r: Any, values: Any, place: Any, stride: Any) -> Any:
    """Read nodal values of two runs, r and r + 1, at their elements' corners a = 1…7 relative to corner 0.

    ``values[place + (8 i + a) stride + k] = nodal[runs[a, r] + k, i] - nodal[runs[0, r] + k, i]`` for k < `RUN`, then
    run r + 1. Integer nodal values are multiplied by `unit` after the subtraction, which may wrap around 2³².
    """

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        nodal, unit, runs, r, values, place, stride = (
            _Value(context, builder, kind, value) for kind, value in zip(signature.args, arguments, strict=True)
        )
        width = runs.extent(1)
        index = r.cast(width.type)
        both = ir.Constant(ir.VectorType(_WORD, 2 * RUN), [_WORD(place) for place in range(2 * RUN)])
        form = ir.VectorType(nodal.form, RUN)
        to = ir.VectorType(values.form, 2 * RUN)
        units = _each(builder, unit.value, to) if nodal.counts else None
        for i in range(3):
            origin: Any = None
            for a in range(8):
                first = builder.add(builder.mul(width, width.type(a)), index)
                pair = [builder.load(runs.number(builder.add(first, width.type(k)))) for k in range(2)]
                pair = [builder.sext(node, width.type) for node in pair]
                pair = [_load(builder, nodal.run(_of_component(builder, nodal, node, i), form)) for node in pair]
                there = builder.shuffle_vector(*pair, both)
                if a == 0:
                    origin = there
                    continue
                if nodal.counts:
                    apart = builder.fmul(builder.sitofp(builder.sub(there, origin), to), units)
                else:
                    apart = builder.fsub(there, origin)
                at = builder.add(place.value, builder.mul(stride.value, stride.value.type(8 * i + a)))
                _store(builder, apart, values.run(at, to))
        return context.get_dummy_value()

    return types.void(nodal, unit, runs, r, values, place, stride), build


def _subtract_run(_typing: Any, nodal: Any, node: Any, values: Any, place: Any, stride: Any) -> Any:
    """Do ``nodal[node + k, i] -= values[place + i * stride + k]`` for the nodes k of a run and i = 0, 1, 2."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        nodal, node, values, place, stride = (
            _Value(context, builder, kind, value) for kind, value in zip(signature.args, arguments, strict=True)
        )
        form = ir.VectorType(nodal.form, RUN)
        for i in range(3):
            at = builder.add(place.value, builder.mul(stride.value, stride.value.type(i)))
            change = _load(builder, values.run(at, form))
            target = nodal.run(_of_component(builder, nodal, node.value, i), form)
            _store(builder, builder.fsub(_load(builder, target), change), target)
        return context.get_dummy_value()

    return types.void(nodal, node, values, place, stride), build


def counting(relation: str, many: int) -> Any:
    """Return an intrinsic that counts those of the next `many` numbers that satisfy a relation to 0, such as ``>``."""

    def count(_typing: Any, values: Any, place: Any) -> Any:
        def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array = _Value(context, builder, signature.args[0], arguments[0])
            form = ir.VectorType(array.form, many)
            are = builder.fcmp_ordered(relation, _load(builder, array.run(arguments[1], form)), ir.Constant(form, None))
            return builder.zext(builder.ctpop(builder.bitcast(are, ir.IntType(many))), ir.IntType(64))

        return types.int64(values, place), build

    return intrinsic(count)


def _store_position(_typing: Any, places: Any, n: Any, x: Any, unit: Any) -> Any:
    """Set ``places[n]`` to the low 32 bits of x / `unit`, a power of two; do nothing if `places` is x itself."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        places, n, x, unit = (
            _Value(context, builder, kind, value) for kind, value in zip(signature.args, arguments, strict=True)
        )
        if places.counts:
            # doubles near 1.5 · 2⁵² units are one unit apart, so the sum has x in whole units in its low bits
            large = builder.fmul(builder.fpext(unit.value, _NUMBER), _NUMBER(1.5 * 2.0**52))
            bits = builder.bitcast(builder.fadd(x.value, large), ir.IntType(64))
            builder.store(builder.trunc(bits, _WORD), places.number(n.value))
        return context.get_dummy_value()

    return types.void(places, n, x, unit), build


def _store_velocity(_typing: Any, velocities: Any, n: Any, v: Any) -> Any:
    """Set ``velocities[n]`` to v in single precision; do nothing if `velocities` is v itself."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        velocities, n, v = (
            _Value(context, builder, kind, value) for kind, value in zip(signature.args, arguments, strict=True)
        )
        if velocities.form != _NUMBER:
            builder.store(builder.fptrunc(v.value, velocities.form), velocities.number(n.value))
        return context.get_dummy_value()

    return types.void(velocities, n, v), build


def _add_together(_typing: Any, numbers: Any, more: Any) -> Any:
    """Add `more` to ``numbers[0]`` atomically, with a memory barrier ("seq_cst"), and return the old value."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = _Value(context, builder, signature.args[0], arguments[0])
        return builder.atomic_rmw("add", array.number(ir.IntType(64)(0)), arguments[1], "seq_cst")

    return types.int64(numbers, types.int64), build


def _read_together(_typing: Any, numbers: Any) -> Any:
    """Return ``numbers[0]`` by a sequentially consistent atomic read."""

    def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        array = _Value(context, builder, signature.args[0], arguments[0])
        return builder.load_atomic(array.number(ir.IntType(64)(0)), "seq_cst", 8)

    return types.int64(numbers), build


def _give_way(_typing: Any) -> Any:
    """Yield the processor to another thread; do nothing if the operating system has no function for it."""

    def build(context: Any, builder: Any, _signature: Any, _arguments: Any) -> Any:
        name = next((name for name in _YIELDS if llvmlite.binding.address_of_symbol(name) is not None), None)
        if name is not None:
            form = ir.FunctionType(_WORD, [])
            function = builder.module.globals.get(name) or ir.Function(builder.module, form, name)
            builder.call(function, [])
        return context.get_dummy_value()

    return types.void(), build


def _maximum(_typing: Any, a: Any, b: Any) -> Any:
    """Return the larger of two numbers, NaN if either is NaN; unlike `max`, LLVM vectorises it in loops."""

    def build(_context: Any, builder: Any, _signature: Any, arguments: Any) -> Any:
        form = ir.FunctionType(_NUMBER, [_NUMBER, _NUMBER])
        return builder.call(builder.module.declare_intrinsic("llvm.maximum", (_NUMBER,), form), arguments)

    return types.float64(types.float64, types.float64), build


def _reading(name: str) -> Any:
    """Return an intrinsic that reads a number from an array, which `name` identifies in `_APART`."""

    def read(_typing: Any, values: Any, place: Any) -> Any:
        def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array = _Value(context, builder, signature.args[0], arguments[0])
            return _set_apart(builder, builder.load(array.number(arguments[1])), name)

        return values.dtype(values, place), build

    return intrinsic(read)


def _writing(name: str) -> Any:
    """Return an intrinsic that writes a number to an array, which `name` identifies in `_APART`."""

    def write(_typing: Any, values: Any, place: Any, value: Any) -> Any:
        def build(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
            array = _Value(context, builder, signature.args[0], arguments[0])
            _set_apart(builder, builder.store(arguments[2], array.number(arguments[1])), name)
            return context.get_dummy_value()

        return types.void(values, place, values.dtype), build

    return intrinsic(write)


_APART = ("scratch", "state")  # arrays that share no memory


def _set_apart(builder: Any, instruction: Any, name: str) -> Any:
    """Declare to LLVM that the arrays in `_APART` do not overlap.

    Otherwise LLVM compares their addresses before each loop, and compiles a second, slow loop for overlapping arrays.
    """
    module = builder.module

    def node(*operands: Any) -> Any:
        return module.add_metadata(list(operands))

    domain = node(ir.MetaDataString(module, "stemcal blocks"))
    scopes = {array: node(ir.MetaDataString(module, array), domain) for array in _APART}
    instruction.set_metadata("alias.scope", node(scopes[name]))
    instruction.set_metadata("noalias", node(*(scope for array, scope in scopes.items() if array != name)))
    return instruction


class _Value:
    """An argument of an intrinsic and, if it is an array, its layout in memory."""

    def __init__(self, context: Any, builder: Any, kind: Any, value: Any) -> None:
        self.value, self._builder = value, builder
        if isinstance(kind, types.Array):
            self._array = context.make_array(kind)(context, builder, value)
            self.form = context.get_value_type(kind.dtype)
            self.counts = isinstance(kind.dtype, types.Integer)

    def cast(self, kind: Any) -> Any:
        """Return an integer extended to another integer type."""
        return self.value if self.value.type == kind else self._builder.sext(self.value, kind)

    def extent(self, axis: int) -> Any:
        """Return the length of an array along an axis."""
        return self._builder.extract_value(self._array.shape, axis)

    def number(self, place: Any) -> Any:
        """Return the address of a number in the array."""
        return self._builder.gep(self._array.data, [place])

    def run(self, place: Any, form: Any) -> Any:
        """Return the address of a vector in the array."""
        return self._builder.bitcast(self._builder.gep(self._array.data, [place]), form.as_pointer())


def _of_component(builder: Any, nodal: _Value, node: Any, i: int) -> Any:
    """Return the index of component i of a node in the memory of a nodal array (N, 3) in Fortran order."""
    nodes = nodal.extent(0)
    return builder.add(node, builder.mul(nodes, nodes.type(i)))


def _each(builder: Any, number: Any, form: Any) -> Any:
    """Return a vector of type `form` whose elements are all equal to `number`."""
    first = builder.insert_element(ir.Constant(form, ir.Undefined), number, _WORD(0))
    return builder.shuffle_vector(first, first, ir.Constant(ir.VectorType(_WORD, form.count), [_WORD(0)] * form.count))


def _load(builder: Any, address: Any) -> Any:
    return builder.load(address, align=4)


def _store(builder: Any, vector: Any, address: Any) -> None:
    builder.store(vector, address, align=4)


prefetch: Any = intrinsic(_prefetch)
read_corners: Any = intrinsic(_read_corners)
subtract_run: Any = intrinsic(_subtract_run)
store_position: Any = intrinsic(_store_position)
store_velocity: Any = intrinsic(_store_velocity)
give_way: Any = intrinsic(_give_way)
add_together: Any = intrinsic(_add_together)
read_together: Any = intrinsic(_read_together)
maximum: Any = intrinsic(_maximum)
read_scratch, write_scratch = _reading("scratch"), _writing("scratch")
read_state, write_state = _reading("state"), _writing("state")
