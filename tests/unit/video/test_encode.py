"""Frames to a file and back."""

from __future__ import annotations

import gc
import json
import shutil
import subprocess
import weakref
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from tests.unit.video.movies import noise, psnr_db, waves
from worker.errors import ArtifactMissing, OutputError, StoreFull, StoreUnavailable
from worker.video.encode import FFV1, H264, Frame, Kind, encode, frame_rate
from worker.video.read import read_frames

KINDS = pytest.mark.parametrize("kind", [H264, FFV1], ids=["h264", "ffv1"])

SOLIDS = {
    # name: (R, G, B), (Y, Cb, Cr) in video range by ITU-R BT.709-6, sections 3.2 to 3.4
    "white": ((255, 255, 255), (235, 128, 128)),
    "black": ((0, 0, 0), (16, 128, 128)),
    "red": ((255, 0, 0), (63, 102, 240)),
    "green": ((0, 255, 0), (173, 42, 26)),
    "blue": ((0, 0, 255), (32, 240, 118)),
}


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("video")


@settings(deadline=None, max_examples=40)
@given(
    frames=st.tuples(st.integers(1, 4), st.integers(2, 40), st.integers(2, 40), st.just(3)).flatmap(
        lambda shape: hnp.arrays(np.uint8, shape)
    )
)
def test_ffv1_gives_every_code_back(folder: Path, frames: NDArray[np.uint8]) -> None:
    encode(folder / "a.mkv", list(frames), kind=FFV1, fps=8)
    np.testing.assert_array_equal(list(read_frames(folder / "a.mkv")), frames)


def test_ffv1_gives_noise_back_exactly(tmp_path: Path) -> None:
    frames = noise(5, 91, 121)
    encode(tmp_path / "a.mkv", frames, kind=FFV1, fps=8)
    np.testing.assert_array_equal(list(read_frames(tmp_path / "a.mkv")), frames)


def test_h264_looks_like_what_was_given(tmp_path: Path) -> None:
    frames = waves(12, 90, 120)
    encode(tmp_path / "a.mp4", frames, kind=H264, fps=8)
    shown = list(read_frames(tmp_path / "a.mp4"))
    assert len(shown) == 12
    assert min(psnr_db(s, g) for s, g in zip(shown, frames, strict=True)) > 38
    # The order is kept: every frame is most like its own.
    for number, picture in enumerate(shown):
        assert int(np.argmax([psnr_db(picture, other) for other in frames])) == number


@pytest.mark.parametrize("name", SOLIDS)
def test_h264_is_converted_to_bt709_video_range_and_not_only_tagged(tmp_path: Path, name: str) -> None:
    rgb, ycbcr = SOLIDS[name]
    encode(tmp_path / "a.mp4", [np.full((64, 64, 3), rgb, np.uint8)] * 2, kind=H264, fps=8)
    with av.open(str(tmp_path / "a.mp4"), "r") as container:
        frame = next(container.decode(video=0))
    planes = frame.to_ndarray()
    luma, cb, cr = planes[:64], planes[64:80], planes[80:]
    assert [int(np.median(plane)) for plane in (luma, cb, cr)] == pytest.approx(ycbcr, abs=1)
    assert frame.color_range == ColorRange.MPEG
    assert frame.colorspace == Colorspace.ITU709
    assert frame.color_trc == ColorTrc.BT709
    assert frame.color_primaries == ColorPrimaries.BT709
    assert np.abs(next(read_frames(tmp_path / "a.mp4")).astype(int) - rgb).max() <= 3


@pytest.mark.skipif(shutil.which("ffprobe") is None, reason="ffprobe is not installed")
def test_ffprobe_sees_the_tags_the_sizes_and_the_rate(tmp_path: Path) -> None:
    encode(tmp_path / "a.mp4", waves(6, 33, 47), kind=H264, fps=30000 / 1001)
    encode(tmp_path / "a.mkv", waves(6, 33, 47), kind=FFV1, fps=8)
    h264, ffv1 = probed(tmp_path / "a.mp4"), probed(tmp_path / "a.mkv")
    assert (
        h264
        | {
            "codec_name": "h264",
            "pix_fmt": "yuv420p",
            "color_range": "tv",
            "color_space": "bt709",
            "color_transfer": "bt709",
            "color_primaries": "bt709",
            "width": 48,
            "height": 34,
            "avg_frame_rate": "30000/1001",
            "nb_frames": "6",
        }
        == h264
    )
    assert (
        ffv1
        | {
            "codec_name": "ffv1",
            "pix_fmt": "bgr0",
            "color_range": "pc",
            "color_transfer": "iec61966-2-1",
            "width": 47,
            "height": 33,
            "avg_frame_rate": "8/1",
        }
        == ffv1
    )


def probed(path: Path) -> dict[str, object]:
    command = ["ffprobe", "-v", "error", "-show_streams", "-of", "json", str(path)]
    ended = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60)
    stream: dict[str, object] = json.loads(ended.stdout)["streams"][0]
    return stream


