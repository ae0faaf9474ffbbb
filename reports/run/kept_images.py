"""Of which cases a run keeps images: of all, of a sample of those that passed, or of those alone that did not pass.

A case that did not pass keeps everybody's images always. Of one that passed they are there to look at, and the command
that its record names makes them again, so that a run of very many cases need not keep them.
"""

import hashlib
import re
from dataclasses import dataclass

from rayproof.reports.results.outcomes import Outcome

MANY = 2000  # cases of a run; of a longer one that passed, a sample is kept unless somebody asks for more
USUAL_SAMPLE = 0.01
FAILED, ALL = "failed", "all"


@dataclass(frozen=True)
class KeptImages:
    """What is kept of cases that passed: the images of a `share` of them, from 0 to 1; all renderers', if `full`."""

    share: float = 1.0
    full: bool = False  # as EXR files of every renderer, of every case whatever its verdict

    def keeps(self, case: str, outcome: Outcome) -> bool:
        """Say whether the images of a case of this name and verdict are kept; by a digest of the name it is sampled.

        Which cases are in the sample depends on no other case, on no order, and on no machine.
        """
        if self.full or outcome is not Outcome.PASS or self.share >= 1:
            return True
        drawn = int.from_bytes(hashlib.sha256(f"images of {case}".encode(errors="replace")).digest()[:8], "big")
        return drawn < self.share * 2**64

    def __str__(self) -> str:
        """Return it as --keep-images takes it."""
        if self.full:
            return ALL
        return f"sample:{100 * self.share:g}%" if self.share else FAILED


EVERY_CASE = KeptImages()


def images_to_keep(text: str | None, *, cases: int) -> KeptImages:
    """Return what `failed`, `sample:1%` or `all` means; without a text, what is usual for so many cases.

    Raises:
        ValueError: the text is none of these, or the share is not above 0 and at most 100 %.

    """
    if text is None:
        return KeptImages(USUAL_SAMPLE) if cases > MANY else EVERY_CASE
    if text in (FAILED, ALL):
        return KeptImages(0.0) if text == FAILED else KeptImages(full=True)
    found = re.fullmatch(r"sample:([0-9]{1,3}(?:\.[0-9]{1,9})?)%", text)
    if found is None or not 0 < float(found[1]) <= 100:
        raise ValueError(f"--keep-images is failed, all, or a share such as sample:1% (to 100 %), got {text}")
    return KeptImages(float(found[1]) / 100)
