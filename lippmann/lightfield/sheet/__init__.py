"""The sheet of an integral image: cells, assembly, orthoscopic conversion and resampling."""
