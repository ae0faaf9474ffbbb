"""The memory's guard: a verdict is found again for exactly the answers, the case and the demands that it was of."""

import os
import tempfile
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from cases.stages import Stage
from reports.cache import judgements
from reports.cache.signing import SIZE
from reports.cache.store import Store
from reports.judge.parties import Candidate
from reports.judge.sentinel import CASE
from reports.run.guards import BrokenHarnessError

_IMAGE = np.linspace(0, 1, 36, dtype=np.float32).reshape(3, 4, 3)
_OURS = Candidate(
    name="guard", precision="float32", items=frozenset(), shadow_epsilon=1e-6, answers={Stage.RADIANCE: _IMAGE}
)
_VERSIONS = {"analytic": "1"}
_RECORD = {
    "name": "guard/judgements",
    "verdict": "fail",
    "scene": "scenes/guard.json",
    "renders": [],
    "shapes": [],
    "lights": 0,
    "width": 4,
    "height": 3,
    "judge_seconds": 1.0,
}


def _key(
    *, case: Any = CASE, ours: Candidate = _OURS, versions: Any = None, asked: Any = ("demand",), files: str = "one"
) -> str:
    return judgements.question(case, [ours], _VERSIONS if versions is None else versions, asked, files=files)


def guard_judgements() -> None:
    """Ask for verdicts whose question is known or another; raise BrokenHarnessError where the answer is wrong."""
    known = _key()
    nudged = _IMAGE.copy()
    nudged[0, 0, 0] = np.nextafter(nudged[0, 0, 0], np.float32(2))
    others = {
        "an answer's last bit": _key(ours=replace(_OURS, answers={Stage.RADIANCE: nudged})),
        "an answer's type": _key(ours=replace(_OURS, answers={Stage.RADIANCE: _IMAGE.astype(np.float64)})),
        "an answer's stage": _key(ours=replace(_OURS, answers={Stage.EXITANCE: _IMAGE})),
        "an epsilon": _key(ours=replace(_OURS, shadow_epsilon=2e-6)),
        "the case": _key(case=replace(CASE, least_interior=1)),
        "a reference's version": _key(versions={"analytic": "2"}),
        "a reference": _key(versions={}),
        "a demand": _key(asked=()),
        "what is kept to look at": _key(files="all"),
    }
    for what, key in others.items():
        if key == known:
            raise BrokenHarnessError(f"the memory is broken: {what} that changed leaves a verdict's question as it was")
    with tempfile.TemporaryDirectory() as folder:
        _guard_entries(Path(folder), known, others["an answer's last bit"])


def _guard_entries(folder: Path, known: str, other: str) -> None:
    """Keep one verdict and ask for it by its question, by another one, and when it was altered."""
    (folder / "scenes").mkdir()
    (folder / _RECORD["scene"]).write_text("{}")
    store = Store(folder / "cache", secret=os.urandom(SIZE))
    judgements.keep(store, known, folder, _RECORD)
    found = judgements.recall(store, known)
    if found is None or found.record != _RECORD or found.files != {_RECORD["scene"]: b"{}"}:
        raise BrokenHarnessError("the memory is broken: a verdict was not found as it was kept")
    if judgements.recall(store, other) is not None:
        raise BrokenHarnessError("the memory is broken: a verdict was found for other answers")
    for item in store.items():
        data = bytearray(item.path.read_bytes())
        data[-1] ^= 1
        item.path.write_bytes(bytes(data))
    if judgements.recall(store, known) is not None:
        raise BrokenHarnessError("the memory is broken: an altered verdict was believed")
