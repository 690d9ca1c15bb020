"""Arithmetic on whole blocks: one vector instruction where the compiler, unsure of overlaps, writes many."""

from typing import Any

from llvmlite import ir
from numba import types
from numba.extending import intrinsic

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
