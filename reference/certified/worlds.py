"""`ExactWorld`: a scene in one field: the camera, and surfaces seen from the eye or a light, computed on first use."""

from functools import cached_property
from typing import Any

from flint import fmpq

from rayproof.cases.scene import Cube, Mesh, Plane, Scene, Sphere, Square, Triangle
from rayproof.reference.certified.camera import ExactCamera, view_of
from rayproof.reference.certified.fields import Balls, Number, NumberField, Vector, exact
from rayproof.reference.certified.numbers import Rational, Tower, numbers
from rayproof.reference.certified.shapes import SeenCube, SeenPlane, SeenSphere, SeenTriangle, rational

Seen = SeenSphere | SeenCube | SeenPlane | SeenTriangle
Surface = tuple[int, int]  # shape, face
EYE = -1  # apexes: the eye, or the number of a light


class ExactWorld:
    """The constants of a scene as numbers of `field`."""

    def __init__(self, scene: Scene, field: NumberField) -> None:
        self.scene = scene
        self.field = field
        self.view: ExactCamera = view_of(scene.camera, field)
        self.apexes: dict[int, Rational] = {EYE: rational(scene.camera.eye)}
        self.apexes |= {index: rational(light.position) for index, light in enumerate(scene.lights)}
        self.points = {index: numbers(field, point) for index, point in self.apexes.items()}
        self.near, self.far = (field.number(exact(value)) for value in (scene.camera.near, scene.camera.far))
        self.one = field.number(fmpq(1))
        self._seen: dict[tuple[int, int, int], Seen] = {}
        self._by_corners: dict[tuple[int, ...], Seen] = {}
        self._columns: dict[float, Vector] = {}
        self._rows: dict[float, Vector] = {}

    @cached_property
    def inverse_pi(self) -> Number:
        """Return 1 / pi."""
        return 1 / self.field.pi()

    @cached_property
    def strengths(self) -> list[list[Number | None]]:
        """Return per light and channel flux / (4 pi), or the flux if shading is simplified; None for no flux."""
        scale = self.field.number(fmpq(1)) if self.scene.shading == "simplified" else self.inverse_pi / 4
        return [
            [self.field.float(flux) * scale if flux else None for flux in light.flux] for light in self.scene.lights
        ]

    @cached_property
    def albedos(self) -> list[Vector]:
        """Return per shape the albedo of each channel."""
        return [numbers(self.field, rational(shape.albedo)) for shape in self.scene.shapes]

    def seen(self, surface: Surface, apex: int) -> Seen:
        """Return a surface as seen from an apex, the same object for faces of a mesh that have the same corners."""
        key = (*surface, apex)
        if key not in self._seen:
            shape, face = self.scene.shapes[surface[0]], surface[1]
            corners = (surface[0], *shape.faces[face].tolist(), apex) if isinstance(shape, Mesh) else key
            if corners not in self._by_corners:
                self._by_corners[corners] = _see(self.field, self.scene, surface, self.apexes[apex])
            self._seen[key] = self._by_corners[corners]
        return self._seen[key]

    def direction(self, px: float, py: float) -> Vector:
        """Return the direction of depth 1 through an image point [px]; parts of rows and columns are cached."""
        column = self._columns.get(px)
        if column is None:
            column = self._columns.setdefault(px, self.view.sideways(px))
        row = self._rows.get(py)
        if row is None:
            row = self._rows.setdefault(py, self.view.upwards(py))
        return (column[0] + row[0], column[1] + row[1], column[2] + row[2])


class Worlds:
    """A scene at every precision that was requested, and in exact numbers."""

    def __init__(self, scene: Scene) -> None:
        self.scene = scene
        self._balls: dict[int, ExactWorld] = {}

    def balls(self, bits: int) -> ExactWorld:
        """Return the scene in balls of `bits` bits; call it inside `precision(bits)`."""
        if bits not in self._balls:
            self._balls[bits] = ExactWorld(self.scene, Balls(bits))
        return self._balls[bits]

    def tower(self) -> ExactWorld:
        """Return the scene in a new field of exact numbers."""
        return ExactWorld(self.scene, Tower())


def _see(field: NumberField, scene: Scene, surface: Surface, apex: Rational) -> Seen:
    shape: Any = scene.shapes[surface[0]]
    if isinstance(shape, Sphere):
        return SeenSphere(field, shape, apex)
    if isinstance(shape, Cube):
        return SeenCube(field, shape, apex)
    if isinstance(shape, Plane | Square):
        return SeenPlane(field, shape, apex)
    if isinstance(shape, Triangle | Mesh):
        return SeenTriangle(field, shape, surface[1], apex)
    raise TypeError(f"certified knows no shape {type(shape).__name__}")
