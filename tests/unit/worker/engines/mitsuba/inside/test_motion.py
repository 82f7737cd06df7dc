"""The motion of the points of surfaces against what moves them: matrices, vertices, and the rig itself."""

from __future__ import annotations

import io
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from lippmann.job.scenes.stage import Stage
from lippmann.optics.rig.to_scene import rig_to_scene
from worker.engines.mitsuba.inside.messages import Request, UnsupportedError
from worker.engines.mitsuba.inside.program import Program
from worker.engines.mitsuba.inside.scenes.loaded import LoadedScene

CHANNELS = ("motion", "position", "object")


def moved(make_request: Any, *, stage: dict[str, Any] | None = None, **more: Any) -> Request:
    request: Request = make_request(**more)
    job = request.job
    later = job.model_copy(update={"stage": job.stage.model_copy(update=stage or {})})
    return Request.model_validate({**request.model_dump(), "channels": CHANNELS, "next_job": later.model_dump()})


def shaded(scene: Any, later: Any, request: Request) -> dict[str, NDArray[np.float32]]:
    from worker.engines.mitsuba.inside.shade import bands, shade_band

    parts = [shade_band(scene, request, rows, later) for rows in bands(request)]
    return {kind: np.concatenate([part[kind] for part in parts]) for kind in request.kinds}


def turned(mi: Any, degrees: float) -> Any:
    return mi.ScalarTransform4f().translate([2.0, 0, 1]).rotate([0, 1, 0.5], degrees)


def scene_of(mi: Any, shapes: dict[str, Any]) -> Any:
    """Return a scene whose shapes keep their order, as the loaders make it."""
    return mi.load_dict({"type": "scene", **shapes}, optimize=False)


def scenes(mi: Any, shape: dict[str, Any]) -> tuple[Any, Any, NDArray[np.float64]]:
    """Return two scenes in which a shape turns by 10 degrees before a wall, and the matrix from one to the other."""
    wall = {"type": "rectangle", "to_world": mi.ScalarTransform4f().translate([0, 0, -20]).scale(9)}
    matrices = [turned(mi, degrees) for degrees in (20.0, 30.0)]
    both = [scene_of(mi, {"a": {**shape, "to_world": one.scale(4)}, "wall": wall}) for one in matrices]
    step = np.array(matrices[1].matrix, dtype=float) @ np.linalg.inv(np.array(matrices[0].matrix, dtype=float))
    return both[0], both[1], step


@pytest.mark.parametrize("kind", ["cube", "sphere", "disk", "cylinder", "rectangle"])
@pytest.mark.parametrize("mm_per_unit", [1.0, 0.5])
def test_a_shape_that_turns_moves_its_points_and_the_wall_stands(
    mi: Any, make_request: Any, kind: str, mm_per_unit: float
) -> None:
    request = moved(make_request, mm_per_unit=mm_per_unit)
    scene, later, step = scenes(mi, {"type": kind})
    found = shaded(scene, later, request)
    on_shape, on_wall = (found["object"][:, 0] == number for number in (1, 2))
    assert on_shape.sum() > 40
    assert (found["motion"][on_wall] == 0).all()
    # The stage looks along -z with up y from z = far, so the rig frame has the axes of the scene.
    to_scene = rig_to_scene(request.job.stage, auto="right")
    here = found["position"][on_shape] @ to_scene[:3, :3].T + to_scene[:3, 3]
    there = here @ step[:3, :3].T + step[:3, 3]
    expected = (there - here) * mm_per_unit
    assert np.abs(expected).max() > 0.2
    np.testing.assert_allclose(found["motion"][on_shape], expected, atol=2e-4)
    nothing = found["object"][:, 0] == 0
    assert np.isnan(found["motion"][nothing]).all()


def test_a_rig_that_moves_sees_what_stands_move_the_other_way(mi: Any, make_request: Any) -> None:
    request = moved(make_request, stage={"location": (3.0, -2.0, 510.0), "look_at": (3.0, -2.0, 10.0)})
    scene, _, _ = scenes(mi, {"type": "cube"})
    found = shaded(scene, scene, request)
    hit = found["object"][:, 0] > 0
    np.testing.assert_allclose(found["motion"][hit], np.broadcast_to([-3.0, 2.0, -10.0], (hit.sum(), 3)), atol=1e-4)


