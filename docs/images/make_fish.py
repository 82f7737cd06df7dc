"""Draw fish.png, the README's picture, from what `make demo` left in out/.

Run it as `python docs/images/make_fish.py`.
Three views of the first frame (left eye, centre, right eye) and a piece of the orthoscopic integral image itself.
"""

from __future__ import annotations

from pathlib import Path

from PIL import Image

OUT = Path("out")
LENSES, PX_PER_LENS = 90, 8
SIDE_PX, GAP_PX = 360, 6
PIECE_PX = 120


def main() -> None:
    """Put four squares side by side."""
    grid = Image.open(OUT / "views" / "0001.png")
    sheet = Image.open(OUT / "orthoscopic" / "0001.png")
    row = PX_PER_LENS // 2 * LENSES
    views = [
        grid.crop((u * LENSES, row, (u + 1) * LENSES, row + LENSES)) for u in (0, PX_PER_LENS // 2, PX_PER_LENS - 1)
    ]
    squares = [view.resize((SIDE_PX, SIDE_PX), Image.Resampling.BICUBIC) for view in views]
    left, top = 200, 280
    piece = sheet.crop((left, top, left + PIECE_PX, top + PIECE_PX))
    squares.append(piece.resize((SIDE_PX, SIDE_PX), Image.Resampling.NEAREST))
    picture = Image.new("RGB", (4 * SIDE_PX + 3 * GAP_PX, SIDE_PX), "white")
    for number, square in enumerate(squares):
        picture.paste(square, (number * (SIDE_PX + GAP_PX), 0))
    picture.save(Path(__file__).with_name("fish.png"), optimize=True)


if __name__ == "__main__":
    main()
