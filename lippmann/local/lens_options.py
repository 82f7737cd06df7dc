"""The lenses over a picture as options say them, where no header does."""

from __future__ import annotations

from lippmann.errors import BadInput, LayoutError
from lippmann.lattice.layout import CellLayout, Lattice


def said_lenses(
    px_per_lens: int | None, lens_count: tuple[int, int] | None, lattice: Lattice | None = None
) -> CellLayout | None:
    """Return what --px-per-lens, --lens-count and --lattice say; None if they say nothing.

    Raises
    ------
    BadInput
        If one of them is missing, or they are no lattice.
    """
    options = {"--px-per-lens": px_per_lens, "--lens-count": lens_count, "--lattice": lattice}
    told = [option for option, value in options.items() if value is not None]
    if not told:
        return None
    if px_per_lens is None or lens_count is None:
        raise BadInput(f"expected both --px-per-lens and --lens-count, or neither, got only {' and '.join(told)}")
    try:
        return CellLayout(*lens_count, px_per_lens=px_per_lens, lattice=lattice or "square")
    except LayoutError as error:
        raise BadInput(f"--lens-count and --px-per-lens: {error.message}") from error
