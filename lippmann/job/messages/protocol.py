"""The version of the messages between service and workers, and which versions understand each other.

A field that is added needs no new version: whoever does not know it ignores it. The version grows when a message gets
another meaning, so that a worker of before would do the wrong thing.
"""

from __future__ import annotations

PROTOCOL = 1
"""The version of the messages of this release."""
OLDEST_PROTOCOL = 1
"""The oldest version that this release understands."""


def understand_each_other(one: tuple[int, int], other: tuple[int, int]) -> bool:
    """Return whether two sides understand each other, each by its version and the oldest one that it understands.

    >>> understand_each_other((3, 2), (2, 1))
    True
    >>> understand_each_other((3, 3), (2, 1))
    False
    """
    return one[0] >= other[1] and other[0] >= one[1]
