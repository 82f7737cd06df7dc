"""The operations of Dr.Jit on arrays, with which the exact trace runs inside the engine; see `lippmann.lattice.arrays`.

Everything is computed in 64 bits: 32 bits are wrong by up to 7e-3 mm.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import drjit as dr
import mitsuba as mi


class DrJitArrays:
    """The functions of Dr.Jit, for arrays of the variant that is set; see `Arrays`."""

    sqrt = staticmethod(dr.sqrt)
    floor = staticmethod(dr.floor)
    round = staticmethod(dr.round)
    minimum = staticmethod(dr.minimum)
    maximum = staticmethod(dr.maximum)

    def where(self, mask: Any, then: Any, otherwise: Any) -> Any:
        """Return `then` where a mask is true and `otherwise` elsewhere; plain numbers become reals of 64 bits."""
        plain = [isinstance(value, float) for value in (then, otherwise)]
        if all(plain):
            then = mi.Float64(then)
        return dr.select(mask, then, otherwise)

    def whole(self, numbers: Any) -> Any:
        """Return whole numbers as integers."""
        return mi.Int32(numbers)

    def real(self, integers: Any) -> Any:
        """Return integers as real numbers."""
        return mi.Float64(integers)

    def settle(self, step: Callable[[Any], tuple[Any, Any]], start: Any, *, most: int) -> Any:
        """Repeat a step for every number until it is not rough, all in one loop of the compiled code."""

        def body(numbers: Any, _: Any, count: Any) -> tuple[Any, Any, Any]:
            after, is_rough = step(numbers)
            return after, is_rough, count + 1

        is_rough = dr.full(mi.Bool, True, dr.width(start))
        state = (start, is_rough, mi.UInt32(0))
        settled, _, _ = dr.while_loop(state, lambda _, rough, count: rough & (count < most), body)
        return settled
