"""Pages on paper.

page               the page of a print: the array's pixels and the marks around them
mounting           the sheet that says in mm what goes where
calibration_sheet  the page of a calibration sheet
shapes             black shapes on a page
"""
