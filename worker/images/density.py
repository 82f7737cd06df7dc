"""The density of a picture on paper, as files store it."""

from __future__ import annotations

from dataclasses import dataclass

from lippmann.job.optics.rig import MM_PER_INCH


@dataclass(frozen=True)
class Density:
    """Pixels per inch, in both directions."""

    across: float
    down: float

    @classmethod
    def of_pixel(cls, *, width_mm: float, height_mm: float) -> Density:
        """Return the density of pixels of a size."""
        return cls(across=MM_PER_INCH / width_mm, down=MM_PER_INCH / height_mm)

    @property
    def px_per_m(self) -> tuple[int, int]:
        """Whole pixels per metre, (across, down), as in a PNG: 600 per inch are 23622 per metre, not 23622.05."""
        return round(self.across / MM_PER_INCH * 1000), round(self.down / MM_PER_INCH * 1000)

    def png_attributes(self) -> dict[str, str | int | float]:
        """Return the attributes for OpenImageIO, with half a pixel more, because it truncates instead of rounding."""
        across, down = ((number + 0.5) / 100 for number in self.px_per_m)
        return {"XResolution": across, "YResolution": down, "ResolutionUnit": "cm"}
