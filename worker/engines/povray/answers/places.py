"""Places in the files of a scene, for messages that POV-Ray gives for ours: the .pov of a job includes the scene.

POV-Ray notices that something in a scene is not closed only where the scene has ended: in our .pov, or in an include
file of ours. It reports a fault of the first character, and a comment without an end, for the line of the `#include`.
"""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path, PurePosixPath

from povtemplates import literals
from povtemplates.catalogue import INCLUDE_FOLDER
from worker.engines.povray.answers.messages import Message
from worker.engines.povray.scenes.scene_files import SceneFiles

_ILLEGAL = "Illegal character in input file"
_UTF_16 = re.compile(rf"{_ILLEGAL}, value is f[ef]")
"""The first byte of UTF-16, as Windows tools write it."""
_FOUND_INSTEAD = re.compile(r"\b\w+ found instead")
"""The word of our .pov with which POV-Ray noticed it."""


@dataclass(frozen=True)
class ScenePlaces:
    """Translates places in the .pov of a job."""

    pov: Path
    scene: SceneFiles

    def translate(self, message: Message) -> Message:
        """Return a message with the place in the files of the scene that its author knows."""
        file, at = message.file, message.line
        if file is None or at is None:
            return message
        if _UTF_16.match(message.text):
            message = replace(message, text=f"{message.text} Is a file in UTF-16? Save it as UTF-8.")
        if file == self.pov.name and at == self._include_line:
            # The first character, or a comment without an end.
            line = 1 if message.text.startswith(_ILLEGAL) else self._last_line
            return replace(message, file=self.scene.file, line=line)
        is_beyond = file == self.pov.name and at > self._include_line
        if is_beyond or (file.startswith("lippmann/") and (INCLUDE_FOLDER / file).is_file()):
            return self._at_the_end(message)
        return replace(message, file=self.scene.own_name(file))

    def _at_the_end(self, message: Message) -> Message:
        text = _FOUND_INSTEAD.sub("the end of the file found instead", message.text)
        return replace(message, file=self.scene.file, line=self._last_line, text=f"{text} (noticed at the end)")

    @cached_property
    def _include_line(self) -> int:
        include = f'#include "{literals.file_name(PurePosixPath(self.scene.file).name)}"'
        lines = _lines(self.pov)
        return lines.index(include) + 1 if include in lines else len(lines) + 1

    @cached_property
    def _last_line(self) -> int:
        return max(1, len(_lines(self.scene.bundle / self.scene.file)))


def _lines(path: Path) -> list[str]:
    """Return the lines of a file; none if it has disappeared from the scratch folder."""
    try:
        return path.read_text(errors="replace").splitlines()
    except OSError:
        return []
