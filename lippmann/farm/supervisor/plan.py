"""The plan of a farm: folder, address, slots."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Self


@dataclass(frozen=True)
class FarmPlan:
    """A one-machine farm as the user asked for it."""

    data_dir: Path
    host: str = "127.0.0.1"
    port: int = 8080
    """The port of the service; 0 takes a free port."""
    slots: int = 1
    public_url: str = ""
    without_povray: bool = False
    """True if this machine has no POV-Ray; the worker then starts all the same."""

    def to_json(self) -> str:
        """Return the plan as text; the inverse of `from_json`."""
        return json.dumps(asdict(self) | {"data_dir": str(self.data_dir)})

    @classmethod
    def from_json(cls, text: str) -> Self:
        """Return the plan in a text."""
        data = json.loads(text)
        return cls(**(data | {"data_dir": Path(data["data_dir"])}))

    @property
    def log_dir(self) -> Path:
        """The folder of the logs of the children."""
        return self.data_dir / "log"

    @property
    def broker_dir(self) -> Path:
        """The folder in which the broker stores its data."""
        return self.data_dir / "broker"

    @property
    def key_file(self) -> Path:
        """The file with the farm's admin key."""
        return self.data_dir / "admin.key"
