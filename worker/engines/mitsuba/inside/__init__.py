"""The program in the sandbox; the only place that imports Mitsuba, Dr.Jit and trimesh."""
