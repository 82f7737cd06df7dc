"""Makers of data sets made of views: HCI folders, sub-aperture PPMs, NPZ arrays."""

from __future__ import annotations

import json
from collections.abc import Callable, Collection, Iterator, Mapping
from functools import cache, partial
from importlib.metadata import version
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from lippmann.job.outputs.datasets import HciFolder, NpzArrays, SubapertureViews
from lippmann.job.rendering.render_settings import Channel
from lippmann.lightfield.views.light_field import eye_slopes, square_places
from worker.exports.hci_parameters import DISTANCE_MM, Cameras, disparity_range, parameters_cfg
from worker.exports.netpbm import write_pfm, write_ppm
from worker.exports.npz import write_npz
from worker.images.colour import srgb_codes
from worker.images.write import write_png
from worker.tasks.outputs.context import OutputContext
from worker.tasks.outputs.frame_source import FrameSource
from worker.tasks.outputs.frame_views import FrameViews, about_views, each_frame
from worker.tasks.outputs.registry import describes, makes
from worker.tasks.outputs.sidecar import geometry
from worker.whole_file import write_bytes

PLENO_BITS = 10
"""The bits per code of the light fields in JPEG Pleno's Common Test Conditions."""

DISPARITY_STEMS = {"truth": "gt", "estimate": "estimate"}
"""The prefixes of disparity maps: `gt` is the benchmark's word for ground truth, which an estimate is not."""

ABOUT_DEPTH = "(v, u, lens_row, lens_col): depth in the scene and on the display, disparity across and down; else NaN"

ABOUT_CHANNELS: Mapping[Channel, str] = {
    "normal": "unit vector of the surface, on the side of the ray: x right, y up, z to the observer; else NaN",
    "albedo": "diffuse reflectance, linear red, green and blue, 0 to 1; NaN without a surface",
    "object": "number of the object from 1; 0 without a surface",
    "motion": "way of the point of the surface to its place in the next frame, mm: x right, y up, z to the observer",
}
"""The meaning of the channels, for sidecars."""

DisparityMap = Callable[[], NDArray[np.float32]]
Write = Callable[[Path], None]


@makes(HciFolder)
def make_hci(context: OutputContext, output: HciFolder) -> None:
    """Make a folder of the HCI benchmark for every frame."""
    count = len(context.source.frames)
    for number, views in enumerate(each_frame(context, output)):
        # An estimate takes up to a minute, and there may be one for every view.
        files = list(_hci_files(views, output))
        for name, write in context.part(number, count).with_progress(files, len(files)):
            context.store_file(f"{views.stem}/{name}", write)


def _hci_files(views: FrameViews, output: HciFolder) -> Iterator[tuple[str, Write]]:
    """Yield the name of each file of a folder, with the function that writes it."""
    for number, place in enumerate(np.ndindex(views.block.rows, views.block.cols)):
        yield f"input_Cam{number:03d}.png", partial(_write_png, views=views, place=place)
    maps = _disparity_maps(views, output)
    for name, disparity in maps.items():
        yield f"{name.format('disp')}.pfm", partial(_write_disparity, disparity=disparity)
        yield f"{name.format('depth')}.pfm", partial(_write_depth, views, disparity)
    for channel in views.source.channels:
        for name, number in _mapped_views(views, output, f"{channel}_lowres").items():
            yield f"{name}.pfm", partial(_write_channel, views=views, channel=channel, number=number)
    if "object" in views.source.channels:
        yield "objects.json", partial(_write_objects, views=views)
    yield "parameters.cfg", partial(_write_parameters, views, maps.values())


@describes(HciFolder)
def about_hci(source: FrameSource, output: HciFolder) -> Mapping[str, Any]:
    """Describe HCI folders for the sidecar."""
    return {
        **about_views(source, output),
        "cameras": "input_Cam000 is the upper left view; numbers grow along the row to the right, then downward",
        "middle_camera": f"input_Cam{output.block(source.rig(source.frames[0])).middle:03d}",
        "codes": "sRGB, 8 bits",
        "disparity": _about_disparity(source, output),
        **({"channels": _about_channels(source)} if source.channels else {}),
        "parameters_cfg": f"parallel views, told as those of cameras {DISTANCE_MM:g} mm before the display",
    }


