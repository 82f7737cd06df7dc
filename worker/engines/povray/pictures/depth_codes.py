"""Convert the codes of a depth pass to distances: the inverse of lippmann/depth.inc."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from worker.engines.povray.scene import FAR

TOP = 65535
MARK = 0.618
"""The share of the fog's amplitude in the blue channel where there was fog."""

CLOSE_CODES = 2
"""The tolerance of blue around `MARK`, in codes: two roundings."""

FOGGY = 0.5
"""The amplitude of our fog, which is added to the scene's own fog below this light and subtracted from it above."""


@dataclass(frozen=True)
class FogLight:
    """The light of our fog alone, as fractions of its amplitude, `(row, col, 3)`."""

    fraction: NDArray[np.float64]
    quantum: float
    """The step of the fractions."""

    @property
    def is_whole(self) -> bool:
        """True if there was fog along every ray."""
        return bool((np.abs(self.fraction[..., 2] - MARK) <= CLOSE_CODES * self.quantum).all())

    def distance_mm(self, *, near_mm: float) -> NDArray[np.float64]:
        """Return the distance at which each ray meets a surface, `(row, col)`, mm; NaN where it meets none.

        With transmittance T = exp(-d / D) in steps of q, the step of d is q D / T; the finer of the two scales
        is used.

        Parameters
        ----------
        near_mm
            The distance D of the first scale, mm.
        """
        scales_mm = near_mm * np.array([1.0, FAR])
        transmitted = np.clip(1.0 - self.fraction[..., :2], 0.5 * self.quantum, 1.0)
        found_mm, step_mm = -scales_mm * np.log(transmitted), scales_mm / transmitted
        finer = np.argmin(step_mm, axis=-1)[..., np.newaxis]
        distance_mm = np.take_along_axis(found_mm, finer, axis=-1)[..., 0]
        return np.where(transmitted[..., 1] <= self.quantum, np.nan, distance_mm)


def fog_light(codes: NDArray[np.uint16]) -> FogLight:
    """Return the light of fog of amplitude 1 in a scene without fog."""
    return FogLight(codes / TOP, 1 / TOP)


def fog_light_among_others(
    without: NDArray[np.uint16], added: NDArray[np.uint16], taken: NDArray[np.uint16]
) -> FogLight:
    """Return the light of our fog in a scene with fog of its own, which POV-Ray adds to it.

    Parameters
    ----------
    without, added, taken
        Codes `(row, col, 3)` with our fog at amplitude 0, `FOGGY` and -`FOGGY`: a code has no light below 0 or above 1.
    """
    own = without / TOP
    light = np.where(own < FOGGY, added / TOP - own, own - taken / TOP)
    return FogLight(light / FOGGY, 1 / (TOP * FOGGY))
