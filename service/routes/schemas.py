"""The JSON schemas of the job file and of a design, from which the dashboard draws its form, and the presets."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import asdict
from functools import cache
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Header, Response

from lippmann.job.animation.keyframes import ANIMATED_PARTS
from lippmann.job.presets import LENS_ARRAYS, PRESETS
from lippmann.job.spec import CONSTANT_FIELDS, JobSpec
from service.dependencies import ViewerDep
from service.routes.description import NOT_CHANGED

router = APIRouter(prefix="/schemas", tags=["schemas"])


@router.get("/{name}", response_model=dict[str, Any], responses=NOT_CHANGED)
def get_schema(
    name: Literal["job", "design"], _caller: ViewerDep, if_none_match: Annotated[str | None, Header()] = None
) -> Response:
    """Get the JSON schema of a job file or of a design: labels, units, ranges, defaults and descriptions of fields.

    That of a job file has jobs to begin with as `presets`: name, title, description and job. `lens_arrays` has the
    values of the microlens arrays by name; `animation` the parts of a job whose numbers may have keyframes, and the
    fields in them that stay constant.
    """
    text, etag = _text_of(name)
    headers = {"ETag": etag, "Cache-Control": "private, no-cache", "X-Content-Type-Options": "nosniff"}
    if if_none_match is not None and etag in if_none_match:
        return Response(status_code=304, headers=headers)
    return Response(text, media_type="application/json", headers=headers)


def job_schema() -> dict[str, Any]:
    """Return the JSON schema of a job file, with the published imaging lenses as examples, presets and lens arrays.

    It has the rule which numbers may have keyframes, too.
    """
    from lippmann.optics.lens.published import IMAGING_LENSES  # on first use: it imports NumPy

    schema = JobSpec.model_json_schema()
    schema["$defs"]["Rig"]["properties"]["imaging_lens"]["examples"] = sorted(IMAGING_LENSES)
    for name, about in (("name", sorted(IMAGING_LENSES)), ("focal_length_mm", [300])):
        schema["$defs"]["NamedLens"]["properties"][name]["examples"] = about
    schema["animation"] = {"parts": ANIMATED_PARTS, "constant": CONSTANT_FIELDS}
    schema["lens_arrays"] = {name: dict(fields) for name, fields in LENS_ARRAYS.items()}
    schema["presets"] = [{"name": name, **asdict(preset)} for name, preset in PRESETS.items()]
    return schema


@cache
def _text_of(name: Literal["job", "design"]) -> tuple[bytes, str]:
    """Return a schema as JSON, and its ETag."""
    text = json.dumps(_schema_of(name), separators=(",", ":"), ensure_ascii=False).encode()
    return text, f'"{hashlib.sha256(text).hexdigest()[:32]}"'


def _schema_of(name: Literal["job", "design"]) -> Mapping[str, Any]:
    if name == "job":
        return job_schema()
    from service.schemas.design import Design  # on first use: it imports NumPy

    return Design.model_json_schema()
