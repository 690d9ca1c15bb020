"""Arithmetic on whole blocks: one vector instruction where the compiler, unsure of overlaps, writes many.

Blocks of even size fill vectors; those of odd size are taken number by number. All arrays are contiguous,
of any shape, their entries counted in one row, and do not overlap.
"""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from model.node_loop.prefetch import LINE, ask

ENTRY = 8  # bytes
FUSED = ["contract"]  # multiply and add in one
LANE = ir.IntType(32)


@intrinsic(prefer_literal=True)
def add_scaled(typingctx: Any, x: Any, i: Any, w: Any, y: Any, k: Any, count: Any) -> Any:
    """Do x[i + t] += w y[k + t] for t < count, a constant."""

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        (x, y), n = _data(context, builder, signature, arguments, 0, 3), count.literal_value
        i, w, k = arguments[1], arguments[2], arguments[4]
        scaled = builder.fmul(_vector(builder, [w] * n), _load(builder, y, k, 0, n), flags=FUSED)
        _store(builder, builder.fadd(_load(builder, x, i, 0, n), scaled, flags=FUSED), x, i, 0)
        return context.get_dummy_value()

    return types.void(x, types.uint64, types.float64, y, types.uint64, count), generate


@intrinsic(prefer_literal=True)
def row_defect(
    typing: Any, A: Any, begin: Any, end: Any, load: Any, u: Any, i: Any, ahead: Any, backward: Any, size: Any
) -> Any:
    """Return load_i - sum_k A_k u_j(k), a tuple, over the blocks begin <= k < end, of a constant size.

    Memory is asked for so many bytes ahead; `backward` takes the blocks from the last to the first.
    """
    d, w = size.literal_value, _width(size.literal_value) ** 2

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        begin, end, i, ahead, backward = (arguments[t] for t in (1, 2, 5, 6, 7))
        load, u = _data(context, builder, signature, arguments, 3, 4)
        columns, A = (
            context.make_array(kind)(context, builder, array).data
            for kind, array in list(zip(kinds, cgutils.unpack_tuple(builder, arguments[0])))[1:]
        )
        number = begin.type
        entries = _entries(builder, load, builder.mul(i, number(d)), d)
        start = [ir.Constant(ir.DoubleType(), 0.0)] * (d * d)
        start[::d] = entries
        totals = [
            cgutils.alloca_once_value(builder, _vector(builder, start[p : p + w])) for p in range(0, d * d, w)
        ]
        with cgutils.for_range(builder, builder.sub(end, begin)) as loop:
            k = builder.add(begin, loop.index)
            k = builder.select(backward, builder.sub(builder.sub(end, number(1)), loop.index), k)
            j = builder.zext(builder.load(builder.gep(columns, [k])), number)
            j, at = builder.mul(j, number(d)), builder.mul(k, number(d * d))
            for line in range(0, d * d * ENTRY, 2 * LINE):  # they come in pairs
                ask(builder, builder.gep(A, [at]), builder.add(ahead, ahead.type(line)))
            for p, total in enumerate(totals):
                x = _load(builder, u, j, p % d, 1) if w == 1 else _tiled(builder, _load(builder, u, j, 0, d))
                x = builder.fmul(_load(builder, A, at, p * w, w), x, flags=FUSED)
                builder.store(builder.fsub(builder.load(total), x, flags=FUSED), total)
        block = [x for total in totals for x in _numbers(builder, builder.load(total))]
        return context.make_tuple(builder, signature.return_type, _row_sums(builder, block, d))

    kinds = A.types
    arguments = (A, types.uint64, types.uint64, load, u, types.uint64, types.int64, types.boolean, size)
    return types.UniTuple(types.float64, d)(*arguments), generate


@intrinsic
def subtract_transposed(typing: Any, A: Any, k: Any, x: Any, r: Any, j: Any, ahead: Any) -> Any:
    """Do r_j -= A_k^T x, x a tuple; memory is asked for so many bytes behind the block's end."""
    d, w = x.count, _width(x.count)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        A, r = _data(context, builder, signature, arguments, 0, 3)
        k, j = (builder.mul(arguments[t], arguments[t].type(n)) for t, n in ((1, d * d), (4, d)))
        ask(builder, _place(builder, A, k, d * d - 1, 1), arguments[5])
        factors = [_vector(builder, [x] * w) for x in cgutils.unpack_tuple(builder, arguments[2])]
        totals = [_load(builder, r, j, b, w) for b in range(0, d, w)]
        for a, factor in enumerate(factors):
            for p, total in enumerate(totals):
                change = builder.fmul(factor, _load(builder, A, k, a * d + p * w, w), flags=FUSED)
                totals[p] = builder.fsub(total, change, flags=FUSED)
        for p, total in enumerate(totals):
            _store(builder, total, r, j, p * w)
        return context.get_dummy_value()

    return types.void(A, types.uint64, x, r, types.uint64, types.int64), generate


