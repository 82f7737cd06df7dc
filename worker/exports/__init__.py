"""Files in the formats of print shops and of research: from arrays and numbers to disk, one format a module.

pdf              pages with marks, and a picture pixel by pixel; reportlab, only here
hci_parameters   the cameras of a folder of the HCI 4D light field benchmark
pfm              one channel of floats: disparity, depth
ppm              codes of 9 to 16 bits
yuv              raw 8-bit 4:2:0 frames
ray_calibration  the lens grid, in the manner of RayCalibData
npz              NumPy arrays
"""
