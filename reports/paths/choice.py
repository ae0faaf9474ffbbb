"""Which case is rendered by which other route: few of them, since a frozen kernel is compiled for each scene.

Every route is asked about two cases at least, and each about what it alone does: literals where coefficients are -1,
tables and lights in turn for radiance alone, samples where the width is odd, tiles of each size over each kind of tree.
`rayproof run --paths all` asks every route about every case that it can render. This module imports no Dr.Jit: the
process that plans a run does not need it.
"""

from collections.abc import Mapping

# Case -> the routes by which its radiance, or all its stages, are rendered too.
CHOICE: Mapping[str, tuple[str, ...]] = {
    "alone/concave_mesh": ("numbers", "frames", "tiles of 4 x 4", "tiles of 2 x 2", "one loop"),
    "antialiased/cube": ("samples", "frames of samples", "tiles of 8 x 1"),
    "clipping/faces_none": ("numbers", "frames"),
    "crowds/cubes": ("tiles of 4 x 4",),
    "crowds/ellipsoids": ("numbers", "frames"),
    "crowds/of_several_kinds": ("numbers", "frames", "tiles of 4 x 1"),
    "crowds/squares": ("frames", "frames of tiles", "tiles of 4 x 2"),
    "faces/nine": ("numbers", "frames", "samples", "frames of samples", "tiles of 2 x 2"),
    "flux_conservation/west": ("numbers", "frames"),
    "meshes/rods_above_a_sheet": ("whole triangles",),
    "meshes/slivers": ("frames", "tiles of 2 x 2", "whole triangles"),
    "meshes/wavy_sheet_from_behind": ("tiles of 4 x 4", "tiles of 4 x 2", "one loop"),
    "parallel_rays/flat": ("frames",),
    "several_lights/eight": ("numbers", "frames", "tiles of 4 x 1"),
    "several_lights/simplified": ("frames",),
    "shadows/behind_a_plane": ("tiles of 8 x 1",),
    "shadows/every_blocker": ("numbers", "frames of tiles", "tiles of 8 x 1"),
}
NAMES = (
    "numbers",
    "frames",
    "samples",
    "frames of samples",
    "frames of tiles",
    "tiles of 8 x 1",
    "tiles of 4 x 1",
    "tiles of 4 x 4",
    "tiles of 4 x 2",
    "tiles of 2 x 2",
    "one loop",
    "whole triangles",
)


SHORT = ("numbers", "frames", "samples", "frames of samples")  # their kernels compile in a second, in float64 too
ROUTED = ("float32", "float64")  # configurations; another formula runs through the same routes


def asked(routes: tuple[str, ...], configuration: str) -> tuple[str, ...]:
    """Return those of a case's routes by which one configuration renders it.

    A tile's kernel takes some three seconds to compile in float64: only who asks for everything gets it.
    """
    if configuration not in ROUTED:
        return ()
    if configuration == ROUTED[0] or routes == NAMES:
        return routes
    return tuple(route for route in routes if route in SHORT)


def routes_of(case: str, *, everything: bool) -> tuple[str, ...]:
    """Return by which routes a case is rendered, besides the one that the references judge."""
    return NAMES if everything else CHOICE.get(case, ())
