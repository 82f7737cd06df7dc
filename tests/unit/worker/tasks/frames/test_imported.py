"""A job of integral images from elsewhere, by the worker's own steps."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import tifffile
from PIL import Image
from typer.testing import CliRunner

from lippmann.cli.main import app
from lippmann.errors import BundleError
from lippmann.job.messages.orders import TaskKind
from lippmann.job.outputs.prints import Print
from lippmann.job.spec import parse_spec
from lippmann.lattice.layout import CellLayout
from lippmann.lightfield.sheet.orthoscopic import half_turn_cells
from lippmann.lightfield.views.views import views_grid
from lippmann.plan import artifact_names as names
from lippmann.plan.tasks import plan_sheet
from tests.builders import artifacts_of, local_place, order_of, stored_picture
from tests.unit.lippmann.lightfield.sheets import numbered_sheet
from worker.images.colour import srgb_codes
from worker.images.read import read_attributes
from worker.sandbox.bundle import check_bundle, pack_folder
from worker.tasks.attempts.monitor import NullMonitor
from worker.tasks.attempts.workplace import Workplace
from worker.tasks.encode import encode_output
from worker.tasks.frames.assemble import assemble_frame
from worker.tasks.local import JOB_ID, local_job, store_plan
from worker.tasks.outputs.frame_source import job_frames
from worker.tasks.outputs.prints import about_print
from worker.tasks.probe import probe_job
from worker.untrusted import read_imported

LAYOUT = CellLayout(8, 10, 6, "hexagonal")
JOB = {"scene": "mine", "frames": "1-2", "outputs": ["views.mp4"]}


@pytest.fixture
def bundle(tmp_path: Path) -> Path:
    sheet = numbered_sheet(LAYOUT)
    for number in (1, 2):
        codes = srgb_codes((sheet / sheet.max() / number).astype(np.float32), bits=8)
        Image.fromarray(codes).save(tmp_path / f"{number}.png")
    words = ["views", str(tmp_path / "1.png"), str(tmp_path / "2.png"), "--pitch-px", "6", "--row-pitch-px", "6"]
    words += ["--lattice", "hexagonal", "--out", str(tmp_path / "out"), "--bundle", str(tmp_path / "bundle")]
    ran = CliRunner().invoke(app, words)
    assert ran.exit_code == 0, ran.output
    return tmp_path / "bundle"


def test_the_depths_of_imported_pictures_are_unknown_to_outputs_and_a_print_has_the_gap_of_parallel_light(
    tmp_path: Path, bundle: Path
) -> None:
    place = local_place(tmp_path / "data")
    sheet = local_job(place, parse_spec(JOB), pack_folder(bundle))
    source = job_frames(artifacts_of(place), sheet)
    assert source.stage(1) is None
    about = about_print(source, Print(dpi=300))
    assert (about["gap_use"], about["gap_mm"]) == ("collimated", sheet.spec.rig.lens_array.focal_length_mm)


def test_pages_a_white_level_and_a_white_frame_give_what_the_command_gives(tmp_path: Path) -> None:
    sheet = numbered_sheet(LAYOUT)
    codes = (4095 * sheet / sheet.max()).astype(np.uint16)
    with tifffile.TiffWriter(tmp_path / "raw.tif") as file:
        for number in (1, 2):
            file.write(codes // number, photometric="rgb", metadata=None)
    fall = np.linspace(0.5, 1, sheet.shape[1])[:, np.newaxis] * np.full(sheet.shape, 3000)
    tifffile.imwrite(tmp_path / "white.tif", fall.astype(np.uint16), photometric="rgb")
    words = ["import", "raw.tif", "--white", "white.tif", "--out", "out", "--bundle", "bundle"]
    words = [str(tmp_path / word) if word in ("raw.tif", "white.tif", "out", "bundle") else word for word in words]
    words += ["--pitch-px", "6", "--row-pitch-px", "6", "--lattice", "hexagonal", "--linear", "--white-level", "4095"]
    ran = CliRunner().invoke(app, words)
    assert ran.exit_code == 0, ran.output
    place = _place(tmp_path, tmp_path / "bundle")
    for frame in (1, 2):
        assemble_frame(place, order_of(TaskKind.ASSEMBLE, frame=frame), NullMonitor())
        shown = stored_picture(place, names.orthoscopic_name(frame))
        assert np.array_equal(shown, read_imported(tmp_path / f"out/orthoscopic/{frame:04d}.exr"))
        assert shown.max() > 1 / (2 * frame)


def _place(folder: Path, bundle: Path) -> Workplace:
    place = local_place(folder / "data")
    sheet = local_job(place, parse_spec(JOB), pack_folder(bundle))
    work = probe_job(place, order_of(TaskKind.PROBE, frame=None), NullMonitor())
    assert work.probe is not None
    assert not work.probe.renders
    store_plan(place, plan_sheet(sheet.spec, work.probe, slots=2))
    return place


def test_the_frames_become_masters_and_videos_as_those_of_any_job(tmp_path: Path, bundle: Path) -> None:
    place = _place(tmp_path, bundle)
    for frame in (1, 2):
        assemble_frame(place, order_of(TaskKind.ASSEMBLE, frame=frame), NullMonitor())
        shown = stored_picture(place, names.orthoscopic_name(frame))
        # As the command made them of the same pictures, by the same chain.
        assert np.array_equal(shown, read_imported(tmp_path / f"out/orthoscopic/{frame:04d}.exr"))
        assert np.array_equal(stored_picture(place, names.integral_name(frame)), half_turn_cells(shown, LAYOUT))
        assert np.array_equal(stored_picture(place, names.views_name(frame)), views_grid(shown, LAYOUT))
    encode_output(place, order_of(TaskKind.ENCODE, frame=None, output="views.mp4"), NullMonitor())
    assert place.store.exists(names.job_artifact(JOB_ID, "video/views.mp4"))
    with place.store.local_path(names.job_artifact(JOB_ID, names.orthoscopic_name(1))) as path:
        assert "stage" not in read_attributes(path)


def test_a_bundle_names_its_pictures_and_one_without_is_refused(tmp_path: Path, bundle: Path) -> None:
    card = check_bundle(pack_folder(bundle)).card
    assert card.sheets is not None
    assert card.sheets.files == ("frames/0001.png", "frames/0002.png")
    for path in (bundle / "frames").iterdir():
        path.unlink()
    with pytest.raises(BundleError, match=r"sheets\.files: expected pictures .* of the bundle, got 'frames/0001\.png'"):
        check_bundle(pack_folder(bundle))


@pytest.mark.parametrize(
    ("files", "found"), [('"frames/*"', 2), ('"frames/0002.*"', 1), ('"../*"', 0), ('["../1.png"]', 0), ("[]", 0)]
)
def test_pictures_are_those_of_the_bundle_and_no_others(bundle: Path, files: str, found: int) -> None:
    manifest = bundle / "scene.toml"
    lines = [f"files = {files}" if line.startswith("files") else line for line in manifest.read_text().splitlines()]
    manifest.write_text("\n".join(lines))
    if not found:
        with pytest.raises(BundleError, match=r"sheets\.files: expected pictures"):
            check_bundle(pack_folder(bundle))
        return
    card = check_bundle(pack_folder(bundle)).card
    assert card.sheets is not None
    assert len(card.sheets.files) == found


def test_a_picture_cut_short_ends_the_job_by_name(tmp_path: Path, bundle: Path) -> None:
    path = bundle / "frames/0001.png"
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(BundleError, match=r"frames/0001\.png: expected a whole picture"):
        _place(tmp_path, bundle)


def test_the_pictures_of_a_bundle_are_linear_where_the_bundle_says_so_and_the_log_names_their_colour_space(
    tmp_path: Path, bundle: Path
) -> None:
    name = names.job_artifact(JOB_ID, names.log_name(TaskKind.PROBE, None, None, None, 1))
    pictures, logs = [], []
    for words in ("", "linear = true\n"):
        manifest = bundle / "scene.toml"
        manifest.write_text(manifest.read_text() + words)
        place = _place(tmp_path / f"linear{len(words)}", bundle)
        assemble_frame(place, order_of(TaskKind.ASSEMBLE, frame=1), NullMonitor())
        pictures.append(stored_picture(place, names.orthoscopic_name(1)))
        with place.store.local_path(name) as log:
            logs.append(log.read_text())
    # The codes of light that was decoded are that light without decoding.
    np.testing.assert_allclose(srgb_codes(pictures[0]) / 255, pictures[1], atol=0.004)
    assert "colour space sRGB, named by nothing in the file" in logs[0]
    assert "no colour space is named, so the codes are read as sRGB" in logs[0]
    assert "colour space linear, named by sheets.linear" in logs[1]
