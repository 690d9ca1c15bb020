"""Arithmetic on whole blocks: one vector instruction where the compiler, unsure of overlaps, writes many."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from model.node_loop.prefetch import ask

ENTRY = 8  # bytes


@intrinsic(prefer_literal=True)
def add_scaled(typingctx: Any, x: Any, i: Any, w: Any, y: Any, k: Any, count: Any) -> Any:
    """Do x[i + t] += w y[k + t] for t < count, a constant; x and y are contiguous and do not overlap."""
    vector = ir.VectorType(ir.DoubleType(), count.literal_value)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        def at(array: int, position: int) -> Any:
            held = context.make_array(signature.args[array])(context, builder, arguments[array])
            return builder.bitcast(builder.gep(held.data, [arguments[position]]), vector.as_pointer())

        factors = ir.Constant(vector, ir.Undefined)
        for t in range(vector.count):
            factors = builder.insert_element(factors, arguments[2], ir.IntType(32)(t))
        place, fused = at(0, 1), ["contract"]
        scaled = builder.fmul(factors, builder.load(at(3, 4), align=ENTRY), flags=fused)
        added = builder.fadd(builder.load(place, align=ENTRY), scaled, flags=fused)
        builder.store(added, place, align=ENTRY)
        return context.get_dummy_value()

    return types.void(x, types.uint64, types.float64, y, types.uint64, count), generate


@intrinsic
def products_2(typingctx: Any, A: Any, columns: Any, begin: Any, end: Any, u: Any, ahead: Any) -> Any:
    """Sum A_k u_j, a pair, over the blocks of two begin <= k < end in the columns j; all flat.

    Memory is asked for so many bytes ahead.
    """
    row, block = ir.VectorType(ir.DoubleType(), 2), ir.VectorType(ir.DoubleType(), 4)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        begin, end, ahead = (arguments[t] for t in (2, 3, 5))
        A, columns, u = (
            context.make_array(signature.args[t])(context, builder, arguments[t]).data for t in (0, 1, 4)
        )
        number, lane = begin.type, ir.IntType(32)
        tiled = ir.Constant(ir.VectorType(lane, 4), [0, 1, 0, 1])
        total = cgutils.alloca_once_value(builder, ir.Constant(block, [0.0] * 4))
        with cgutils.for_range(builder, builder.sub(end, begin)) as loop:
            k = builder.add(begin, loop.index)
            j = builder.zext(builder.load(builder.gep(columns, [k])), number)
            at = builder.gep(A, [builder.mul(k, number(4))])
            ask(builder, at, ahead)
            of = builder.gep(u, [builder.mul(j, number(2))])
            x = builder.load(builder.bitcast(of, row.as_pointer()), align=ENTRY)
            a = builder.load(builder.bitcast(at, block.as_pointer()), align=ENTRY)
            x = builder.fmul(a, builder.shuffle_vector(x, x, tiled), flags=["contract"])
            builder.store(builder.fadd(builder.load(total), x, flags=["contract"]), total)
        sums = [builder.extract_element(builder.load(total), lane(t)) for t in range(4)]
        pair = [builder.fadd(sums[0], sums[1]), builder.fadd(sums[2], sums[3])]
        return context.make_tuple(builder, signature.return_type, pair)

    arguments = (A, columns, types.uint64, types.uint64, u, types.int64)
    return types.UniTuple(types.float64, 2)(*arguments), generate


@intrinsic
def add_pair(typingctx: Any, x: Any, i: Any, pair: Any) -> Any:
    """Do x[i] += pair[0] and x[i + 1] += pair[1] in one, so that who reads both next need not wait."""
    row = ir.VectorType(ir.DoubleType(), 2)

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        held = context.make_array(signature.args[0])(context, builder, arguments[0])
        at = builder.bitcast(builder.gep(held.data, [arguments[1]]), row.as_pointer())
        vector = ir.Constant(row, ir.Undefined)
        for t, value in enumerate(cgutils.unpack_tuple(builder, arguments[2])):
            vector = builder.insert_element(vector, value, ir.IntType(32)(t))
        builder.store(builder.fadd(builder.load(at, align=ENTRY), vector), at, align=ENTRY)
        return context.get_dummy_value()

    return types.void(x, types.uint64, pair), generate