@intrinsic
def relax(typingctx: Any, inverse: Any, i: Any, r: Any, u: Any) -> Any:
    """Do u_i += D_i^-1 r, `inverse` holding all D_i^-1; return the step, a tuple as r.

    All of u_i is written in one, so that who reads it next need not wait.
    """
    d, w = r.count, _width(r.count)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        inverse, u = _data(context, builder, signature, arguments, 0, 3)
        i, k = (builder.mul(arguments[1], arguments[1].type(n)) for n in (d, d * d))
        block, r = _entries(builder, inverse, k, d * d), cgutils.unpack_tuple(builder, arguments[2]) * d
        step = _row_sums(builder, [builder.fmul(x, y, flags=FUSED) for x, y in zip(block, r)], d)
        for a in range(0, d, w):
            total = builder.fadd(_load(builder, u, i, a, w), _vector(builder, step[a : a + w]), flags=FUSED)
            _store(builder, total, u, i, a)
        return context.make_tuple(builder, signature.return_type, step)

    return r(inverse, types.uint64, r, u), generate


@intrinsic
def put(typingctx: Any, x: Any, i: Any, values: Any) -> Any:
    """Do x_i = values, a tuple."""
    d, w = values.count, _width(values.count)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        (x,), i = (
            _data(context, builder, signature, arguments, 0),
            builder.mul(arguments[1], ir.IntType(64)(d)),
        )
        for a in range(0, d, w):
            values = cgutils.unpack_tuple(builder, arguments[2])[a : a + w]
            _store(builder, _vector(builder, values), x, i, a)
        return context.get_dummy_value()

    return types.void(x, types.uint64, values), generate


def _width(d: int) -> int:
    """Numbers of a row of d that are taken at once."""
    return d if d % 2 == 0 else 1


def _data(context: Any, builder: Any, signature: Any, arguments: Any, *which: int) -> list[Any]:
    """Where the entries of the arrays among the arguments begin."""
    return [context.make_array(signature.args[t])(context, builder, arguments[t]).data for t in which]


def _place(builder: Any, array: Any, position: Any, more: int, count: int) -> Any:
    position = builder.add(position, position.type(more))
    return builder.bitcast(builder.gep(array, [position]), ir.VectorType(ir.DoubleType(), count).as_pointer())


def _load(builder: Any, array: Any, position: Any, more: int, count: int) -> Any:
    return builder.load(_place(builder, array, position, more, count), align=ENTRY)


def _store(builder: Any, vector: Any, array: Any, position: Any, more: int) -> None:
    builder.store(vector, _place(builder, array, position, more, vector.type.count), align=ENTRY)


def _vector(builder: Any, numbers: Any) -> Any:
    vector = ir.Constant(ir.VectorType(ir.DoubleType(), len(numbers)), ir.Undefined)
    for t, number in enumerate(numbers):
        vector = builder.insert_element(vector, number, LANE(t))
    return vector


def _numbers(builder: Any, vector: Any) -> list[Any]:
    return [builder.extract_element(vector, LANE(t)) for t in range(vector.type.count)]


def _entries(builder: Any, array: Any, position: Any, count: int) -> list[Any]:
    at = [builder.add(position, position.type(t)) for t in range(count)]
    return [builder.load(builder.gep(array, [k])) for k in at]


def _tiled(builder: Any, x: Any) -> Any:
    """Return x (d,) beside each row of a block (d, d)."""
    d = x.type.count
    return builder.shuffle_vector(x, x, ir.Constant(ir.VectorType(LANE, d * d), [*range(d)] * d))


def _row_sums(builder: Any, block: list[Any], d: int) -> list[Any]:
    """Return the sum of each row of a block of d d numbers."""
    sums = block[::d]
    for b in range(1, d):
        sums = [builder.fadd(s, number, flags=FUSED) for s, number in zip(sums, block[b::d])]
    return sums
