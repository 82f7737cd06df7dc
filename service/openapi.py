"""The API contract as a file: `python -m service.openapi` writes service/openapi.json."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any, cast

from lippmann.plan.artifact_store import ArtifactStore
from service.main import create_app
from service.ports import Parts, Pictures, Scenes
from service.settings import Settings

FILE = Path(__file__).with_name("openapi.json")


def contract() -> str:
    """Return the contract as it is committed."""
    nothing: Any = object()  # an application that is never started uses no implementation
    parts = Parts(store=cast(ArtifactStore, nothing), pictures=cast(Pictures, nothing), scenes=cast(Scenes, nothing))
    described = create_app(Settings(), parts).openapi()
    # The version of the package changes with every release; the contract does not.
    described["info"]["version"] = "1"
    return json.dumps(described, indent=2, ensure_ascii=False, sort_keys=True) + "\n"


if __name__ == "__main__":
    FILE.write_text(contract(), encoding="utf-8")
