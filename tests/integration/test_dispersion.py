"""Dispersion by the ray camera: white stays white, each band is where the exact trace has it, and so has glass."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.job.spec import JobSpec
from lippmann.optics.rig.bands import WavelengthBand, wavelength_bands
from lippmann.optics.rig.bench import bench, object_rays, pixel_centres_mm
from tests.builders import local_place, rendered, small_job, stored_job
from worker.engines.povray.pictures.pixels import read_codes

HALF_WIDTH_MM = 400.0
"""The target codes x and y from -400 to 400 mm, in red and green."""


def job(scene: str, *, abbe: float | None = 12.0, dispersion: bool = True, **capture: Any) -> JobSpec:
    """Return a job with a lens whose glass disperses more than any real one."""
    surfaces: list[dict[str, Any]] = [
        {"radius_mm": 250, "thickness_mm": 30, "index": 1.6, "abbe": abbe, "semi_aperture_mm": 90},
        {"radius_mm": -400, "index": 1, "semi_aperture_mm": 90},
    ]
    rig = {"imaging_lens": {"surfaces": surfaces}, "dispersion": dispersion}
    more: dict[str, Any] = {"parameters": {"half_width_mm": HALF_WIDTH_MM}} if scene == "target-position" else {}
    return small_job(scene, count=(10, 12), lens_array={"pitch_mm": 6, "focal_length_mm": 20}, rig=rig,
                     capture=capture, **more)  # fmt: skip


def light(folder: Path, spec: JobSpec) -> NDArray[np.float64]:
    place = local_place(folder)
    with rendered(place, stored_job(place, spec), tile=None) as picture:
        return picture.light().astype(np.float64)


def bands_of(spec: JobSpec) -> tuple[WavelengthBand, ...]:
    return wavelength_bands(bench(spec.rig, reference_mm=1000.0), spec.capture.bands)


def band_codes(folder: Path, spec: JobSpec) -> NDArray[np.float64]:
    """Return the red and green of each band, `(band, row, col, 2)`, from 16-bit codes."""
    place = local_place(folder)
    with rendered(place, stored_job(place, spec), tile=None, picture_format="ppm16") as picture:
        codes = read_codes(picture.outcome.picture)[picture.wanted.row_start :]
    codes = codes.reshape(len(picture.weights), -1, *codes.shape[1:])
    return codes[..., :2] / 65535


def traced_codes(spec: JobSpec) -> NDArray[np.float64]:
    points = [object_rays(one.bench, pixel_centres_mm(one.bench)).at_z(-1000.0)[..., :2] for one in bands_of(spec)]
    return (np.array(points) + HALF_WIDTH_MM) / (2 * HALF_WIDTH_MM)


def test_every_band_is_where_the_exact_trace_has_it_and_the_picture_is_their_sum(tmp_path: Path) -> None:
    spec = job("target-position", bands=3)
    expected = traced_codes(spec)
    inside = ((expected > 0) & (expected < 1)).all(axis=(0, -1))
    assert inside.mean() > 0.5
    found = band_codes(tmp_path / "codes", spec)
    assert np.abs(found - expected)[:, inside].max() * 2 * HALF_WIDTH_MM <= 0.1
    assert np.abs(np.diff(expected, axis=0))[:, inside].max() * 2 * HALF_WIDTH_MM > 5, "colours lie apart"
    weights = np.array([band.weights for band in bands_of(spec)])
    together = np.einsum("bc,brsc->rsc", weights[:, :2], expected)
    assert light(tmp_path / "light", spec)[inside][:, :2] == pytest.approx(together[inside], abs=1e-3)


def test_a_white_scene_stays_white(tmp_path: Path) -> None:
    """A band whose rays an aperture stops is dark; all other pixels are exactly white."""
    spec = job("target-white")
    seen = ~np.isnan(traced_codes(spec)).any(axis=(0, -1))
    picture = light(tmp_path, spec)
    assert seen.mean() > 0.5
    assert (picture[seen] == 1.0).all()
    assert picture.max() == 1.0


def test_a_lens_whose_glass_does_not_disperse_gives_the_same_picture_as_without(tmp_path: Path) -> None:
    without = light(tmp_path / "off", job("fish", dispersion=False))
    assert (light(tmp_path / "none", job("fish", abbe=None)) == without).all()
    assert not np.allclose(light(tmp_path / "much", job("fish", bands=3)), without, rtol=0.1, atol=0.01)


POVRAY_HUES = np.array(
    [[0.0383, 0.0], [0.003, 0.0], [0.0, 0.1139], [0.0098, 0.3594], [0.272, 0.3768], [0.4186, 0.1499], [0.2582, 0.0]]
)
"""The shares of POV-Ray 3.7's seven wavelengths in red and green, measured on a white line behind a prism."""


def test_glass_has_the_same_bands_in_its_own_shares(tmp_path: Path) -> None:
    """The two methods differ in the colours that they give the bands, not in the paths of their rays."""
    spec = job("target-position", method="glass")
    found, still = light(tmp_path / "glass", spec), light(tmp_path / "off", job("target-position", dispersion=False))
    white = np.median(light(tmp_path / "white", job("target-white", method="glass")), axis=(0, 1))
    assert white == pytest.approx([1, 1, 1], abs=0.01), "glass tints white by up to a hundredth"
    codes = traced_codes(spec)
    inside = ((codes > 0.02) & (codes < 0.98)).all(axis=(0, -1)) & (found[..., 2] > 0.9)
    assert inside.mean() > 0.5
    expected = np.einsum("bc,brsc->rsc", POVRAY_HUES / POVRAY_HUES.sum(axis=0), codes)
    error_mm = ((found / white)[..., :2] - expected)[inside] * 2 * HALF_WIDTH_MM
    moved_mm = (expected - still[..., :2])[inside] * 2 * HALF_WIDTH_MM
    assert np.abs(error_mm).max() <= 0.5, "half floats have steps of 0.2 and 0.4 mm"
    assert np.abs(moved_mm[..., 0]).max() > 5