def test_an_odd_last_row_and_col_are_shown_twice(tmp_path: Path) -> None:
    encode(tmp_path / "a.mp4", waves(2, 33, 47), kind=H264, fps=8)
    shown = next(read_frames(tmp_path / "a.mp4"))
    assert shown.shape == (34, 48, 3)
    assert psnr_db(shown[:33, :47], waves(1, 33, 47)[0]) > 36


def test_the_index_of_an_mp4_stands_in_front(tmp_path: Path) -> None:
    encode(tmp_path / "a.mp4", noise(10, 64, 64), kind=H264, fps=8)
    data = (tmp_path / "a.mp4").read_bytes()
    assert 0 < data.index(b"moov") < data.index(b"mdat")


@KINDS
def test_the_same_frames_give_the_same_bytes(tmp_path: Path, kind: Kind) -> None:
    made = set()
    for _ in range(5):
        encode(tmp_path / "a", waves(20, 64, 64), kind=kind, fps=8)
        made.add((tmp_path / "a").read_bytes())
    assert len(made) == 1


@KINDS
def test_frames_are_taken_one_at_a_time_and_let_go(tmp_path: Path, kind: Kind) -> None:
    alive: list[weakref.ref[NDArray[np.uint8]]] = []

    def reading() -> Iterator[Frame]:
        for number in range(30):
            gc.collect()
            assert sum(frame() is not None for frame in alive) <= 2
            # So large that any frame left over is one that we keep: an encoder copies.
            frame = np.full((64, 64, 3), number, np.uint8)
            alive.append(weakref.ref(frame))
            yield frame
            del frame

    encode(tmp_path / "a", reading(), kind=kind, fps=8)
    assert len(list(read_frames(tmp_path / "a"))) == 30


@pytest.mark.parametrize(
    ("fps", "rate"), [(8.0, (8, 1)), (24000 / 1001, (24000, 1001)), (0.5, (1, 2)), (240, (240, 1))]
)
def test_rates_are_fractions(tmp_path: Path, fps: float, rate: tuple[int, int]) -> None:
    assert frame_rate(fps) == Fraction(*rate)
    encode(tmp_path / "a.mp4", waves(4, 16, 16), kind=H264, fps=fps)
    with av.open(str(tmp_path / "a.mp4"), "r") as container:
        assert container.streams.video[0].average_rate == Fraction(*rate)
        # MP4 counts the length of the whole in milliseconds.
        assert float(container.duration or 0) / av.time_base == pytest.approx(4 / fps, abs=2e-3)


def test_a_rate_of_almost_nothing_is_refused() -> None:
    with pytest.raises(OutputError, match="at least 1/1001 frames a second"):
        frame_rate(1e-6)


@KINDS
def test_no_frames_make_no_video(tmp_path: Path, kind: Kind) -> None:
    with pytest.raises(OutputError, match="at least one frame"):
        encode(tmp_path / "a", [], kind=kind, fps=8)
    assert not (tmp_path / "a").exists()


@KINDS
@pytest.mark.parametrize(
    "odd_one",
    [np.zeros((16, 18, 3), np.uint8), np.zeros((16, 16), np.uint8), np.zeros((16, 16, 4), np.uint8)],
    ids=["size", "no channels", "alpha"],
)
def test_a_frame_of_another_shape_is_refused_and_nothing_is_left(
    tmp_path: Path, kind: Kind, odd_one: NDArray[np.uint8]
) -> None:
    with pytest.raises(OutputError, match=r"expected frames \(16, 16, 3\) like the first"):
        encode(tmp_path / "a", [*waves(3, 16, 16), odd_one], kind=kind, fps=8)
    assert not (tmp_path / "a").exists()


def test_codes_of_16_bits_are_refused(tmp_path: Path) -> None:
    frames: list[NDArray[np.generic]] = [np.zeros((4, 4, 3), np.uint16)]  # what a caller might do
    with pytest.raises(OutputError, match="got uint16"):
        encode(tmp_path / "a", frames, kind=FFV1, fps=8)  # type: ignore[arg-type]


@KINDS
def test_a_frame_that_cannot_be_read_ends_it_with_its_own_error_and_nothing_is_left(tmp_path: Path, kind: Kind) -> None:
    def reading() -> Iterator[Frame]:
        yield from waves(3, 16, 16)
        raise ArtifactMissing("views/0004.exr")

    with pytest.raises(ArtifactMissing, match=r"views/0004\.exr"):
        encode(tmp_path / "a", reading(), kind=kind, fps=8)
    assert not (tmp_path / "a").exists()


@KINDS
def test_a_full_disk_is_said_and_nothing_is_left(tmp_path: Path, kind: Kind) -> None:
    full = tmp_path / "full"
    full.symlink_to("/dev/full")
    with pytest.raises(StoreFull, match="cannot write full: No space left"):
        encode(full, noise(30, 64, 64), kind=kind, fps=8)
    assert not full.is_symlink()


@KINDS
def test_a_folder_that_is_not_there_is_said(tmp_path: Path, kind: Kind) -> None:
    with pytest.raises(StoreUnavailable, match="No such file or directory"):
        encode(tmp_path / "none" / "a", waves(1, 16, 16), kind=kind, fps=8)
