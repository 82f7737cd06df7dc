"""Pictures that need not fit in memory.

rows          bands of rows in and out
scratch       pixels in a temporary file as plain numbers
rearrange     pictures rearranged: turned by quarters, all views of a sheet
png           PNG by bands of rows; the rows of a PDF
tiff          TIFF by bands of rows
"""
