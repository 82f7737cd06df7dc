"""From a job to its tasks: pure, no input or output.

names      the names of artifacts
sampling   where mm meet px: frame size, tiles along lens edges
foreign    an image from elsewhere: its lenses in pixels, and a rig for its masters
cost       how long a frame takes, and how finely it is cut
tasks      every task, its stage and what it needs
estimate   memory and time before anything is measured
design     what a job will give: the numbers
designer   from a job to its design, with design_lens, design_display, design_words
display_gaps       the gap between pixels and lenses: what a job says, else what serves its depths
calibration        the page of a calibration sheet
print_page         the page of a print: where the array stands, and the marks around it
shapes             what is drawn on paper beside pictures
observed_display   the display that an observer looks at, from a rig
shown_depths       where a display shows the scene, and which depths are worth looking through
"""
