"""A camera inside a sphere and inside a cube: the nearer root lies behind it and the normal is turned."""

from collections.abc import Iterator

from rayproof.cases.case import Case, UniformValue, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.placement import camera_around, compose, rotation, scaling, shear, translation
from rayproof.cases.scene import Camera, Cube, PointLight, Scene, Shape, Sphere
from rayproof.cases.stages import Stage

ALBEDO = (0.6, 0.7, 0.45)
LIGHT = PointLight(position=(0.5, -0.4, 0.6), flux=(160.0, 120.0, 210.0))
INNER = Sphere(albedo=(0.8, 0.3, 0.4), center=(-0.6, 0.3, -0.2), radius=0.35)
ROOM = compose(translation(0.2, 0.1, 0.1), rotation((0.3, 0.7, -0.4), 27), scaling(4.2, 3.6, 3.9))
SKEW = compose(
    translation(0.2, 0.1, 0.1), rotation((0.3, 0.7, -0.4), 27), shear(xy=0.3, yz=-0.2), scaling(4.2, 3.6, 3.9)
)


def viewpoint(fovy: float) -> Camera:
    """Return a camera a good metre off the middle that looks across it."""
    return camera_around(
        (-0.2, 0.1, -0.1), distance=1.2, azimuth=-30, elevation=25, width=88, height=64, fovy=fovy
    )  # fmt: skip


@CASE_FAMILIES.register("inside")
def inside() -> Iterator[Case]:
    """Yield spheres and cubes seen from within, one- and two-sided, empty and with something inside."""
    sphere = Sphere(albedo=ALBEDO, center=(0.1, 0.05, -0.1), radius=2.1, two_sided=True)
    stretched = Sphere(albedo=ALBEDO, to_world=SKEW, radius=0.5, two_sided=True)
    cube = Cube(albedo=ALBEDO, to_world=ROOM, two_sided=True)
    skewed = Cube(albedo=ALBEDO, to_world=SKEW, two_sided=True)
    scenes: tuple[tuple[str, str, tuple[Shape, ...]], ...] = (
        ("sphere", "Inside a two-sided sphere with the light: the farther root counts.", (sphere,)),
        ("ellipsoid", "Inside a two-sided ellipsoid: in its space the ray has another length.", (stretched,)),
        ("cube", "Inside a two-sided cube with the light: t_near is negative and the hit is t_far.", (cube,)),
        ("skew_cube", "Inside a sheared two-sided cube: six normals that are not orthogonal.", (skewed,)),
        ("sphere_in_cube", "A sphere inside a cube, both seen from within the cube, with its shadow.", (cube, INNER)),
    )  # fmt: skip
    for name, stresses, shapes in scenes:
        scene = Scene(camera=viewpoint(84), shapes=shapes, lights=(LIGHT,))
        yield Case(
            name=f"inside/{name}",
            scene=scene,
            stresses=stresses,
            covers=covering(scene, "CAM-5", "LIT-4"),
            least_interior=4500,
            most_edge=0.03,
        )
    one_sided = Sphere(albedo=ALBEDO, center=(0.1, 0.05, -0.1), radius=2.1)
    scene = Scene(camera=viewpoint(60), shapes=(one_sided,), lights=(LIGHT,))
    yield Case(
        name="inside/one_sided_sphere",
        scene=scene,
        stresses="Inside a one-sided sphere: it is hit from within, and black.",
        covers=covering(scene),
        least_interior=5000,
        most_edge=0.01,
        expectations=tuple(
            UniformValue(
                stage=Stage.RADIANCE,
                shape=0,
                channel=channel,
                value=0.0,
                relative=0.0,
                because="one-sided and seen from behind",
            )
            for channel in range(3)
        ),
    )