@makes(SubapertureViews)
def make_subaperture_ppm(context: OutputContext, output: SubapertureViews) -> None:
    """Make a folder of 10-bit PPMs for every frame."""
    count = len(context.source.frames)
    for number, views in enumerate(each_frame(context, output)):
        places = [*np.ndindex(views.block.rows, views.block.cols)]
        for v, u in context.part(number, count).with_progress(places, len(places)):
            context.store_file(f"{views.stem}/{u:03d}_{v:03d}.ppm", partial(_write_ppm, views=views, place=(v, u)))


@describes(SubapertureViews)
def about_subaperture_ppm(source: FrameSource, output: SubapertureViews) -> Mapping[str, Any]:
    """Describe sub-aperture PPMs for the sidecar."""
    return {
        **about_views(source, output),
        "names": "<col>_<row>.ppm: the first number grows as the eye moves to the right, the second as it moves down",
        "codes": f"sRGB, {PLENO_BITS} bits, highest {2**PLENO_BITS - 1}, two bytes, the high one first",
    }


@makes(NpzArrays)
def make_npz(context: OutputContext, output: NpzArrays) -> None:
    """Make an NPZ of every frame."""
    for views in each_frame(context, output):
        context.store_file(f"{views.stem}{output.suffix}", partial(_write_arrays, views=views, output=output))


@describes(NpzArrays)
def about_npz(source: FrameSource, output: NpzArrays) -> Mapping[str, Any]:
    """Describe NPZ arrays for the sidecar."""
    light = "linear light" if output.dtype.startswith("float") else "sRGB codes"
    return {
        **about_views(source, output),
        "views": f"(v, u, lens_row, lens_col, channel), {output.dtype}, {light}",
        "exists": "(v, u): which views have a pixel under the lens; the others are NaN, or 0 in whole numbers",
        "right_pitches, down_pitches": "(lens_row, lens_col): where they lie, from the array's middle",
        **({"z_mm, s_mm, disparity_u, disparity_v": ABOUT_DEPTH} if source.has_depth else {}),
        **_about_channels(source),
        "slope_right, slope_down": "(u) and (v): tangent of the eye's direction, to the right and downward",
        "meta_json": "what this file says, of the one frame",
    }


def _write_png(path: Path, *, views: FrameViews, place: tuple[int, ...]) -> None:
    write_png(path, views.square[place])


def _write_ppm(path: Path, *, views: FrameViews, place: tuple[int, ...]) -> None:
    write_ppm(path, srgb_codes(views.square[place], bits=PLENO_BITS), bits=PLENO_BITS)


def _disparity_maps(views: FrameViews, output: HciFolder) -> dict[str, DisparityMap]:
    """Return functions that compute the disparity maps, by the names of their files, such as `gt_{}_lowres`."""
    disparity = _disparity_source(views.source, output)
    if disparity == "none":
        return {}
    find = cache(views.true_disparity if disparity == "truth" else views.estimated_disparity)
    stem = f"{DISPARITY_STEMS[disparity]}_{{}}_lowres"
    return {name: partial(find, number) for name, number in _mapped_views(views, output, stem).items()}


def _mapped_views(views: FrameViews, output: HciFolder, stem: str) -> dict[str, int]:
    """Return the views for which there are maps, by the names of their files: the middle one, or all."""
    every = range(len(views.block.numbers)) if output.disparity_of == "all" else ()
    return {stem: views.block.middle, **{f"{stem}_Cam{number:03d}": number for number in every}}


def _disparity_source(source: FrameSource, output: HciFolder) -> Literal["truth", "estimate", "none"]:
    return output.disparity or ("truth" if source.has_depth else "none")


