"""Pages on paper: prints and calibration sheets."""
