"""The virtual observer: what an eye sees of a print or panel under its lenses.

display              the display in millimetres: pixels, gap, lenses
eye_rays             rays through the pupil of an eye
window               the part of the display in the picture
observe              the picture that one eye sees, with pupil, device pixels and crosstalk
stereo               two eyes, and their pictures put together
viewing_conditions   one eye or two, pupil and focus
moving_eye           the places of a moving eye
reach                the region in which every lens shows an eye light of its own cell
"""
