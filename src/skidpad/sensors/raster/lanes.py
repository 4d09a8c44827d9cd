"""LANES pixels of a span at once, for spans too short for what a compiler makes of a loop."""

from __future__ import annotations

from typing import Any

from llvmlite import ir
from numba.core import types
from numba.extending import intrinsic

LANES = 16
_FLOAT, _INT = ir.FloatType(), ir.IntType(32)
_FLOATS, _INTS = ir.VectorType(_FLOAT, LANES), ir.VectorType(_INT, LANES)


def _fill_lanes(b: Any, value: Any, kind: Any) -> Any:
    """Returns a vector whose lanes all have the value."""
    unset = ir.Constant(kind, ir.Undefined)
    first = b.insert_element(unset, value, ir.Constant(_INT, 0))
    return b.shuffle_vector(first, unset, ir.Constant(_INTS, [0] * LANES))


def _emit(context: Any, b: Any, signature: Any, args: Any) -> Any:
    """Writes the code of `draw_lanes`."""
    inverse, seen, at, done, count, start, step, value, limit = args
    depths, keys = (
        context.make_array(kind)(context, b, array).data
        for kind, array in zip(signature.args, (inverse, seen), strict=False)
    )
    depths = b.bitcast(b.gep(depths, [at]), _FLOATS.as_pointer())
    keys = b.bitcast(b.gep(keys, [at]), _INTS.as_pointer())
    lane = ir.Constant(_INTS, list(range(LANES)))
    pixel = b.add(lane, _fill_lanes(b, b.trunc(done, _INT), _INTS))
    inside = b.icmp_signed("<", pixel, _fill_lanes(b, b.trunc(count, _INT), _INTS))
    offset = b.fmul(_fill_lanes(b, step, _FLOATS), b.sitofp(pixel, _FLOATS))
    w, before = b.fadd(_fill_lanes(b, start, _FLOATS), offset), b.load(depths, align=4)
    near = b.and_(b.fcmp_ordered(">=", w, before), inside)
    bits = ir.IntType(LANES)
    with b.if_then(b.icmp_unsigned("!=", b.bitcast(near, bits), ir.Constant(bits, 0))):
        shown = b.load(keys, align=4)
        goes_first = b.icmp_signed("<", _fill_lanes(b, limit, _INTS), shown)
        wins = b.and_(near, b.or_(b.fcmp_ordered(">", w, before), goes_first))
        b.store(b.select(wins, w, before), depths, align=4)
        b.store(b.select(wins, _fill_lanes(b, value, _INTS), shown), keys, align=4)
    return context.get_dummy_value()


@intrinsic  # type: ignore[untyped-decorator]
def draw_lanes(
    _typing: Any,
    inverse: Any,
    seen: Any,
    at: Any,
    done: Any,
    count: Any,
    start: Any,
    step: Any,
    value: Any,
    limit: Any,
) -> Any:
    """Draws pixels `done` to done + LANES - 1 of a span of `count` where they are nearest.

    inverse, seen: as in `Canvas`; at: row of them of the pixel `done`, behind which LANES rows follow.
    start, step: float32 inverse depth of the span's first pixel, and what the next ones have more.
    value, limit: int32, as in `fill`.
    """
    kinds = (inverse, seen, at, done, count, start, step, value, limit)
    return types.void(*kinds), _emit
