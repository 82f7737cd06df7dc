"""The integral image of the Python API: arrays and files in, views and refocused pictures out.

    from lippmann import IntegralImage

    image = IntegralImage.open("out/orthoscopic/0001.exr")
    image.views()           # (v, u, lens_row, lens_col, channel)
    image.refocus(38.0)     # (row, col, channel)

Depths are those of the display: millimetres from the lens array, positive in front of it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal, Self

import numpy as np
from numpy.typing import NDArray

from lippmann.errors import BadInput, LayoutError
from lippmann.job.optics.rig import Rig
from lippmann.job.optics.viewing import EYES_APART_MM, PUPIL_MM, RAYS, SIZE_PX, Stereo
from lippmann.job.scenes.imported_sheets import SUFFIXES
from lippmann.lattice.cell import Lattice
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield import image as lightfield
from lippmann.lightfield.depth.plane_sweep import REACH
from lippmann.lightfield.depth.view_depth import Method, ViewDepth, estimated_depth, true_depth
from lippmann.lightfield.observer.display import LensDisplay
from lippmann.lightfield.observer.observe import whole_window
from lippmann.lightfield.observer.viewing_conditions import ViewingConditions, observed_picture
from lippmann.lightfield.observer.window import Window
from lippmann.lightfield.refocus.all_in_focus import all_in_focus
from lippmann.lightfield.refocus.ciir import ciir_stack
from lippmann.lightfield.refocus.depth_focused_view import depth_focused_view
from lippmann.lightfield.refocus.shift_and_sum import focal_stack
from lippmann.lightfield.views.epi import epi_of_col, epi_of_row
from lippmann.lightfield.views.light_field import light_field, on_square_pixels
from lippmann.lightfield.views.perspective import Eye, inside_cells, perspective, places_px
from lippmann.lightfield.views.square_pixels import as_square
from lippmann.lightfield.views.views import centre, interlace, view, view_numbers
from lippmann.local.files.image_files import preview_png, save_image
from lippmann.local.files.master import depth_beside, read_depth, read_master, rig_in
from lippmann.plan.design.observed_display import observed_display
from worker.images.colour import linear_light
from worker.untrusted import read_imported

Light = NDArray[np.floating[Any]]
Place = Eye | tuple[float, float, float]
"""An eye: millimetres to the right of the middle of the display, upward, and in front of it."""

RefocusMethod = Literal["shift_and_sum", "ciir"]

PITCH_MM, FOCAL_LENGTH_MM = 1.0, 3.3
"""The microlens array of Athineos et al. 2006, which is the default of a job's rig."""

REPR_PX = 640
"""The longer side of the picture that a notebook shows of an image."""


