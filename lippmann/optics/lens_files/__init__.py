"""Files of imaging lenses and of their glasses: text in, a checked prescription out.

csv_files       prescriptions in CSV files
zemax_files     prescriptions in Zemax files (.zmx)
zemax_aspheres  the shape of a surface of a Zemax file, with its term of r^2
zemax_system    the aperture and the field of a Zemax file
zemax_lines     the lines of a Zemax file, surface by surface
codev_files     prescriptions in CODE V files (.seq)
codev_surfaces  a surface of a CODE V file
codev_system    the aperture and the field of a CODE V file
codev_glasses   the private glasses of a CODE V file
codev_commands  the commands of a CODE V file
agf_files       glass catalogues (.agf)
dispersion      the dispersion formulas of glass catalogues
glass_search    the glass of a name, from catalogues and the built-in table
lines           a line of a file: its word, its numbers, and the error that names it
rows            the surface rows of all formats
system          aperture, field and object, as all formats describe them
semi_apertures  the semi-diameters that a file does not give, from its aperture and field
rims            the rims that are reduced because neighbouring surfaces would cross
lens_file       the prescription of a file, the file's names of its surfaces, and notes
"""
