"""Videos as independent readers see them: ffprobe's words, FFmpeg's pictures."""

from __future__ import annotations

import json
import subprocess
from pathlib import Path
from typing import Any

import av
import numpy as np
from numpy.typing import NDArray

from tests.builders_outputs import GivenJob


def probed(path: Path) -> dict[str, Any]:
    """Return what ffprobe says of the stream, every frame counted."""
    command = ["ffprobe", "-v", "error", "-count_frames", "-show_streams", "-show_format", "-of", "json", str(path)]
    ended = subprocess.run(command, check=True, capture_output=True, text=True, timeout=60)
    said = json.loads(ended.stdout)
    return {"duration_s": float(said["format"]["duration"]), **said["streams"][0]}


def decoded(path: Path) -> NDArray[Any]:
    """Return all pictures as sRGB codes `(picture, row, col, 3)`; of 16 bits where the video has more than 8."""
    with av.open(str(path), "r") as container:
        frames = list(container.decode(video=0))
    if frames[0].format.name in ("gbrp10le", "gbrp16le"):
        return np.stack([frame.to_ndarray() for frame in frames])
    return np.stack([frame.to_ndarray(format="rgb24") for frame in frames])


def film(job: GivenJob, file_name: str) -> NDArray[Any]:
    """Make a video and return its pictures."""
    job.make(file_name)
    with job.file(f"video/{file_name}") as path:
        return decoded(path)
