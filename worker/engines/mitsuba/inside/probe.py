"""Try a variant of Mitsuba: `python probe.py VARIANT` traces a few rays and prints the version.

With an LLVM that is too old, the whole process aborts while it compiles; so this is a process of its own.
"""

from __future__ import annotations

import sys

import drjit
import mitsuba


def main(variant: str) -> None:
    """Trace 16 rays to a rectangle and print the version; whatever is wrong is raised, or ends the process."""
    mitsuba.set_variant(variant)
    scene = mitsuba.load_dict({"type": "scene", "target": {"type": "rectangle"}})
    from_x = drjit.linspace(mitsuba.Float, -0.5, 0.5, 16)
    rays = mitsuba.Ray3f(mitsuba.Point3f(from_x, 0, 1), mitsuba.Vector3f(0, 0, -1))
    # The minimum is what LLVM 15 does not compile.
    hits = drjit.sum(drjit.minimum(scene.ray_intersect(rays).t, 1))
    print(mitsuba.__version__ if hits == len(from_x) else "wrong")  # noqa: T201 - the output is the result


if __name__ == "__main__":
    main(sys.argv[1])
