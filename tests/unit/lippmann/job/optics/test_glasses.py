"""Glasses by name."""

from __future__ import annotations

import math
import time

import pytest
from pydantic import ValidationError

from lippmann.job.optics.glasses import Glass, expected_glass, glass, glasses_by_maker, known_names
from lippmann.job.optics.lens import LensSurface

LINES_UM = (0.4861327, 0.5875618, 0.6562725)

# B1 B2 B3 C1 C2 C3 of data sheets (Schott, Ohara), typed from them and independent of the table.
SELLMEIER = {
    "N-BK7": (1.03961212, 0.231792344, 1.01046945, 0.00600069867, 0.0200179144, 103.560653),
    "N-SF11": (1.73759695, 0.313747346, 1.89878101, 0.013188707, 0.0623068142, 155.23629),
    "SF6": (1.72448482, 0.390104889, 1.04572858, 0.0134871947, 0.0569318095, 118.557185),
    "F2": (1.34533359, 0.209073176, 0.937357162, 0.00997743871, 0.0470450767, 111.886764),
    "S-BSL7": (1.15150190, 0.118583612, 1.26301359, 0.0105984130, -0.0118225190, 129.617662),
}


@pytest.mark.parametrize(
    ("asked", "name"),
    [
        ("bk7", "N-BK7"),
        ("SK16", "N-SK16"),
        ("f2", "F2"),
        ("PMMA", "ACRYLIC"),
        ("n-sf11 ", "N-SF11"),
        ("NSK16_SCHOTT", "N-SK16"),
        ("SLAL8_OHARA", "S-LAL8"),
        ("PMMA_SPECIAL", "ACRYLIC"),
        ("Polycarb_special", "POLYCARBONATE"),
        ("SSKN5", "N-SSK5"),
        ("LAKN22", "N-LAK22"),
        ("silica", "FUSED-SILICA"),
        ("F_SILICA", "FUSED-SILICA"),
        ("C79-80", "FUSED-SILICA"),
        ("N LAK 9", "N-LAK9"),
    ],
)
def test_glasses_are_found_by_the_names_people_use(asked: str, name: str) -> None:
    assert glass(asked) == next(names[name] for names in glasses_by_maker().values() if name in names)


def test_schott_comes_first_unless_another_maker_is_named() -> None:
    assert glass("F5") == glass("F5", ["NIKON"]) == Glass(1.60342, 38.03)
    assert glass("F5", ["CDGM"]) == glass("F5_CDGM") == Glass(1.62435, 35.94)
    assert glass("H-K9L", ["SCHOTT"]) == glass("H-K9L")


@pytest.mark.parametrize("name", ["", "N-", "XYZ1", "BK7_NOBODY", "_", "SCHOTT", "N" * 1_000_000])
def test_other_names_are_unknown(name: str) -> None:
    assert glass(name) is None


def test_the_table_holds_the_makers_glasses_with_plausible_numbers() -> None:
    assert len(list(known_names())) > 1600
    for names in glasses_by_maker().values():
        for name, found in names.items():
            assert 1.4 < found.index < 2.25, name
            assert found.abbe is not None
            assert 15 < found.abbe < 100, name


@pytest.mark.parametrize("name", SELLMEIER)
def test_the_numbers_are_those_of_the_data_sheets_formula(name: str) -> None:
    b1, b2, b3, c1, c2, c3 = SELLMEIER[name]
    blue, yellow, red = (
        math.sqrt(1 + sum(b * um**2 / (um**2 - c) for b, c in ((b1, c1), (b2, c2), (b3, c3)))) for um in LINES_UM
    )
    found = glass(name)
    assert found is not None
    assert found.index == pytest.approx(yellow, abs=6e-6)
    assert found.abbe == pytest.approx((yellow - 1) / (blue - red), abs=6e-3)


def test_an_unknown_glass_is_refused_with_names_like_it() -> None:
    assert "(did you mean H-K9L" in expected_glass("h-k9")
    assert "did you mean" not in expected_glass("unobtainium")
    with pytest.raises(ValidationError, match=r"by its name \(did you mean N-BK7"):
        LensSurface.model_validate({"radius_mm": 5, "material": "N-BK77", "semi_aperture_mm": 1})


def test_a_refusal_is_quick() -> None:
    began_s = time.process_time()
    for number in range(60):
        expected_glass(f"N-BK{number}" * 100)
    assert time.process_time() - began_s < 5