def _about_disparity(source: FrameSource, output: HciFolder) -> str | None:
    disparity = _disparity_source(source, output)
    if disparity == "none":
        return None
    stem = DISPARITY_STEMS[disparity]
    how = {"truth": "by exact rays; NaN where no surface is seen", "estimate": "estimated from the pictures"}[disparity]
    return (
        f"{stem}_disp_lowres.pfm is the middle camera's: px (lenses) from a view to the next on the right, positive in"
        f" front of the display, {how}. {stem}_depth_lowres.pfm is what the"
        " benchmark's formula makes of it, in metres from the cameras"
    )


def _write_disparity(path: Path, *, disparity: DisparityMap) -> None:
    write_pfm(path, disparity())


def _write_channel(path: Path, *, views: FrameViews, channel: Channel, number: int) -> None:
    write_pfm(path, views.channel_view(channel, number))


def _write_objects(path: Path, *, views: FrameViews) -> None:
    names = {str(number): name for number, name in enumerate(views.source.objects(views.frame), start=1)}
    write_bytes(path, json.dumps(names, indent=2, ensure_ascii=False).encode() + b"\n")


def _about_channels(source: FrameSource) -> dict[str, str]:
    """Describe the channels that the frames have."""
    return {channel: ABOUT_CHANNELS[channel] for channel in source.channels}


def _write_depth(views: FrameViews, disparity: DisparityMap, path: Path) -> None:
    write_pfm(path, _cameras(views).depth_m(disparity()))


def _write_parameters(views: FrameViews, maps: Collection[DisparityMap], path: Path) -> None:
    disparities = disparity_range(disparity() for disparity in maps)
    write_bytes(path, parameters_cfg(_cameras(views, disparities)).encode())


def _cameras(views: FrameViews, disparities: tuple[float, float] = (0.0, 0.0)) -> Cameras:
    source, array = views.source, views.source.rig(views.frame).lens_array
    rows, cols = source.layout.square_size()
    return Cameras(
        rows_px=rows,
        cols_px=cols,
        views_down=views.block.rows,
        views_across=views.block.cols,
        pitch_mm=array.pitch_mm,
        pixel_mm=array.pitch_mm / source.layout.px_per_lens,
        gap_mm=array.focal_length_mm,
        scene=source.facts.get("scene", ""),
        category="lippmann",
        version=version("lippmann"),
        disparities=disparities,
    )


def _write_arrays(path: Path, *, views: FrameViews, output: NpzArrays) -> None:
    source, layout, square = views.source, views.source.layout, output.pixels == "square"
    array = source.rig(views.frame).lens_array
    right, down = square_places(layout) if square else layout.lenses.centres()
    slope_right, slope_down = eye_slopes(layout, gap_in_pitches=array.focal_length_mm / array.pitch_mm)
    meta = {
        "frame": views.frame,
        "output": output.model_dump(mode="json"),
        "source": dict(source.facts),
        "format": about_npz(source, output),
        "integral_image": geometry(source, views.frame),
        **({"objects": list(source.objects(views.frame))} if "object" in source.channels else {}),
    }
    arrays = {
        "views": _as_dtype(views.square if square else views.of_lenses, views.exists, output.dtype),
        "exists": views.exists,
        **views.numbers(is_square=square),
        "right_pitches": right,
        "down_pitches": down,
        "slope_right": slope_right[views.cols],
        "slope_down": slope_down[views.rows],
        "meta_json": np.array(json.dumps(meta)),
    }
    write_npz(path, arrays, compress=output.compress)


def _as_dtype(views: NDArray[np.float16], exists: NDArray[np.bool_], dtype: str) -> NDArray[Any]:
    if dtype.startswith("uint"):
        bits = np.dtype(dtype).itemsize * 8
        return srgb_codes(views.reshape(-1, *views.shape[3:]), bits=bits).reshape(views.shape)
    light = np.array(views, dtype=dtype, order="C")
    light[~exists] = np.nan
    return light
