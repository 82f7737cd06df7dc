"""Matrices and conjugates against frozen numbers and an independent package."""

from __future__ import annotations

import math

import pytest
from raytracing import DielectricInterface, ImagingPath, Space

from lippmann.optics.lens.matrices import cardinal_points, conjugate, system_matrix
from lippmann.optics.lens.prescription import ATHINEOS_2006, CONTACT_GAP_MM, ImagingLens, Surface

# object mm -> (image mm behind the last vertex, magnification), to all digits printed.
CONJUGATES = {
    1000.0: (184.34095, -0.2843843),
    1250.0: (167.99103, -0.229969),
    1500.0: (156.89306, -0.193034),
    1750.0: (148.86668, -0.166321),
    2500.0: (134.20611, -0.117528),
}


def test_the_papers_lens_has_the_frozen_focal_length_and_distances() -> None:
    points = cardinal_points(ATHINEOS_2006)
    assert points.effective_focal_length_mm == pytest.approx(300.46784621322, rel=1e-12)
    assert points.back_focal_distance_mm == pytest.approx(98.89261626115, rel=1e-12)
    assert points.front_focal_distance_mm == pytest.approx(56.55572355708, rel=1e-11)


@pytest.mark.parametrize("object_mm", CONJUGATES)
def test_conjugates_are_the_frozen_ones(object_mm: float) -> None:
    image_mm, magnification = CONJUGATES[object_mm]
    found = conjugate(ATHINEOS_2006, object_mm)
    assert found.image_mm == pytest.approx(image_mm, abs=5.1e-6)
    assert found.magnification == pytest.approx(magnification, abs=5.1e-7)


def test_image_depth_and_compression_are_the_papers() -> None:
    near, far = conjugate(ATHINEOS_2006, 1000.0), conjugate(ATHINEOS_2006, 2500.0)
    depth_mm = near.image_mm - far.image_mm
    assert depth_mm == pytest.approx(50.1348, abs=1e-4)
    assert 1500.0 / depth_mm == pytest.approx(29.92, abs=5e-3)
    assert (abs(near.magnification) + abs(far.magnification)) / 2 == pytest.approx(0.20096, abs=5e-6)


def test_matrices_equal_those_of_the_raytracing_package() -> None:
    path, index = ImagingPath(), 1.0
    for surface in ATHINEOS_2006.surfaces:
        path.append(DielectricInterface(R=surface.radius_mm, n1=index, n2=surface.index_after))
        path.append(Space(d=surface.thickness_mm, n=surface.index_after))
        index = surface.index_after
    theirs = path.transferMatrix()
    ours = system_matrix(ATHINEOS_2006)
    assert pytest.approx(list(ours.ravel()), rel=1e-9) == [theirs.A, theirs.B, theirs.C, theirs.D]


def test_longitudinal_magnification_is_the_square_of_the_lateral() -> None:
    step_mm = 1e-3
    here, there = conjugate(ATHINEOS_2006, 1500.0), conjugate(ATHINEOS_2006, 1500.0 + step_mm)
    assert (here.image_mm - there.image_mm) / step_mm == pytest.approx(here.magnification**2, rel=1e-4)


def test_a_thin_lens_images_twice_its_focal_length_at_life_size() -> None:
    thin = ImagingLens("thin", "", "", (Surface(100.0, 0.0, 1.5, 20.0), Surface(-100.0, 0.0, 1.0, 20.0)))
    found = conjugate(thin, 200.0)
    assert (found.image_mm, found.magnification) == pytest.approx((200.0, -1.0))


def test_an_object_in_the_front_focal_plane_is_imaged_at_infinity() -> None:
    thin = ImagingLens("thin", "", "", (Surface(100.0, 0.0, 1.5, 20.0), Surface(math.inf, 0.0, 1.0, 20.0)))
    assert math.isinf(conjugate(thin, 200.0).image_mm)


def test_surfaces_in_contact_are_built_apart_and_others_as_they_are() -> None:
    thickness = [surface.thickness_mm for surface in ATHINEOS_2006.built().surfaces]
    assert thickness == [84.28, 289.30, 17.16, CONTACT_GAP_MM, 17.16, 0.0]
