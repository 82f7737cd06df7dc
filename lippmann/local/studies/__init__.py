"""Integral images compared and measured.

compare        integral images on disk compared
codec_rates    rate and distortion of an integral video under several codecs
coding_study   such a study of a folder of frames
plot           axes and curves in one style
"""
