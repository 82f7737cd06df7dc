"""Frames to a file and back."""

from __future__ import annotations

import gc
import json
import os
import subprocess
import weakref
from collections.abc import Iterator
from fractions import Fraction
from pathlib import Path
from typing import Any

import av
import numpy as np
import pytest
from av.video.reformatter import ColorPrimaries, ColorRange, Colorspace, ColorTrc
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp
from numpy.typing import NDArray

from lippmann.errors import ArtifactMissing, OutputError, StoreFull, StoreUnavailable
from lippmann.job.outputs.codecs import CHOICES, Bits, Chroma, Codec, Container
from tests.needs import needs_ffprobe
from tests.srgb import encoded_srgb
from tests.unit.worker.video.movies import noise, psnr_db, waves
from worker.video.encode import Frame, encode, frame_rate
from worker.video.kinds import FFV1, H264, Kind
from worker.video.kinds import kind as kind_of
from worker.video.read import read_frames

KINDS = pytest.mark.parametrize("kind", list(map(kind_of, CHOICES)), ids=list(CHOICES))

LOSSY = pytest.mark.parametrize("codec", [codec for codec, choices in CHOICES.items() if choices.crf])

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


@pytest.mark.parametrize("bits", [10, 16])
def test_ffv1_gives_codes_of_more_bits_back_exactly(tmp_path: Path, bits: Bits) -> None:
    frames = np.random.default_rng(4).integers(0, 2**bits, (3, 33, 47, 3), dtype=np.uint16)
    encode(tmp_path / "a.mkv", list(frames), kind=kind_of("ffv1", bits=bits), fps=8)
    with av.open(str(tmp_path / "a.mkv"), "r") as container:
        decoded = [frame.to_ndarray() for frame in container.decode(video=0)]
    np.testing.assert_array_equal(decoded, frames)


@LOSSY
def test_videos_for_people_look_like_what_was_given(tmp_path: Path, codec: Codec) -> None:
    frames = waves(12, 90, 120)
    encode(tmp_path / "a", frames, kind=kind_of(codec), fps=8)
    shown = list(read_frames(tmp_path / "a"))
    assert len(shown) == 12
    assert min(psnr_db(s, g) for s, g in zip(shown, frames, strict=True)) > 38
    # The order is kept: every frame is most like its own.
    for number, picture in enumerate(shown):
        assert int(np.argmax([psnr_db(picture, other) for other in frames])) == number


@LOSSY
@pytest.mark.parametrize("name", SOLIDS)
def test_colours_are_converted_to_bt709_video_range_and_not_only_tagged(
    tmp_path: Path, codec: Codec, name: str
) -> None:
    rgb, ycbcr = SOLIDS[name]
    encode(tmp_path / "a", [np.full((64, 64, 3), rgb, np.uint8)] * 2, kind=kind_of(codec), fps=8)
    with av.open(str(tmp_path / "a"), "r") as container:
        frame = next(container.decode(video=0))
    planes = frame.to_ndarray()
    luma, cb, cr = planes[:64], planes[64:80], planes[80:]
    assert [int(np.median(plane)) for plane in (luma, cb, cr)] == pytest.approx(ycbcr, abs=1)
    assert frame.color_range == ColorRange.MPEG
    assert frame.colorspace == Colorspace.ITU709
    assert frame.color_trc == ColorTrc.IEC61966_2_1
    assert frame.color_primaries == ColorPrimaries.BT709
    assert np.abs(next(read_frames(tmp_path / "a")).astype(int) - rgb).max() <= 3


@needs_ffprobe
@pytest.mark.parametrize("codec", CHOICES)
def test_a_reader_that_honours_the_tags_finds_the_light_of_the_pictures(tmp_path: Path, codec: Codec) -> None:
    """zimg, inside FFmpeg, decodes matrix, range and transfer as the file names them."""
    codes = np.repeat(np.arange(256, dtype=np.uint8).reshape(4, 64), 16, axis=0)[..., np.newaxis].repeat(3, axis=2)
    path = tmp_path / f"a.{CHOICES[codec].containers[0]}"
    encode(path, [codes] * 2, kind=kind_of(codec), fps=8)
    light = decoded_as_tagged(path, shape=codes.shape)
    found = encoded_srgb(light) * 255
    assert np.sqrt(np.mean((found - codes) ** 2)) < 1.5


def decoded_as_tagged(path: Path, *, shape: tuple[int, ...]) -> NDArray[np.float32]:
    """Return the linear light of the first frame, `(row, col, channel)`, as FFmpeg's zscale filter decodes the tags."""
    filters = "zscale=transfer=linear:matrix=gbr:range=full,format=gbrpf32le"
    command = ["ffmpeg", "-v", "error", "-i", str(path), "-vf", filters, "-frames:v", "1", "-f", "rawvideo", "-"]
    ended = subprocess.run(command, check=True, capture_output=True, timeout=60)
    green, blue, red = np.frombuffer(ended.stdout, "<f4").reshape(3, *shape[:2])
    return np.stack((red, green, blue), axis=-1)


