"""How many pixels of a picture stand on an inch of paper, as files say it."""

from __future__ import annotations

from dataclasses import dataclass

from lippmann.job.rig import MM_PER_INCH


@dataclass(frozen=True)
class Density:
    """Pixels an inch."""

    across: float
    down: float

    @classmethod
    def of_pixel(cls, *, width_mm: float, height_mm: float) -> Density:
        """Return the density of pixels of this size."""
        return cls(across=MM_PER_INCH / width_mm, down=MM_PER_INCH / height_mm)

    @property
    def px_per_m(self) -> tuple[int, int]:
        """Whole pixels a metre, (across, down): all that a PNG can say. 600 an inch are 23622 a metre, not 23622.05."""
        return round(self.across / MM_PER_INCH * 1000), round(self.down / MM_PER_INCH * 1000)

    def png_attributes(self) -> dict[str, str | int | float]:
        """Return what OpenImageIO is told: half a pixel more, as it cuts off where it should round."""
        across, down = ((number + 0.5) / 100 for number in self.px_per_m)
        return {"XResolution": across, "YResolution": down, "ResolutionUnit": "cm"}
