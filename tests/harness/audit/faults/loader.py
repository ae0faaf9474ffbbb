"""Planted faults of the mesh loader."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import numpy as np

from rayproof.cases import gltf_document, mesh_files, placement
from rayproof.reports.interchange import mitsuba_scene
from tests.harness.audit.faults import FAULTS, replaced


@FAULTS.register("loader/axes_swapped", where="loader", stage=None)
@contextmanager
def axes_swapped() -> Iterator[None]:
    """Spoil what every renderer is given.

    The mesh loader exchanges y and z.
    """
    right = mesh_files.read_mesh

    def wrong(*asked: Any) -> tuple[Any, Any]:
        vertices, faces = right(*asked)
        return vertices[:, [0, 2, 1]], faces

    with replaced(right, wrong):
        yield


@FAULTS.register("loader/baked_not_moved", where="loader", stage=None)
@contextmanager
def baked_not_moved() -> Iterator[None]:
    """Spoil the triangles that every renderer shares.

    Baking forgets the translation.
    """
    right = placement.world_triangles

    def wrong(shape: Any) -> Any:
        return (right(shape) - np.asarray(shape.to_world)[:3, 3]).astype(np.float32)

    with replaced(right, wrong):
        yield


@FAULTS.register("loader/baked_to_half", where="loader", stage=None)
@contextmanager
def baked_to_half() -> Iterator[None]:
    """Spoil the triangles that every renderer shares.

    Baked triangles are rounded to 16 bits.
    """
    right = placement.world_triangles

    def wrong(shape: Any) -> Any:
        return right(shape).astype(np.float16).astype(np.float32)

    with replaced(right, wrong):
        yield


@FAULTS.register("loader/baked_winding", where="loader", stage=None)
@contextmanager
def baked_winding() -> Iterator[None]:
    """Spoil the triangles that every renderer shares.

    Baking leaves the winding of a mirrored mesh.
    """
    right = placement.world_triangles

    def wrong(shape: Any) -> Any:
        return right(shape)[:, [0, 2, 1]] if np.linalg.det(np.asarray(shape.to_world)[:3, :3]) < 0 else right(shape)

    with replaced(right, wrong):
        yield


@FAULTS.register("loader/face_dropped", where="loader", stage=None)
@contextmanager
def face_dropped() -> Iterator[None]:
    """Spoil what every renderer is given.

    The mesh loader loses the last face.
    """
    right = mesh_files.read_mesh

    def wrong(*asked: Any) -> tuple[Any, Any]:
        vertices, faces = right(*asked)
        return vertices, faces[:-1]

    with replaced(right, wrong):
        yield


@FAULTS.register("loader/faces_reversed", where="loader", stage=None)
@contextmanager
def faces_reversed() -> Iterator[None]:
    """Spoil what every renderer is given.

    The mesh loader turns every face round.
    """
    right = mesh_files.read_mesh

    def wrong(*asked: Any) -> tuple[Any, Any]:
        vertices, faces = right(*asked)
        return vertices, faces[:, ::-1]

    with replaced(right, wrong):
        yield


@FAULTS.register("loader/half_precision", where="loader", stage=None)
@contextmanager
def half_precision() -> Iterator[None]:
    """Spoil what every renderer is given.

    The mesh loader rounds to 16 bits.
    """
    right = mesh_files.read_mesh

    def wrong(*asked: Any) -> tuple[Any, Any]:
        vertices, faces = right(*asked)
        return vertices.astype(np.float16).astype(np.float64), faces

    with replaced(right, wrong):
        yield


# Planted faults of importers: an angle's axis mixed up, faces lost, indices of 15 bits.
OTHER = {"smaller": "larger", "larger": "smaller"}


class _OtherAxis:
    """A sensor that says `larger` where its file says `smaller`, and the other way round."""

    def __init__(self, sensor: Any) -> None:
        self._sensor, self.place = sensor, sensor.place

    def __getattr__(self, name: str) -> Any:
        return getattr(self._sensor, name)

    def text(self, name: str, default: str) -> str:
        value = str(self._sensor.text(name, default))
        return OTHER.get(value, value) if name == "fov_axis" else value


@FAULTS.register("loader/fov_axis_swapped", where="loader", stage=None)
@contextmanager
def fov_axis_swapped() -> Iterator[None]:
    """Exchange the smaller axis and the larger."""
    right = mitsuba_scene._fovy

    def wrong(sensor: Any, width: int, height: int) -> float:
        return right(_OtherAxis(sensor), width, height)  # type: ignore[arg-type]

    with replaced(right, wrong):
        yield


@contextmanager
def _indices(wrong: Any) -> Iterator[None]:
    """Spoil the indices of glTF's faces."""
    right = gltf_document.array

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


@FAULTS.register("loader/index_from_one", where="loader", stage=None)
@contextmanager
def index_from_one() -> Iterator[None]:
    """Spoil what every renderer is given.

    The mesh loader's indices are off by one.
    """
    right = mesh_files.read_mesh

    def wrong(*asked: Any) -> tuple[Any, Any]:
        vertices, faces = right(*asked)
        return np.roll(vertices, 1, axis=0), faces

    with replaced(right, wrong):
        yield


@FAULTS.register("loader/last_vertex_moved", where="loader", stage=None)
@contextmanager
def last_vertex_moved() -> Iterator[None]:
    """Spoil what every renderer is given.

    The mesh loader moves one vertex by a millionth.
    """
    right = mesh_files.read_mesh

    def wrong(*asked: Any) -> tuple[Any, Any]:
        vertices, faces = right(*asked)
        return vertices + (np.arange(len(vertices)) == len(vertices) - 1)[:, np.newaxis] * 1e-6, faces

    with replaced(right, wrong):
        yield


@FAULTS.register("loader/merged_duplicates", where="loader", stage=None)
@contextmanager
def merged_duplicates() -> Iterator[None]:
    """Spoil what every renderer is given.

    The mesh loader joins vertices that are near each other.
    """
    right = mesh_files.read_mesh

    def wrong(*asked: Any) -> tuple[Any, Any]:
        vertices, faces = right(*asked)
        return np.round(vertices, 3), faces

    with replaced(right, wrong):
        yield


@FAULTS.register("loader/scaled", where="loader", stage=None)
@contextmanager
def scaled() -> Iterator[None]:
    """Spoil what every renderer is given.

    The mesh loader takes metres for centimetres.
    """
    right = mesh_files.read_mesh

    def wrong(*asked: Any) -> tuple[Any, Any]:
        vertices, faces = right(*asked)
        return vertices * 0.01, faces

    with replaced(right, wrong):
        yield
