"""What reading one scene may cost in all: counted before anything is built, whichever files and parsers take part.

A file of a kilobyte can ask for gigabytes: by instances of instances, by parameters made of parameters, by arrays
without data. So every reader spends from one budget per scene, and the scene may become larger only with the bytes that
are really there.
"""

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rayproof.cases.scene import SceneError

FREE_BYTES = 64 * 2**20  # that any scene may take once its arrays are unfolded, however small its files are
BYTES_A_BYTE = 16  # more for each byte read: a face of a text mesh has 8 characters and takes 24 bytes
LIMITS = {
    "triangles": 20_000_000,
    "elements": 100_000,  # of a file's tree: XML elements, glTF nodes and primitives
    "references": 1_000_000,  # from element to element, followed again for every instance
    "shapes": 20_000,  # after instances are unfolded
    "includes": 256,  # of XML files in each other
    "levels of nesting": 64,
}


@dataclass(kw_only=True)
class Budget:
    """One scene's budget. What runs out is refused in a sentence that names who asked, what ran out and the limit."""

    read: int = 0  # bytes of files, each once
    meshes: dict[Path, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)  # that were read, by file
    _files: set[Path] = field(default_factory=set)
    _spent: dict[str, int] = field(default_factory=dict)

    def spend(self, what: str, amount: int, *, by: str) -> None:
        """Take `amount` of one of LIMITS for `by`.

        Raises:
            SceneError: there is not so much left.

        """
        self._spent[what] = self._spent.get(what, 0) + amount
        if self._spent[what] > LIMITS[what]:
            raise SceneError(
                f"{by} takes the scene to {self._spent[what]} {what}; at most {LIMITS[what]} {what} are read"
            )

    def expand(self, size: int, *, by: str) -> None:
        """Take `size` bytes of memory for arrays or texts that `by` unfolds to.

        Raises:
            SceneError: the files that were read are too small to need so much.

        """
        self._spent["bytes"] = self._spent.get("bytes", 0) + size
        most = FREE_BYTES + BYTES_A_BYTE * self.read
        if self._spent["bytes"] > most:
            raise SceneError(
                f"{by} takes the scene to {self._spent['bytes']} bytes; files of {self.read} bytes may unfold to at "
                f"most {most} bytes"
            )

    def go_down(self, depth: int, *, by: str) -> None:
        """Raise SceneError if `by` lies too many levels deep."""
        most = LIMITS["levels of nesting"]
        if depth > most:
            raise SceneError(f"{by} lies {depth} levels deep; at most {most} levels of nesting are read")

    def count_file(self, path: Path, size: int) -> None:
        """Count the bytes of a file that is read, the first time."""
        if path not in self._files:
            self._files.add(path)
            self.read += size
