"""The views of one frame that a data set has: computed once, when they are first read."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from lippmann.job.outputs.datasets import ViewsOptions
from lippmann.job.outputs.view_block import ViewBlock
from lippmann.job.rendering.channels import NOTHING
from lippmann.job.rendering.render_settings import Channel
from lippmann.lightfield.depth.depth_map import CHANNELS, DepthMap
from lippmann.lightfield.depth.view_depth import estimated_depth
from lippmann.lightfield.image import IntegralImage
from lippmann.lightfield.views.light_field import (
    all_views,
    light_field,
    nearest_on_square_pixels,
    on_square_pixels,
)
from lippmann.lightfield.views.square_pixels import nearest_as_square
from lippmann.lightfield.views.views import view
from lippmann.plan import artifact_names as names
from worker.tasks.outputs.context import OutputContext
from worker.tasks.outputs.frame_source import FrameSource


@dataclass(frozen=True)
class FrameViews:
    """A block of the views of a frame."""

    source: FrameSource
    frame: int
    block: ViewBlock

    @property
    def stem(self) -> str:
        """The number of the frame as it is written in names."""
        return names.frame_stem(self.frame)

    @property
    def rows(self) -> slice:
        """The slice of the block among all v."""
        return slice(self.block.first_v, self.block.first_v + self.block.rows)

    @property
    def cols(self) -> slice:
        """The slice of the block among all u."""
        return slice(self.block.first_u, self.block.first_u + self.block.cols)

    @property
    def exists(self) -> NDArray[np.bool_]:
        """A mask `(v, u)` of the views that have a pixel in the cell."""
        return self.source.layout.mask[self.rows, self.cols]

    @cached_property
    def of_lenses(self) -> NDArray[np.float16]:
        """The views with one pixel per lens, `(v, u, lens_row, lens_col, 3)`, linear light; missing views are zero."""
        return light_field(self._image)[self.rows, self.cols].astype(np.float16, copy=False)

    @cached_property
    def square(self) -> NDArray[np.float16]:
        """The views on square pixels, `(v, u, row, col, 3)`, linear light."""
        return on_square_pixels(self.of_lenses, self.source.layout).astype(np.float16, copy=False)

    def true_disparity(self, number: int) -> NDArray[np.float32]:
        """Return the true disparity of a view of the block, counted row by row, `(row, col)` on square pixels.

        In pixels of a view, from this view to the next on the right, positive in front of the display: on the left
        there. Of the nearest lens, so that no two depths are mixed; NaN where no surface is seen.

        Raises
        ------
        OutputError
            If the job did not ask for depth.
        """
        u, v = self.block.numbers[number]
        found = self._depth.view(self.source.layout, u, v).disparity_u[..., np.newaxis]
        return nearest_as_square(found, self.source.layout)[..., 0]

    def estimated_disparity(self, number: int) -> NDArray[np.float32]:
        """Return the disparity of a view as estimated from the pictures; see `lippmann.lightfield.depth.view_depth`."""
        return estimated_depth(self._image, self.block.numbers[number]).disparity

    def channel_view(self, channel: Channel, number: int) -> NDArray[np.float32]:
        """Return a channel of a view of the block, counted row by row, `(row, col)` or `(row, col, 3)`.

        On square pixels, from the nearest lens, so that no two surfaces are mixed; see `FrameSource.channel`.
        """
        layout = self.source.layout
        found = nearest_as_square(view(self._channel(channel), layout, *self.block.numbers[number]), layout)
        return found[..., 0] if found.shape[2] == 1 else found

    def numbers(self, *, is_square: bool) -> dict[str, NDArray[np.float32]]:
        """Return the depth and the channels that the job has, of all views of the block, by name.

        Parameters
        ----------
        is_square
            True for square pixels, from the nearest lens.

        Returns
        -------
        dict
            `(v, u, row, col)` each, or `(v, u, row, col, 3)`: those of `depth_map.CHANNELS` and of `job.channels`. NaN,
            or object 0, where a view does not exist.
        """
        found: dict[str, NDArray[np.float32]] = {}
        if self.source.has_depth:
            depth = self._views_of(self._depth.values, np.nan, is_square=is_square)
            found = {name: np.ascontiguousarray(depth[..., k]) for k, name in enumerate(CHANNELS)}
        for channel in self.source.channels:
            values = self._views_of(self._channel(channel), NOTHING[channel], is_square=is_square)
            found[channel] = values[..., 0] if values.shape[4] == 1 else values
        return found

    def _views_of(self, sheet: NDArray[np.float32], nothing: float, *, is_square: bool) -> NDArray[np.float32]:
        views = all_views(sheet, self.source.layout)[self.rows, self.cols]
        if is_square:
            views = nearest_on_square_pixels(views, self.source.layout)
        shown = self.exists[..., np.newaxis, np.newaxis, np.newaxis]
        return np.where(shown, views, np.float32(nothing))

    def _channel(self, channel: Channel) -> NDArray[np.float32]:
        if channel not in self._channels:
            self._channels[channel] = self.source.channel(self.frame, channel)
        return self._channels[channel]

    @cached_property
    def _channels(self) -> dict[Channel, NDArray[np.float32]]:
        return {}

    @cached_property
    def _image(self) -> IntegralImage:
        return self.source.image(self.frame)

    @cached_property
    def _depth(self) -> DepthMap:
        return self.source.depth(self.frame)


def each_frame(context: OutputContext, output: ViewsOptions) -> Iterator[FrameViews]:
    """Yield the views of every frame, and report the progress.

    Raises
    ------
    Stopped
        Between two frames, if the work should end.
    """
    source = context.source
    for frame in context.with_progress(source.frames, len(source.frames)):
        yield FrameViews(source, frame, output.block(source.rig(frame)))


def about_views(source: FrameSource, output: ViewsOptions) -> dict[str, Any]:
    """Describe the block of views for the sidecar."""
    block = output.block(source.rig(source.frames[0]))
    return {
        "views_down": block.rows,
        "views_across": block.cols,
        "first_view": {"u": block.first_u, "v": block.first_v},
        "missing_views": [[u, v] for u, v in block.numbers if not source.layout.mask[v, u]],
        "view_size_px": list(source.layout.square_size()),
    }
