"""A frame whose views can be requested. It is sent to the process that makes its pictures."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from lippmann.job.scenes.stage import Stage
from lippmann.job.spec import JobSpec
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.image import IntegralImage
from lippmann.plan.sampling import display_size


@dataclass(frozen=True)
class ViewableFrame:
    """A frame whose views can be requested."""

    frame: int
    spec: JobSpec
    """The specification of the job at this frame, without keyframes."""
    stage: Stage | None
    """The stage of the scene at this frame; None for imported sheets."""
    sheet_name: str
    """The name of its orthoscopic master in the store."""
    etag: str
    """The entity tag of the master, without quotes."""
    depth_name: str | None = None
    """The name of the master of its true depth in the store; None if it was captured without depth."""

    @property
    def layout(self) -> CellLayout:
        """The cell layout of the orthoscopic sheet."""
        return display_size(self.spec.rig)

    @property
    def gap_mm(self) -> float:
        """The gap of the display, for which all views are computed: one focal length."""
        return self.spec.rig.lens_array.focal_length_mm

    def image(self, pixels: NDArray[np.float16]) -> IntegralImage:
        """Return the integral image of the frame, from the pixels of its orthoscopic master."""
        pitch_mm = self.spec.rig.lens_array.pitch_mm
        return IntegralImage(pixels=pixels, layout=self.layout, pitch_mm=pitch_mm, focal_length_mm=self.gap_mm)
