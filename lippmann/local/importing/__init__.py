"""Integral images and views from elsewhere.

import_sheets   integral images imported as masters
import_views    views imported as masters: quilts and folders
import_bundle   imported images as a bundle for a job
"""
