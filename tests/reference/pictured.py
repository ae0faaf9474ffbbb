"""Scenes with closed forms in float64, for references that are programs of their own: each render costs a start."""

import numpy as np

from rayproof.cases.scene import Camera, Cube, Mesh, Plane, PointLight, Scene, Sphere, Square, Triangle
from rayproof.cases.stages import Stage

ALBEDO = (0.2, 0.5, 0.9)
FIRST = PointLight(position=(0.3, -0.2, 2.5), flux=(100.0, 70.0, 30.0))
SECOND = PointLight(position=(-1.1, 0.7, 1.5), flux=(10.0, 20.0, 90.0))
MIRRORED_SHEAR = ((-0.9, 0.3, 0.1), (0.2, 1.1, 0.3), (0.1, -0.2, 0.8))


def looking_down(*, height: float, near: float = 0.1, far: float = 100.0, fovy: float = 40.0) -> Camera:
    """Return a camera above the origin that looks along -z with +y up in the image."""
    about = {"fovy": fovy, "width": 25, "height": 19, "near": near, "far": far}
    return Camera(eye=(0, 0, height), target=(0, 0, 0), up=(0, 1, 0), **about)


def floor_points(camera: Camera, samples: int = 1) -> np.ndarray:
    """Return where rays of a camera that looks straight down meet z = 0 [m], (height, width, 3), at `samples`."""
    rows, columns = (np.arange(size * samples) + 0.5 for size in (camera.height, camera.width))
    half = camera.eye[2] * np.tan(np.radians(camera.fovy) / 2)
    x, y = columns / (camera.width * samples) * 2 - 1, 1 - rows / (camera.height * samples) * 2
    grid = np.meshgrid(x * half * camera.aspect, y * half)
    return np.stack([*grid, np.zeros_like(grid[0])], axis=-1)


def floor_irradiance(points: np.ndarray, light: PointLight) -> np.ndarray:
    """Return E [W/m^2] on a horizontal surface that nothing shades."""
    to_light = np.asarray(light.position) - points
    squared = (to_light**2).sum(-1)
    return np.asarray(light.flux) / (4 * np.pi) * (to_light[..., 2] / squared**1.5)[..., None]


def placed(linear, x: float, y: float, z: float) -> tuple:
    """Return a 4x4 matrix of a linear part and a translation [m]."""
    return (*((*row, offset) for row, offset in zip(linear, (x, y, z), strict=True)), (0.0, 0.0, 0.0, 1.0))


def raised(height: float, size: float = 1.0, x: float = 0.0) -> tuple:
    """Return the matrix of a flat thing of some size [m], at a height [m]."""
    return placed(((size, 0, 0), (0, size, 0), (0, 0, 1.0)), x, 0, height)


def tetrahedron(**about) -> Mesh:
    """Return a closed mesh of four faces, wound outward."""
    vertices = np.array([(1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)]) * 0.5
    return Mesh(vertices=vertices, faces=np.array([(0, 1, 2), (0, 2, 3), (0, 3, 1), (1, 3, 2)]), albedo=ALBEDO, **about)


def every_shape() -> Scene:
    """Return one of each shape side by side on a plane, all but that under a mirroring shear."""
    triangle = ((-0.5, -0.4, 0.0), (0.5, -0.4, 0.0), (0.0, 0.5, 0.0))
    place = [placed(MIRRORED_SHEAR, x, y, 1.0) for y in (-1.1, 1.1) for x in (-1.6, 0.0, 1.6)]
    shapes = (
        Sphere(albedo=ALBEDO, center=(0.1, 0.0, 0.1), radius=0.5, to_world=place[0]),
        Cube(albedo=ALBEDO, to_world=place[1]),
        Square(albedo=ALBEDO, to_world=place[2]),
        Triangle(albedo=ALBEDO, vertices=triangle, to_world=place[3]),
        tetrahedron(to_world=place[4]),
        Plane(albedo=ALBEDO, to_world=raised(-0.5)),
    )
    camera = Camera(
        eye=(0.4, -3.0, 7.0), target=(0, 0, 0.5), up=(0, 1, 0.2), fovy=40, width=40, height=30, near=1, far=50
    )
    return Scene(camera=camera, shapes=shapes, lights=(PointLight(position=(1.0, -2.0, 6.0), flux=(50.0, 60.0, 70.0)),))


def answer(reference, scene: Scene, *stages: Stage, samples: int = 1) -> list[np.ndarray]:
    """Return the answers to `stages`, in their order."""
    for stage in stages:
        assert reference.unsupported(scene, stage) is None
    found = reference.render(scene, stages, samples=samples)
    return [found[stage] for stage in stages]


def object_space(scene: Scene, index: int, points: np.ndarray, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return world points [m], and world normals made object-space ones of any length."""
    matrix = np.asarray(scene.shapes[index].to_world)
    return (points - matrix[:3, 3]) @ np.linalg.inv(matrix[:3, :3]).T, directions @ matrix[:3, :3]
