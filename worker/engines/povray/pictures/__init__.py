"""The pictures that POV-Ray leaves.

picture       what a picture may be, before it is decoded
pixels        its pixels, read without OpenEXR
depth_codes   the codes of a depth pass as distances
"""
