"""The benchmark's scenes, large enough to be traced as the benchmark traces them: several samples a lane.

Half the benchmark's size has as many pixels as that takes. Of the thousand spheres as many are asked about as stand in
a tree, since a closed form tries each of them at every pixel, and they are larger: a pixel may be none's.
"""

from collections.abc import Iterator
from dataclasses import replace

from rayproof.cases.benchmark_scenes import chosen
from rayproof.cases.case import Case, covering
from rayproof.cases.families import CASE_FAMILIES
from rayproof.cases.scene import Scene, Sphere

WIDTH, HEIGHT = 512, 256  # px
FEWER, LARGER = 25, 3.0


def _scene(name: str) -> Scene:
    (bench,) = chosen((name,), quick=False)
    return bench.scene(WIDTH, HEIGHT)


def _some_spheres() -> Scene:
    scene = _scene("thousand_spheres")
    spheres = [shape for shape in scene.shapes[:FEWER] if isinstance(shape, Sphere)]
    return replace(scene, shapes=tuple(replace(sphere, radius=LARGER * sphere.radius) for sphere in spheres))


@CASE_FAMILIES.register("benchmarked", on_request=True)
def benchmarked() -> Iterator[Case]:
    """Yield unrolled shapes, eight and four samples in a row; spheres and triangles in a tree, tiles of sixteen."""
    questions: tuple[tuple[str, Scene, str, int], ...] = (
        (
            "sphere_and_floor",
            _scene("sphere_and_floor"),
            "Eight samples a lane, which goes past what none of them can meet.",
            100_000,
        ),
        ("spheres_and_cubes", _scene("spheres_and_cubes"), "Twenty unrolled shapes and four samples a lane.", 12_000),
        ("some_spheres", _some_spheres(), "Spheres in a tree, sixteen rays as one beam.", 10_000),
        ("bumpy_1k", _scene("bumpy_1k"), "A mesh of 1280 faces that shades itself, sixteen rays as one beam.", 30_000),
    )
    for name, scene, stresses, least_interior in questions:
        yield Case(
            name=f"benchmarked/{name}",
            scene=scene,
            stresses=stresses,
            covers=covering(scene),
            least_interior=least_interior,
            most_edge=0.05,
        )
