"""The filters by which a picture is brought to another size, by name."""

from __future__ import annotations

from typing import Literal

Filter = Literal["box", "triangle", "mitchell", "lanczos3"]
"""`box` keeps the borders of pixels when enlarging; `triangle` is linear; `lanczos3` is sharp and rings a little."""
