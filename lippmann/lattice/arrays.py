"""The operations on arrays with which optics are written, so that one text runs on NumPy and inside a render engine.

Besides the operators of Python, the exact trace and the lattice need a few functions. NumPy has them here; the program
of an engine passes those of its own library.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Protocol

import numpy as np


class Arrays(Protocol):
    """The functions of a library of arrays. Real numbers have 64 bits; 32 bits are wrong by micrometres."""

    def sqrt(self, numbers: Any) -> Any:
        """Return square roots."""

    def where(self, mask: Any, then: Any, otherwise: Any) -> Any:
        """Return `then` where a mask is true and `otherwise` elsewhere.

        Parameters
        ----------
        mask
            The mask.
        then
            The numbers where it is true.
        otherwise
            The numbers elsewhere.
        """

    def minimum(self, one: Any, other: Any) -> Any:
        """Return the smaller of two numbers.

        Parameters
        ----------
        one, other
            The numbers, which broadcast with each other.
        """

    def maximum(self, one: Any, other: Any) -> Any:
        """Return the larger of two numbers.

        Parameters
        ----------
        one, other
            The numbers, which broadcast with each other.
        """

    def floor(self, numbers: Any) -> Any:
        """Return the greatest whole numbers that are not above numbers, as real numbers."""

    def round(self, numbers: Any) -> Any:
        """Return the nearest whole numbers as real numbers; of two, the even one."""

    def whole(self, numbers: Any) -> Any:
        """Return real numbers that are whole as integers."""

    def real(self, integers: Any) -> Any:
        """Return integers as real numbers."""

    def settle(self, step: Callable[[Any], tuple[Any, Any]], start: Any, *, most: int) -> Any:
        """Repeat a step until it says that nothing is rough any more, at most so often, and return the last numbers.

        Parameters
        ----------
        step
            Takes the numbers; returns the next ones, and a mask of those that were still rough before.
        start
            The first numbers.
        most
            The greatest number of steps.
        """


class NumpyArrays:
    """The functions of NumPy; see `Arrays`."""

    sqrt = staticmethod(np.sqrt)
    where = staticmethod(np.where)
    minimum = staticmethod(np.minimum)
    maximum = staticmethod(np.maximum)
    floor = staticmethod(np.floor)
    round = staticmethod(np.round)

    def whole(self, numbers: Any) -> Any:
        """Return whole numbers as integers."""
        return np.asarray(numbers).astype(np.intp)

    def real(self, integers: Any) -> Any:
        """Return the integers, with which NumPy computes in 64 bits."""
        return integers

    def settle(self, step: Callable[[Any], tuple[Any, Any]], start: Any, *, most: int) -> Any:
        """Repeat a step for all numbers until none is rough; see `Arrays.settle`."""
        for _ in range(most):
            start, is_rough = step(start)
            if not np.any(is_rough):
                break
        return start


NUMPY: Arrays = NumpyArrays()