PROBED = [
    (codec, container, chroma, bits)
    for codec, choices in CHOICES.items()
    for container in choices.containers
    for chroma in choices.chroma or (None,)
    for bits in choices.bits
]
"""Everything that may be chosen."""


@needs_ffprobe
@pytest.mark.parametrize(("codec", "container", "chroma", "bits"), PROBED)
def test_ffprobe_sees_the_tags_the_sizes_and_the_rate(
    tmp_path: Path, codec: Codec, container: Container, chroma: Chroma | None, bits: Bits
) -> None:
    frames = [frame if bits == 8 else frame.astype(np.uint16) * 2 ** (bits - 8) for frame in waves(6, 33, 47)]
    kind = kind_of(codec, container=container, chroma=chroma, bits=bits)
    encode(tmp_path / f"a.{container}", frames, kind=kind, fps=30000 / 1001)
    yuv = {"color_range": "tv", "color_space": "bt709", "color_transfer": "iec61966-2-1", "color_primaries": "bt709"}
    rgb = {"color_range": "pc", "color_space": "gbr", "color_transfer": "iec61966-2-1", "color_primaries": "bt709"}
    sides = {"width": 48, "height": 34} if chroma == "4:2:0" else {"width": 47, "height": 33}
    formats = {
        ("4:2:0", 8): "yuv420p", ("4:2:0", 10): "yuv420p10le", ("4:4:4", 8): "yuv444p",
        (None, 8): "bgr0", (None, 10): "gbrp10le", (None, 16): "gbrp16le",
    }  # fmt: skip
    expected = {
        "codec_name": {"h265": "hevc"}.get(codec, codec),
        "pix_fmt": formats[chroma, bits],
        "avg_frame_rate": "30000/1001",
        "nb_read_frames": "6",
        **sides,
        **(yuv if chroma else rgb),
    }
    stream, form = probed(tmp_path / f"a.{container}")
    assert {name: stream.get(name) for name in expected} == expected
    assert container in {"mov,mp4,m4a,3gp,3g2,mj2": ["mp4"], "matroska,webm": ["webm", "mkv"]}[form["format_name"]]
    assert float(form["duration"]) == pytest.approx(6 * 1001 / 30000, abs=2e-3)


def probed(path: Path) -> tuple[dict[str, Any], dict[str, Any]]:
    """Return what ffprobe says of the stream, and of the whole."""
    command = ["ffprobe", "-v", "error", "-count_frames", "-show_streams", "-show_format", "-of", "json", str(path)]
    ended = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60)
    said = json.loads(ended.stdout)
    return said["streams"][0], said["format"]


def test_the_container_itself_says_the_colours(tmp_path: Path) -> None:
    """ffprobe may have them from the stream, so here the containers' own bytes are read."""
    encode(tmp_path / "a.mp4", waves(2, 16, 16), kind=H264, fps=8)
    # ISO/IEC 14496-12, 12.1.5: colour type, primaries, transfer, matrix, and a bit for full range.
    assert b"colrnclx" + bytes([0, 1, 0, 13, 0, 1, 0]) in (tmp_path / "a.mp4").read_bytes()
    encode(tmp_path / "a.webm", waves(2, 16, 16), kind=kind_of("vp9"), fps=8)
    written = (tmp_path / "a.webm").read_bytes()
    # Matroska (RFC 9559): MatrixCoefficients, Range, TransferCharacteristics and Primaries, of one byte each.
    for element, value in ((0x55B1, 1), (0x55B9, 1), (0x55BA, 13), (0x55BB, 1)):
        assert element.to_bytes(2, "big") + bytes([0x81, value]) in written


@LOSSY
def test_a_larger_rate_factor_is_smaller_and_worse(tmp_path: Path, codec: Codec) -> None:
    frames, made = waves(6, 90, 120), {}
    for crf in (10, 40):
        sizes = encode(tmp_path / "a", frames, kind=kind_of(codec, crf=crf), fps=8)
        made[crf] = sum(sizes), psnr_db(np.stack(list(read_frames(tmp_path / "a"))), np.stack(frames))
    assert made[40][0] < made[10][0]
    assert made[40][1] < made[10][1]


@pytest.mark.parametrize("codec", ["h264", "h265", "av1", "vp9"])
def test_a_quantizer_that_holds_still_sets_the_quality(tmp_path: Path, codec: Codec) -> None:
    frames = waves(6, 90, 120)
    made = [sum(encode(tmp_path / "a", frames, kind=kind_of(codec, qp=qp), fps=8)) for qp in (10, 30, 50)]
    assert made[0] > made[1] > made[2]


