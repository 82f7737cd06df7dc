"""The channels that are stored beside the colours and the depth: their names in files, and the numbers of nothing.

All of them are kept in one file of a frame, `channels/0001.exr`, pixel for pixel with the orthoscopic integral image.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence

from lippmann.job.rendering.render_settings import Capture, Channel

CHANNEL_PARTS: Mapping[Channel, tuple[str, ...]] = {
    "normal": ("normal.X", "normal.Y", "normal.Z"),
    "albedo": ("albedo.R", "albedo.G", "albedo.B"),
    "object": ("object.id",),
    "motion": ("motion.X", "motion.Y", "motion.Z"),
}
"""The names of the numbers of each stored channel, in an array and in a file."""

NOTHING: Mapping[Channel, float] = {"normal": math.nan, "albedo": math.nan, "object": 0.0, "motion": math.nan}
"""The number of a channel where a pixel shows no surface or has no ray."""

CHANNELS_ATTRIBUTE, OBJECTS_ATTRIBUTE = "channels", "objects"
"""The header attributes of such a file: its channels, and the names of the objects from number 1, as JSON lists."""


def stored_channels(capture: Capture) -> tuple[Channel, ...]:
    """Return the channels of a capture that are stored beside its depth, in the order of `CHANNEL_PARTS`.

    >>> stored_channels(Capture(channels=("object", "depth", "normal")))
    ('normal', 'object')
    """
    return tuple(channel for channel in CHANNEL_PARTS if channel in capture.channels)


def part_names(channels: Iterable[Channel]) -> tuple[str, ...]:
    """Return the names of the numbers of several channels, one after the other.

    >>> part_names(("object", "albedo"))
    ('object.id', 'albedo.R', 'albedo.G', 'albedo.B')
    """
    return tuple(part for channel in channels for part in CHANNEL_PARTS[channel])


def channel_attributes(channels: Sequence[Channel], objects: Sequence[str]) -> dict[str, str]:
    """Return the header attributes of a file of channels.

    >>> channel_attributes(("object",), ("fish",))
    {'channels': '["object"]', 'objects': '["fish"]'}
    """
    named = {OBJECTS_ATTRIBUTE: json.dumps(list(objects), ensure_ascii=False)} if "object" in channels else {}
    return {CHANNELS_ATTRIBUTE: json.dumps(list(channels)), **named}


def channels_in(attributes: Mapping[str, str]) -> tuple[Channel, ...]:
    """Return the channels that a header names; none if it names none.

    >>> channels_in({"channels": '["object", "smell"]'}), channels_in({"channels": "[["}), channels_in({})
    (('object',), (), ())
    """
    listed = _listed(attributes.get(CHANNELS_ATTRIBUTE))
    return tuple(channel for channel in CHANNEL_PARTS if channel in listed)


def objects_in(attributes: Mapping[str, str]) -> tuple[str, ...]:
    """Return the names of the objects that a header names, from number 1.

    >>> objects_in({"objects": '["fish", "water"]'})
    ('fish', 'water')
    """
    return tuple(name for name in _listed(attributes.get(OBJECTS_ATTRIBUTE)) if isinstance(name, str))


def _listed(text: str | None) -> list[object]:
    try:
        found = json.loads(text or "[]")
    except (ValueError, RecursionError):
        return []
    return found if isinstance(found, list) else []
