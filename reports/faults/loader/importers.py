"""Planted faults of importers: an angle's axis mixed up, faces lost, indices of 15 bits."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rayproof.reports.exchange.gltf import accessors
from rayproof.reports.exchange.mitsuba_xml import sensors
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import replaced

OTHER = {"smaller": "larger", "larger": "smaller"}


class _OtherAxis:
    """A sensor that says `larger` where its file says `smaller`, and the other way round."""

    def __init__(self, sensor: Any) -> None:
        self._sensor, self.place = sensor, sensor.place

    def get(self, name: str, default: Any) -> Any:
        value = self._sensor.get(name, default)
        return OTHER.get(value, value) if name == "fov_axis" else value


@FAULTS.register("loader/fov_axis_swapped", where="loader", stage=None)
@contextmanager
def fov_axis_swapped() -> Iterator[None]:
    """Exchange the smaller axis and the larger."""
    right = sensors._fovy

    def wrong(sensor: Any, width: int, height: int) -> float:
        return right(_OtherAxis(sensor), width, height)  # type: ignore[arg-type]

    with replaced(right, wrong):
        yield


@contextmanager
def _indices(wrong: Any) -> Iterator[None]:
    """Spoil the indices of glTF's faces."""
    right = accessors.array

    def spoilt(document: Any, index: Any, kind: str) -> np.ndarray:
        found = right(document, index, kind)
        return wrong(found) if kind == "SCALAR" else found

    with replaced(right, spoilt):
        yield


@FAULTS.register("loader/every_other_face", where="loader", stage=None)
def every_other_face() -> Any:
    """Lose every other face."""
    return _indices(lambda indices: indices.reshape(-1, 3)[::2].reshape(-1, 1))


@FAULTS.register("loader/indices_of_15_bits", where="loader", stage=None)
def indices_of_15_bits() -> Any:
    """Cut indices off."""
    return _indices(lambda indices: indices & 0x7FFF)
