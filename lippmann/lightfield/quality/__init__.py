"""Quality metrics of integral images, and of codecs.

luminance         the luminance of linear light
compare           PSNR and SSIM of two sheets and of every view
rate_distortion   the Bjontegaard difference between two codecs
"""