@dataclass(frozen=True, eq=False, kw_only=True)
class IntegralImage(lightfield.IntegralImage):
    """An integral image: its pixels, the lenses over them, and everything that is computed from them.

    Open a file with `open`, or make an image from an array with `from_array` or `from_views`. Every method but
    `orthoscopic`, `observe` and `save` needs an orthoscopic image and refuses a pseudoscopic one; `orthoscopic()`
    converts it. A method that returns a picture returns `(row, col, channel)` in linear light on square pixels.

    Parameters
    ----------
    rig
        The rig that captured the image, if the header of its file names one.

    See Also
    --------
    lippmann.lightfield.image.IntegralImage : the other fields, and the errors.
    """

    rig: Rig | None = field(default=None, repr=False)

    @classmethod
    def open(
        cls,
        path: str | Path,
        *,
        layout: CellLayout | None = None,
        pitch_mm: float = PITCH_MM,
        focal_length_mm: float = FOCAL_LENGTH_MM,
        pseudoscopic: bool = False,
        inverted: bool = False,
        linear: bool = False,
        with_depth: bool = False,
    ) -> Self:
        """Open an integral image.

        The header of a master (EXR) names its lenses. Every other picture needs a layout: an EXR or PFM of linear
        light, or a PNG, TIFF, JPEG or PPM, whose colour space is the one that the file names, else sRGB.

        Parameters
        ----------
        path
            A master as `orthoscopic/0001.exr`, `integral/0001.exr` (pseudoscopic) or `device/0001.exr` (resampled to
            whole cells), or another picture.
        layout
            The lenses over a picture whose header names no rig.
        pitch_mm, focal_length_mm
            The lenses of such a picture, mm; by default those of Athineos et al. 2006.
        pseudoscopic, inverted
            Whether such a picture is pseudoscopic, and whether an imaging lens turned it upside down.
        linear
            True to take the codes of such a picture for linear light, whatever the file says.
        with_depth
            True to read the depth of the pixels too, if it is stored beside the master as `depth/0001.exr`.

        Raises
        ------
        BadInput
            If there is no such file, it is no integral image, or nothing names its lenses.
        LayoutError
            If the pixels do not divide among the lenses.
        ArtifactBroken
            If the file is damaged.
        """
        file = Path(path)
        if not file.is_file():
            raise BadInput(f"expected an integral image, got {file}: there is no such file")
        if file.suffix.lower() not in SUFFIXES:
            raise BadInput(f"expected an integral image as {', '.join(SUFFIXES)}, got {file}")
        rig = rig_in(file) if file.suffix.lower() == ".exr" else None
        if rig is not None:
            if layout is not None:
                raise BadInput(f"expected no layout, as the header of {file} names the lenses, got {layout}")
            return cls._of_master(file, with_depth=with_depth)
        if layout is None:
            raise BadInput(
                f"{file}: expected a master (EXR) whose header names its rig, or a layout of the lenses, got neither;"
                " `lippmann import` makes such a master"
            )
        return cls(
            pixels=read_imported(file, linear=linear),
            layout=layout, pitch_mm=pitch_mm, focal_length_mm=focal_length_mm,
            pseudoscopic=pseudoscopic, inverted=inverted,
        )  # fmt: skip

    @classmethod
    def _of_master(cls, file: Path, *, with_depth: bool) -> Self:
        master, depth = read_master(file), depth_beside(file)
        array, orthoscopic = master.rig.lens_array, not master.pseudoscopic
        return cls(
            pixels=master.pixels,
            layout=master.layout,
            pitch_mm=array.pitch_mm,
            focal_length_mm=array.focal_length_mm,
            pseudoscopic=master.pseudoscopic,
            inverted=master.inverted,
            depth_map=read_depth(depth) if with_depth and orthoscopic and depth.is_file() else None,
            rig=master.rig,
        )

    @classmethod
    def from_array(
        cls,
        pixels: NDArray[Any],
        *,
        layout: CellLayout | None = None,
        px_per_lens: int | None = None,
        lattice: Lattice = "square",
        pitch_mm: float = PITCH_MM,
        focal_length_mm: float = FOCAL_LENGTH_MM,
        pseudoscopic: bool = False,
        inverted: bool = False,
    ) -> Self:
        """Make an integral image from an array.

        Parameters
        ----------
        pixels
            `(rows, cols, channel)` or `(rows, cols)`: floating numbers are linear light, uint8 and uint16 are sRGB
            codes, which are decoded.
        layout
            The lenses over the pixels.
        px_per_lens, lattice
            The pixels across a lens and the lattice, in place of a layout: the lenses fill the array.
        pitch_mm, focal_length_mm
            The lenses, mm; by default those of Athineos et al. 2006.
        pseudoscopic, inverted
            Whether the image is pseudoscopic, and whether an imaging lens turned it upside down.

        Raises
        ------
        LayoutError
            If the pixels do not divide among the lenses, or neither or both of `layout` and `px_per_lens` are given.
        """
        if (layout is None) == (px_per_lens is None):
            raise LayoutError("expected either a layout or px_per_lens")
        shaped = pixels[..., np.newaxis] if pixels.ndim == 2 else pixels
        light = linear_light(shaped) if shaped.dtype in (np.uint8, np.uint16) else shaped
        return cls(
            pixels=light, layout=layout or _filling(light, px_per_lens or 1, lattice), pitch_mm=pitch_mm,
            focal_length_mm=focal_length_mm, pseudoscopic=pseudoscopic, inverted=inverted,
        )  # fmt: skip

    @classmethod
    def from_views(
        cls,
        views: NDArray[np.floating[Any]],
        *,
        layout: CellLayout | None = None,
        pitch_mm: float = PITCH_MM,
        focal_length_mm: float = FOCAL_LENGTH_MM,
    ) -> Self:
        """Interlace views into an orthoscopic integral image; the inverse of `views`.

        Parameters
        ----------
        views
            `(v, u, lens_row, lens_col, channel)`, floating, linear light: v grows as the eye moves down, u as it moves
            to the right. On the square lattice there are as many rows of views as columns.
        layout
            The lenses, which must be given for a hexagonal lattice; views that do not exist there are ignored.
        pitch_mm, focal_length_mm
            The lenses, mm; by default those of Athineos et al. 2006.

        Raises
        ------
        LayoutError
            If the views are not those of such a layout.
        """
        if views.ndim != 5:
            raise LayoutError(f"expected views (v, u, lens_row, lens_col, channel), got an array of {views.shape}")
        vs, us, lens_rows, lens_cols, channels = views.shape
        found = layout or CellLayout(lens_rows, lens_cols, us)
        if (vs, us, lens_rows, lens_cols) != (found.cell_rows, found.cell_cols, found.lens_rows, found.lens_cols):
            raise LayoutError(
                f"expected {found.cell_cols} x {found.cell_rows} views of {found.lens_cols} x {found.lens_rows} lenses"
                f" for {found}, got {us} x {vs} of {lens_cols} x {lens_rows}"
            )
        grid = views.transpose(0, 2, 1, 3, 4).reshape(vs * lens_rows, us * lens_cols, channels)
        return cls(pixels=interlace(grid, found), layout=found, pitch_mm=pitch_mm, focal_length_mm=focal_length_mm)

    @property
    def view_numbers(self) -> tuple[tuple[int, int], ...]:
        """The (u, v) of every view that exists, by rows; on the square lattice all of them exist."""
        return view_numbers(self.layout)

    @property
    def centre(self) -> tuple[int, int]:
        """The (u, v) of the view nearest to the axes of the lenses."""
        return centre(self.layout)

    def view(self, u: int | None = None, v: int | None = None) -> Light:
        """Return one view (sub-aperture view) on square pixels; by default the one nearest to the axes of the lenses.

        Parameters
        ----------
        u, v
            The number of the view: u from the left eye to the right, v from the top down.

        Raises
        ------
        LayoutError
            If there is no such view, only one of `u` and `v` is given, or the image is pseudoscopic.
        """
        self.check_orthoscopic()
        return as_square(view(self.pixels, self.layout, *self._view_number(u, v)), self.layout)

    def views(self, *, square_pixels: bool = False) -> Light:
        """Return all views as one array.

        On the square lattice `views()[v, u]` is `view(u, v)`. On the hexagonal lattice the views are sampled on the
        lenses, every other row of which stands half a lens further right, and the views of the corners of the cell's
        box, in which there is no pixel of the lens, are zero; `views(square_pixels=True)[v, u]` is `view(u, v)`.

        Parameters
        ----------
        square_pixels
            True to resample the views of a hexagonal lattice to square pixels.

        Returns
        -------
        NDArray
            `(v, u, lens_row, lens_col, channel)`, v growing as the eye moves down and u as it moves to the right.

        Raises
        ------
        LayoutError
            If the image is pseudoscopic.
        """
        found = light_field(self)
        return on_square_pixels(found, self.layout) if square_pixels else found

    def epi(self, *, lens_row: int | None = None, lens_col: int | None = None) -> Light:
        """Return an epipolar-plane image (EPI) through the middle of the views.

        Parameters
        ----------
        lens_row
            A row of lenses, for the horizontal slice `(u, lens_col, channel)`.
        lens_col
            A column of lenses, for the vertical slice `(lens_row, v, channel)`.

        Raises
        ------
        LayoutError
            If neither or both are given, there is no such line of lenses, or the image is pseudoscopic.
        """
        if lens_row is not None and lens_col is None:
            return epi_of_row(self, lens_row)
        if lens_col is not None and lens_row is None:
            return epi_of_col(self, lens_col)
        raise LayoutError("expected either lens_row or lens_col")

    def depth_focused_view(
        self, depth_mm: float, *, direction: tuple[float, float] | None = None, px_per_lens: int | None = None
    ) -> Light:
        """Return the view that joins up at one depth with several pixels a lens; see `refocus.depth_focused_view`.

        Parameters
        ----------
        depth_mm
            The depth, mm in front of the display.
        direction
            The view (u, v) from which it is seen, which may lie between views; by default along the axes.
        px_per_lens
            The pixels a lens of the picture; by default as many as the depth gives.

        Raises
        ------
        LayoutError
            If there is no such view at that depth, or the image is pseudoscopic.
        """
        return depth_focused_view(self, depth_mm, direction=direction, px_per_lens=px_per_lens)

    def refocus(
        self, depth_mm: float, *, method: RefocusMethod = "shift_and_sum", px_per_lens: int | None = None
    ) -> Light:
        """Return the picture that is refocused to one depth; see `focal_stack`.

        Parameters
        ----------
        depth_mm
            The depth, mm in front of the display.
        method, px_per_lens
            As in `focal_stack`.

        Raises
        ------
        LayoutError
            As in `focal_stack`.
        """
        picture: Light = self.focal_stack((depth_mm,), method=method, px_per_lens=px_per_lens)[0]
        return picture

    def focal_stack(
        self, depths_mm: Sequence[float], *, method: RefocusMethod = "shift_and_sum", px_per_lens: int | None = None
    ) -> Light:
        """Return the pictures that are refocused to several depths, `(depth, row, col, channel)`.

        Parameters
        ----------
        depths_mm
            The depths, mm in front of the display; at least one.
        method
            `shift_and_sum` adds the shifted views, with one pixel a lens; `ciir` (computational integral imaging
            reconstruction) adds the magnified cells, with any number of pixels a lens.
        px_per_lens
            The pixels a lens of the pictures by `ciir`; by default as many as the image has.

        Raises
        ------
        LayoutError
            If neighbouring views do not overlap at a depth, `px_per_lens` is given for `shift_and_sum`, or the image
            is pseudoscopic.
        """
        if method == "ciir":
            return ciir_stack(self, depths_mm, px_per_lens=px_per_lens)
        if px_per_lens is not None:
            raise LayoutError(f"expected px_per_lens with the method ciir only, got it with {method}")
        return focal_stack(self, depths_mm)

    def all_in_focus(self, depths_mm: Sequence[float]) -> Light:
        """Return one picture that is sharp at several depths, put together from their focal stack.

        Parameters
        ----------
        depths_mm
            The depths, mm in front of the display; at least one.

        Raises
        ------
        LayoutError
            As in `focal_stack`.
        """
        return all_in_focus(self.focal_stack(depths_mm)).picture

    def depth(
        self,
        u: int | None = None,
        v: int | None = None,
        *,
        method: Method = "tensor",
        range_mm: tuple[float, float] | None = None,
        reach: int = REACH,
    ) -> ViewDepth:
        """Estimate the depth map of a view; see `docs/depth.md`.

        Parameters
        ----------
        u, v
            The number of the view; by default the one nearest to the axes of the lenses.
        method
            `tensor` (structure tensor) or `sweep` (plane sweep).
        range_mm
            The farthest and the nearest depth that is searched, mm; by default two pitches a view to either side.
        reach
            How many views to each side are compared.

        Returns
        -------
        ViewDepth
            `s_mm`, `disparity` and the confidence, each `(row, col)`; NaN where nothing is known.

        Raises
        ------
        LayoutError
            If there is no such view or none beside it, or the image is pseudoscopic.
        """
        return estimated_depth(self, self._view_number(u, v), method=method, range_mm=range_mm, reach=reach)

    def true_depth(self, u: int | None = None, v: int | None = None) -> ViewDepth:
        """Return the known depth map of a view.

        Parameters
        ----------
        u, v
            The number of the view; by default the one nearest to the axes of the lenses.

        Raises
        ------
        LayoutError
            If the image has no `depth_map`, there is no such view, or the image is pseudoscopic.
        """
        self.check_orthoscopic()
        if self.depth_map is None:
            raise LayoutError("expected an image with a depth map, as open(..., with_depth=True) reads it, got none")
        number = self._view_number(u, v)
        return true_depth(self.depth_map, self.layout, number, focal_mm=self.focal_length_mm)

    def perspective(self, eye: Place) -> Light:
        """Return what an eye sees through pinholes in place of the lenses, one pixel a lens.

        Parameters
        ----------
        eye
            (x, y, z) of the eye, mm to the right, upward and in front of the middle of the display.

        Returns
        -------
        NDArray
            `(row, col, channel)` on square pixels; dark at the lenses that `lenses_seen` leaves out.

        Raises
        ------
        LayoutError
            If the eye is not in front of the display, or the image is pseudoscopic.
        """
        return as_square(perspective(self, _eye(eye)).picture, self.layout)

    def lenses_seen(self, eye: Place) -> NDArray[np.bool_]:
        """Return which lenses show an eye light of their own cell, `(lens_row, lens_col)`; see `perspective`."""
        right, down = places_px(self.layout, _eye(eye), pitch_mm=self.pitch_mm, gap_mm=self.focal_length_mm)
        return inside_cells(self.layout, right, down)

    def observe(
        self,
        eye: Place,
        *,
        pupil_mm: float = PUPIL_MM,
        focus_mm: float = 0.0,
        rays: int = RAYS,
        stereo: Stereo | None = None,
        eye_distance_mm: float = EYES_APART_MM,
        size_px: int = SIZE_PX,
        window: Window | None = None,
    ) -> Light:
        """Return what an eye sees of the display with its lenses, gap and pixels; see `docs/observer.md`.

        Parameters
        ----------
        eye
            (x, y, z) of the eye, or of the middle between two eyes, mm to the right, upward and in front of the middle
            of the display.
        pupil_mm
            The diameter of the pupil, mm.
        focus_mm
            The depth on which the eye focuses, mm in front of the display.
        rays
            Rays a pixel.
        stereo
            How the pictures of two eyes are put together; None for one eye.
        eye_distance_mm
            The distance between two eyes, mm.
        size_px
            The longer side of an eye's picture, px.
        window
            The part of the display that the picture shows; by default the lens array.

        Raises
        ------
        LayoutError
            If the eye is not in front of the display, an option cannot be, or the image is pseudoscopic.
        """
        self.check_orthoscopic()
        display = self.shown_on()
        conditions = ViewingConditions(
            pupil_mm=pupil_mm, focus_mm=focus_mm, rays=rays, stereo=stereo, eye_distance_mm=eye_distance_mm
        )
        window = window or whole_window(display, size_px=size_px)
        return observed_picture(self.pixels, display, _eye(eye), conditions, window=window)

    def shown_on(self) -> LensDisplay:
        """Return the display that shows the image: its own, that of its rig, or one whose gap is one focal length."""
        if self.display is None and self.rig is not None:
            return observed_display(self.rig)
        return super().shown_on()

    def save(self, path: str | Path, *, bits: int = 8) -> None:
        """Save the integral image; the file appears when it is whole.

        Parameters
        ----------
        path
            EXR for linear light in half floats with the lenses in its header, which `open` reads back; PNG or TIFF for
            sRGB codes.
        bits
            The bits a channel of a PNG or TIFF: 8 or 16.

        Raises
        ------
        BadInput
            If it is another kind of file.
        LayoutError
            If the image does not have one or three channels, or is an EXR whose lenses no rig describes: a hexagonal
            lattice of an even number of rows whose first row is shifted.
        OutputError, DiskFull, DiskUnavailable
            If the file cannot be written.
        """
        save_image(self, Path(path), rig=self.rig, bits=bits)

    def _repr_png_(self) -> bytes:
        """Return the picture that a notebook shows: the integral image, reduced to `REPR_PX` px."""
        return preview_png(self.pixels, longest_px=REPR_PX)

    def _view_number(self, u: int | None, v: int | None) -> tuple[int, int]:
        if (u is None) != (v is None):
            raise LayoutError("expected both u and v of a view, or neither for the one in the middle")
        return self.centre if u is None or v is None else (u, v)