def test_a_point_of_a_mesh_goes_where_its_vertices_go(mi: Any, make_request: Any) -> None:
    """A triangle of which one corner moves: a point goes by its part of that corner, without a matrix."""

    def triangle(tip: list[float]) -> Any:
        mesh = mi.Mesh("a", 3, 1)
        parameters = mi.traverse(mesh)
        parameters["vertex_positions"] = [-6.0, -6, 0, 6, -6, 0, *tip]
        parameters["faces"] = [0, 1, 2]
        parameters.update()
        return scene_of(mi, {"a": mesh})

    found = shaded(triangle([0.0, 6, 0]), triangle([0.0, 6, 8]), moved(make_request))
    hit = found["object"][:, 0] == 1
    assert hit.sum() > 100
    part_of_tip = (found["position"][hit, 1] + 6) / 12
    expected = np.column_stack([0 * part_of_tip, 0 * part_of_tip, 8 * part_of_tip])
    np.testing.assert_allclose(found["motion"][hit], expected, atol=1e-4)


def test_tiles_have_the_bits_of_the_whole(mi: Any, make_request: Any) -> None:
    scene, later, _ = scenes(mi, {"type": "cube"})
    whole = shaded(scene, later, moved(make_request))["motion"].reshape(48, 48, 3)
    tile = shaded(scene, later, moved(make_request, region=(13, 30, 5, 39)))["motion"].reshape(17, 34, 3)
    np.testing.assert_array_equal(tile, whole[13:30, 5:39])


def test_what_does_not_correspond_is_refused_by_name(mi: Any, make_request: Any) -> None:
    scene, _, _ = scenes(mi, {"type": "cube"})
    request = moved(make_request)
    cube = {"type": "cube", "to_world": mi.ScalarTransform4f().scale(4)}
    group = {"type": "shapegroup", "inside": {"type": "cube"}}
    others: dict[str, dict[str, Any]] = {
        "needs the same shapes in the next frame, got 2 and 1": {"a": cube},
        "needs the same faces in the next frame: 'a', object 1, has others there": {
            "a": {"type": "sphere"}, "wall": {"type": "rectangle"},
        },
    }  # fmt: skip
    for message, shapes in others.items():
        with pytest.raises(UnsupportedError, match=message):
            shaded(scene, scene_of(mi, shapes), request)
    held = scene_of(mi, {"group": group, "one": {"type": "instance", "group": {"type": "ref", "id": "group"}}})
    with pytest.raises(UnsupportedError, match="not rendered with instances, as 'one' is one"):
        shaded(held, held, request)


def test_the_scene_of_the_next_frame_stays_for_it_and_no_third_one(
    mi: Any, make_request: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    scene, _, _ = scenes(mi, {"type": "cube"})
    loaded: list[float] = []

    def load(bundle: Path, job: Any, clock: float) -> LoadedScene:
        loaded.append(clock)
        return LoadedScene(scene=scene, notes=(), reads=frozenset({"clock"}))

    program = Program(load, io.BytesIO())
    request = moved(make_request)
    clock = request.job.clock
    for frame, expected in ((1, [1, 2]), (2, [1, 2, 3]), (3, [1, 2, 3, 4]), (2, [1, 2, 3, 4, 2, 3])):
        program.serve(io.BytesIO(request.model_copy(update={"frame": frame}).line()))
        assert loaded == [clock.at(number) for number in expected]
    assert b"error" not in program.answers.getvalue()  # type: ignore[attr-defined] # a BytesIO


def test_a_request_for_motion_has_the_job_at_the_next_frame_and_no_other_has(make_request: Any) -> None:
    request = moved(make_request)
    for wrong in ({"next_job": None}, {"channels": ("position",)}):
        with pytest.raises(ValueError, match="expected the job at the next frame with the channel motion"):
            Request.model_validate({**request.model_dump(), **wrong})
    assert Stage.model_validate(request.model_dump()["next_job"]["stage"])
