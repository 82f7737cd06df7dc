"""File formats of print shops and of research.

pdf              pages with pictures and marks
npz              NumPy arrays
netpbm           PPM of more than 8 bits, and PFM
yuv              raw video frames
ray_calibration  the calibration file of a lenslet sequence
hci_parameters   the parameters.cfg of the HCI light field benchmark
"""
