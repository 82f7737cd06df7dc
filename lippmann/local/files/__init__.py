"""Files that the local commands read: bundles, job files, lenses and masters."""
