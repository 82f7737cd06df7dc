"""The glasses of lens files.

search      the glass of a name, from catalogues and the built-in table
agf         glass catalogues (.agf)
dispersion  the dispersion formulas of glass catalogues
"""