@pytest.mark.parametrize("codec", ["h264", "h265", "av1", "vp9"])
def test_frames_that_stand_alone_cost_more_where_little_changes(tmp_path: Path, codec: Codec) -> None:
    frames = waves(6, 90, 120)
    alone, together = (
        sum(encode(tmp_path / "a", frames, kind=kind_of(codec, qp=30, intra=intra), fps=8)) for intra in (True, False)
    )
    assert alone > together


@needs_ffprobe
@KINDS
def test_the_bytes_of_every_frame_are_told_in_the_order_shown(tmp_path: Path, kind: Kind) -> None:
    path = tmp_path / f"a.{kind.container}"
    sizes = encode(path, waves(20, 64, 64), kind=kind, fps=8)
    command = ["ffprobe", "-v", "error", "-show_packets", "-of", "json", str(path)]
    ended = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60)
    packets = sorted(json.loads(ended.stdout)["packets"], key=lambda packet: int(packet["pts"]))
    # MP4 has lengths where x264 has start codes, and leaves out the delimiters of AV1.
    assert sizes == pytest.approx([int(packet["size"]) for packet in packets], abs=4)


def test_an_odd_last_row_and_col_are_shown_twice(tmp_path: Path) -> None:
    encode(tmp_path / "a.mp4", waves(2, 33, 47), kind=H264, fps=8)
    shown = next(read_frames(tmp_path / "a.mp4"))
    assert shown.shape == (34, 48, 3)
    assert psnr_db(shown[:33, :47], waves(1, 33, 47)[0]) > 36


def test_the_index_of_an_mp4_stands_in_front(tmp_path: Path) -> None:
    encode(tmp_path / "a.mp4", noise(10, 64, 64), kind=H264, fps=8)
    data = (tmp_path / "a.mp4").read_bytes()
    assert 0 < data.index(b"moov") < data.index(b"mdat")


@pytest.mark.parametrize("codec", [codec for codec in CHOICES if codec != "h265"])  # x265 does not, see the module
def test_the_same_frames_give_the_same_bytes(tmp_path: Path, codec: Codec) -> None:
    made = set()
    for _ in range(5):
        encode(tmp_path / "a", waves(20, 64, 64), kind=kind_of(codec), fps=8)
        made.add((tmp_path / "a").read_bytes())
    assert len(made) == 1


@pytest.fixture
def small_heap() -> Iterator[None]:
    """Let the garbage collector pass over what was made before the test, so that collecting often is quick."""
    gc.freeze()
    yield
    gc.unfreeze()


@KINDS
def test_frames_are_taken_one_at_a_time_and_let_go(tmp_path: Path, kind: Kind, small_heap: None) -> None:
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


def test_codes_of_other_bits_are_refused(tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="codes of 8 bits as uint8, got uint16"):
        encode(tmp_path / "a", [np.zeros((4, 4, 3), np.uint16)], kind=FFV1, fps=8)


def test_what_a_codec_cannot_do_is_said() -> None:
    with pytest.raises(OutputError, match=r"of vp9 one of .* got mp4"):
        kind_of("vp9", container="mp4")
    with pytest.raises(OutputError, match="of ffv1 no qp, got qp 20"):
        kind_of("ffv1", qp=20)
    with pytest.raises(OutputError, match="of av1 a qp from 1 to 63, got 0"):
        kind_of("av1", qp=0)
    with pytest.raises(OutputError, match="of h264 either a qp or a crf, got qp 20"):
        kind_of("h264", qp=20, crf=20)


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


@KINDS
@pytest.mark.parametrize("size", [(1, 1), (1, 40), (40, 1), (3, 5), (15, 17)])
def test_every_encoder_takes_pictures_of_any_size(tmp_path: Path, kind: Kind, size: tuple[int, int]) -> None:
    frame = np.full((*size, 3), 128, dtype=np.uint8)
    assert len(encode(tmp_path / "small", [frame] * 2, kind=kind, fps=8)) == 2


@KINDS
def test_no_encoder_takes_a_real_time_priority(tmp_path: Path, kind: Kind) -> None:
    # SVT-AV1 does so when root runs it; then nothing else runs on the machine while a test waits actively.
    policies = set[int]()

    def frames() -> Iterator[Frame]:
        for _ in range(3):
            yield np.zeros((64, 64, 3), np.uint8) if kind.bits == 8 else np.zeros((64, 64, 3), np.uint16)
            policies.update(os.sched_getscheduler(int(thread.name)) for thread in Path("/proc/self/task").iterdir())

    encode(tmp_path / "a", frames(), kind=kind, fps=8.0)
    assert policies == {os.SCHED_OTHER}
    assert os.sched_getscheduler(0) == os.SCHED_OTHER