def _eye(place: Place) -> Eye:
    if isinstance(place, Eye):
        return place
    x_mm, y_mm, distance_mm = place
    return Eye(x_mm=x_mm, y_mm=y_mm, distance_mm=distance_mm)


def _filling(pixels: NDArray[Any], px_per_lens: int, lattice: Lattice) -> CellLayout:
    """Return the layout whose lenses fill an array."""
    one = CellLayout(1, 1, px_per_lens, lattice)
    lens_rows = max(1, (pixels.shape[0] - 2 * one.overhang_px) // one.row_px)
    return CellLayout(lens_rows, max(1, pixels.shape[1] // px_per_lens), px_per_lens, lattice)


def open_orthoscopic(path: Path, *, with_depth: bool = False) -> IntegralImage:
    """Open an orthoscopic master for a command, which converts nothing by itself.

    Parameters
    ----------
    path
        `orthoscopic/0001.exr`, or `device/0001.exr`.
    with_depth
        As in `IntegralImage.open`.

    Raises
    ------
    BadInput
        If the file is missing, is no master, or is pseudoscopic.
    ArtifactBroken
        If the file is damaged behind its header.
    """
    image = IntegralImage.open(path, with_depth=with_depth)
    if image.pseudoscopic:
        raise BadInput(f"expected an orthoscopic master, as orthoscopic/{path.name}, got {path}")
    return image
