"""A channel of a view, such as its normals, written to a file."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import BadInput
from lippmann.job.rendering.channels import CHANNEL_PARTS, channel_attributes, channels_in, objects_in
from lippmann.job.rendering.render_settings import Channel
from lippmann.lightfield.views.square_pixels import nearest_as_square
from lippmann.lightfield.views.views import centre, view
from lippmann.local.files.master import channels_beside, named_rig, whole_picture
from lippmann.local.files.writable import check_writable
from lippmann.plan.sampling import display_size
from worker.exports.netpbm import write_pfm
from worker.images.channel_colours import channel_colours
from worker.images.read import read_attributes
from worker.images.write import write_channels, write_png
from worker.untrusted import read_depth_numbers

SUFFIXES = (".png", ".exr", ".pfm")


@dataclass(frozen=True)
class ChannelView:
    """A channel of a view that was written."""

    number: tuple[int, int]
    """The view, (u, v)."""
    values: NDArray[np.float32]
    """`(row, col, number)`; see `lippmann.job.rendering.channels`."""
    objects: tuple[str, ...]
    """The names of the objects from number 1."""

    @property
    def rows(self) -> int:
        """The pixel rows of the view."""
        return int(self.values.shape[0])

    @property
    def cols(self) -> int:
        """The pixel columns of the view."""
        return int(self.values.shape[1])


def write_channel_view(master: Path, out: Path, channel: Channel, *, number: tuple[int, int] | None) -> ChannelView:
    """Write a channel of a view, one pixel a lens.

    Parameters
    ----------
    master
        An orthoscopic master with the file of its channels beside it, as `channels/0001.exr`.
    out
        A PNG for people, an EXR with the names of the numbers, or a PFM.
    channel
        The channel.
    number
        (u, v) of the view; None for the one nearest to the axes of the lenses.

    Raises
    ------
    BadInput
        If it is another kind of file, cannot be written, or the master has no such channel.
    LayoutError
        If there is no such view, or the channels are not of this layout.
    """
    if out.suffix.lower() not in SUFFIXES:
        raise BadInput(f"expected {', '.join(SUFFIXES)} in --out, got {out}")
    check_writable(out.parent)
    found = channel_of_view(master, channel, number=number)
    suffix, values = out.suffix.lower(), found.values
    if suffix == ".exr":
        said, parts = channel_attributes((channel,), found.objects), CHANNEL_PARTS[channel]
        write_channels(out, (values,), parts, size=(found.rows, found.cols), attributes=said)
    elif suffix == ".pfm":
        write_pfm(out, values[..., 0] if values.shape[2] == 1 else values)
    else:
        write_png(out, channel_colours(channel, values))
    return found


def channel_of_view(master: Path, channel: Channel, *, number: tuple[int, int] | None) -> ChannelView:
    """Read a channel of a view on square pixels, from the nearest lens; see `write_channel_view`.

    Parameters
    ----------
    master
        The master beside which the channels of its frame lie.
    channel
        The channel.
    number
        The view, (u, v); None for the one in the middle.
    """
    if not master.is_file():
        raise BadInput(f"expected an integral image, got {master}: there is no such file")
    layout, file = display_size(named_rig(master)), channels_beside(master)
    attributes: dict[str, str] = {}
    if file.is_file():
        with whole_picture(file):
            attributes = read_attributes(file)
    known = channels_in(attributes)
    if channel not in known:
        got = f"{', '.join(known)} in {file}" if known else f"none: there is no {file}"
        raise BadInput(f"expected a master of a job with {channel} in capture.channels, got {got}")
    u, v = number or centre(layout)
    values = nearest_as_square(view(read_depth_numbers(file, CHANNEL_PARTS[channel]), layout, u, v), layout)
    return ChannelView((u, v), values, objects_in(attributes) if channel == "object" else ())
