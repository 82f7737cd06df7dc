"""Files of imaging lenses and of their glasses: text in, a checked prescription out.

csv_files       prescriptions in CSV files
zemax           prescriptions in Zemax files (.zmx)
codev           prescriptions in CODE V files (.seq)
glasses         glass catalogues (.agf) and the glass of a name
lines           a line of a file: its word, its numbers, and the error that names it
rows            the surface rows of all formats
system          aperture, field and object, as all formats describe them
semi_apertures  the semi-diameters that a file does not give, from its aperture and field
rims            the rims that are reduced because neighbouring surfaces would cross
lens_file       the prescription of a file, the file's names of its surfaces, and notes
"""
