"""The paths under which the API serves things."""

from __future__ import annotations

API = "/api/v1"


def artifact_url(job_id: str, name: str) -> str:
    """Return the path of an artifact of a job."""
    return f"{API}/jobs/{job_id}/artifacts/{name}"


def archive_url(job_id: str, output: str) -> str:
    """Return the path of the zip with all files of an output."""
    return f"{API}/jobs/{job_id}/outputs/{output}.zip"


def signed_url(job_id: str, name: str, *, token: str) -> str:
    """Return the path of an artifact of a job for whoever has the token."""
    return f"{API}/links/{job_id}/{name}?token={token}"


def atlas_url(job_id: str, frame: int, *, max_px: int) -> str:
    """Return the path of the atlas of a frame's views."""
    return f"{API}/jobs/{job_id}/frames/{frame}/views.atlas?max_px={max_px}"


def depth_map_url(job_id: str, frame: int) -> str:
    """Return the path of the depth map of a frame's central view."""
    return f"{API}/jobs/{job_id}/frames/{frame}/depth.map"


def log_url(job_id: str, task_id: str) -> str:
    """Return the path of the log of a task."""
    return f"{API}/jobs/{job_id}/tasks/{task_id}/log"


def poster_url(scene: str) -> str:
    """Return the path of the poster of a scene."""
    return f"{API}/scenes/{scene}/poster.png"
