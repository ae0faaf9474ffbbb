"""Which law is put to which case: by default a covering choice, or the whole matrix."""

from collections.abc import Sequence
from fnmatch import fnmatchcase

from rayproof.cases.case import Case
from rayproof.cases.families import select
from rayproof.cases.laws import LAWS
from rayproof.reports.laws.suite import Pair

# Law and case; docs/laws.md says how they were chosen.
DEFAULT: tuple[tuple[str, str], ...] = (
    ("rigid", "random_scenes/seed_2"),
    ("rigid", "parallel_rays/cubes"),
    ("mirror", "random_scenes/seed_2"),
    ("roll", "cameras/panorama"),
    ("crop", "cameras/ordinary"),
    ("resolution", "cameras/portrait"),
    ("up_slid", "cameras/slanted_up"),
    ("target_slid", "cameras/banked"),
    ("clip_join", "clipping/sphere_depth"),
    ("clip_beyond", "primitives/cube"),
    ("clip_measured", "clipping/faces_shell"),
    ("unseen", "behind/sphere"),
    ("unseen", "clipping/sphere_none"),
    ("scale", "transforms/sphere_sheared"),
    ("scale", "shadows/every_blocker"),
    ("sphere_placed", "normals/offset_sphere"),
    ("cube_squares", "inside/cube"),
    ("symmetry", "transforms/cube_sheared"),
    ("square_triangles", "transforms/square_sheared"),
    ("plane_square", "primitives/plane"),
    ("split", "meshes/torus"),
    ("baked", "transforms/mesh_mirrored"),
    ("winding", "sidedness/triangle_lit_from_the_viewer"),
    ("sides_add", "sidedness/square_lit_from_behind"),
    ("sides_add", "sidedness/plane_from_below_two_sided"),
    ("shapes_commute", "nearest/interpenetrating"),
    ("lights_add", "several_lights/inverse_square"),
    ("lights_add", "simplified/lights_at_1.5m"),
    ("light_split", "several_lights/inverse_square"),
    ("light_harmonic", "transforms/sphere_rotated"),
    ("light_hidden", "shadows/every_blocker"),
    ("light_caged", "shadows/every_blocker"),
    ("light_backed", "shadows/every_blocker"),
    ("not_negative", "several_lights/simplified"),
    ("not_negative", "acne/terminator"),
    ("albedo_linear", "several_lights/inverse_square"),
    ("channels", "several_lights/inverse_square"),
    ("flux_power", "several_lights/inverse_square"),
    ("unit_vectors", "normals/turned_to_the_viewer"),
    ("point_on_ray", "transforms/cube_translated"),
    ("light_in_stages", "several_lights/inverse_square"),
    ("light_in_stages", "inverse_square/angle_95"),
    ("light_sees", "shadows/every_blocker"),
    ("camera_inverses", "cameras/ordinary"),
    ("camera_rays", "cameras/ordinary"),
    ("anchor_sphere", "primitives/sphere"),
    ("anchor_floor", "primitives/sphere"),
    ("anchor_sizes", "primitives/sphere"),
    ("anchor_clip", "primitives/sphere"),
)


def chosen(selectors: Sequence[str], *, everything: bool) -> tuple[Pair, ...]:
    """Return the pairs that selectors name: laws, cases, families or globs of either; none: the default choice.

    A case without a law gets every law, or with none named those that the default choice puts to anything.

    Raises:
        LookupError: a selector names neither a law nor a case.

    """
    laws = [law for law in LAWS if any(fnmatchcase(law, selector) for selector in selectors)]
    wanted = [one for one in selectors if not any(fnmatchcase(law, one) for law in LAWS)]
    cases = select(wanted) if wanted else ()
    if not everything and not cases:
        return tuple(pair for pair in default() if not laws or pair.law in laws)
    every_case = cases or select(["*"])
    pairs = [(law, case) for case in every_case for law in (laws or LAWS)]
    own = {law for law in LAWS if LAWS.about(law).get("own", False)}
    return tuple(Pair(law=law, case=case) for law, case in pairs if law not in own or case is every_case[0])


def default() -> tuple[Pair, ...]:
    """Return the covering choice, in its order."""
    cases: dict[str, Case] = {case.name: case for case in select(sorted({name for _, name in DEFAULT}))}
    return tuple(Pair(law=law, case=cases[name]) for law, name in DEFAULT)
