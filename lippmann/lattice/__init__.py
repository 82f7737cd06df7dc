"""The square and the hexagonal lattice: the places of lenses, and the pixels that belong to them.

* `cell`: the shape of one lens's cell, and what each kind of lattice answers; `square` and `hexagonal` answer it, and
  `kinds` chooses between them
* `lenses`: an array of lenses in any unit: centres, nearest lens, the places in a cell, extent
* `arrays`: the operations on arrays with which lattice and optics are written, on NumPy or another library
* `layout`: an array of lenses over whole pixels: the size of the sheet, the box and the mask of a cell, tile edges

Outside this package nothing needs to know which kind of lattice an array has: the numbers of `Cell` and the questions
that `LensLattice` and `CellLayout` answer are the same for both.
"""
