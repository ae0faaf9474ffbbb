"""Of a C++ program that shares no code with the tracer mistakes are named, and none is named wrongly."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.diagnosis import MISTAKES, stage_by_stage
from rayproof.reports.diagnosis import search as searching
from rayproof.reports.diagnosis.hypotheses import Hypothesis, estimated, joined
from rayproof.reports.diagnosis.mistakes.formulas import NAME_OF
from rayproof.reports.diagnosis.mistakes.shadows import scattered
from rayproof.reports.diagnosis.search import damages
from rayproof.reports.diagnosis.trials import Continued, Evidence, Tally, trial
from tests.harness.audit import diagnosing

CASES = (
    "primitives/plane",
    "sidedness/square_lit_from_the_viewer",
    "simplified/shadows",
    "transforms/cube_sheared",
    "transforms/mesh_sheared",
    "transforms/sphere_stretched",
)

UNSTEADY = "reported/sphere/1mm_from_3m"
ORACLE = Analytic()
pytestmark = pytest.mark.skipif(diagnosing.compiler() is None, reason="there is no C++ compiler")


@pytest.fixture(scope="module")
def program(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return diagnosing.built(tmp_path_factory.mktemp("mistaken"))


def switched(program: Path, mistake: str) -> diagnosing.Renderer:
    (found,) = (one for one in diagnosing.switched(program) if one.name == mistake)
    return found


@pytest.mark.process
@pytest.mark.parametrize("mistake", ["no_pi", "normal_by_model", "gamma_2_2", "linear_fov", "srgb_albedo"])
def test_a_mistake_is_named_by_all_stages_and_by_radiance_alone(program: Path, mistake: str, tmp_path: Path) -> None:
    for one in diagnosing.outcomes(switched(program, mistake), tmp_path, CASES):
        assert one.failing
        assert one.right, one


@pytest.mark.process
@pytest.mark.parametrize("mistake", ["", "ambient"])
def test_of_what_nobody_knows_nothing_is_named(program: Path, mistake: str, tmp_path: Path) -> None:
    for one in diagnosing.outcomes(switched(program, mistake), tmp_path, CASES):
        assert bool(one.failing) == bool(mistake)
        assert one.named == ()


DAMAGES = (
    "radiance_mirrored", "radiance_upside_down", "columns_first", "height_for_stride", "rows_padded", "one_pixel_late",
    "strip_undrawn", "rows_left_over", "tiles_undrawn", "wrapped_bytes", "bytes_swapped", "half_floats",
)  # fmt: skip
DAMAGED_CASES = (*CASES, "primitives/sphere", "random_scenes/seed_1", "shadows/behind_the_light")


@pytest.mark.process
@pytest.mark.parametrize("damage", DAMAGES)
def test_an_image_that_is_stored_wrongly_is_told_so_and_no_formula_is_named(
    program: Path, damage: str, tmp_path: Path
) -> None:
    for written, evidence in diagnosing.evidence_of(switched(program, damage), tmp_path, DAMAGED_CASES).items():
        named = {name for one in searching.search(evidence).found for name in one.hypothesis.mistakes}

        assert named & switched(program, damage).accepted[0], (damage, written, named)
        if not (
            damage.startswith("radiance_") and written == diagnosing.ALONE
        ):  # one image with that of a wrong camera
            assert {item for name in named for item in MISTAKES[name].items} == {"IMG-1"}, (damage, written, named)


@pytest.mark.process
@pytest.mark.parametrize(
    "mistake",
    ["left_handed", "upside_down", "no_shadows", "far_ignored", "first_hit", "blocks", "jittered", "changing"],
)
def test_no_other_mistake_is_taken_for_an_image_that_is_stored_wrongly(
    program: Path, mistake: str, tmp_path: Path
) -> None:
    cases = (*DAMAGED_CASES, "clipping/sphere_depth", "walls/far", "nearest/spheres")
    for evidence in diagnosing.evidence_of(switched(program, mistake), tmp_path, cases).values():
        failing = [one for one in evidence if one.failed]
        some = [one for one in evidence if not one.failed]
        clock = searching.Clock(60)

        assert failing
        assert searching._damaged(failing[:3], failing, some, clock, clock) == []


def test_a_name_for_a_program_that_has_no_hypothesis_is_a_wrong_name() -> None:
    def said(mistake: str, *, kind: str, named: tuple[str, ...], right: bool) -> diagnosing.Outcome:
        return diagnosing.Outcome(
            programs=kind, mistake=mistake, written=diagnosing.ALONE, failing=3, named=named, right=right, seconds=1.0
        )

    found = [
        said("fog", kind=diagnosing.KNOWN_NONE, named=("no_pi",), right=False),
        said("no_pi", kind=diagnosing.KNOWN_ONE, named=("no_pi", "factor_of_radiance_physical"), right=True),
        said("srgb", kind=diagnosing.KNOWN_ONE, named=(), right=False),
    ]

    rows = {(row["programs"], row["written"]): row for row in diagnosing.table(found)}

    assert [one.mistake for one in found if one.wrong] == ["fog"]
    known = rows["a mistake that has a hypothesis", diagnosing.ALONE]
    assert (known["of"], known["right"], known["class_of_at_most_2"], known["does_not_know"]) == (2, 1, 1, 1)


@pytest.mark.process
def test_a_pair_is_named_only_by_both(program: Path) -> None:
    pair = diagnosing.drawn_pairs(program, 1, seed=3)[0]
    (one,), (two,) = (sorted(names) for names in (pair.accepted[0] - pair.accepted[1], pair.accepted[1]))

    assert [alone.mistakes for alone in pair.alone()] == [(pair.mistakes[0],), (pair.mistakes[1],)]
    assert pair.told([(two, one)])
    assert not any(pair.told([names]) for names in ((one,), (two,), (one, one), (one, "fog")))


@pytest.mark.process
def test_both_of_two_mistakes_are_named_by_all_stages_and_neither_alone(program: Path, tmp_path: Path) -> None:
    first, second = switched(program, "no_pi"), switched(program, "normal_by_model")
    both = replace(
        first, mistakes=(first.name, second.name), accepted=first.accepted + second.accepted, kind=diagnosing.TWO
    )

    for one in diagnosing.outcomes(both, tmp_path, CASES):
        assert one.right == (one.written == diagnosing.STAGED), one
        assert all("+" in name for name in one.named)


@pytest.mark.process
def test_a_switch_that_another_hides_is_no_pair(program: Path, tmp_path: Path) -> None:
    of = {name: switched(program, name) for name in ("no_cosine", "cosine_squared", "no_pi")}

    def both(one: str, two: str) -> diagnosing.Renderer:
        first, second = of[one], of[two]
        return replace(first, mistakes=(one, two), accepted=first.accepted + second.accepted)

    case = ("primitives/plane",)
    assert all(diagnosing.shows_more(both("no_cosine", "no_pi"), tmp_path, case).values())
    hidden = replace(both("no_cosine", "no_pi"), mistakes=("no_pi", "no_pi"))
    assert not any(diagnosing.shows_more(hidden, tmp_path, case).values())


@pytest.mark.process
@pytest.mark.parametrize(
    ("mistake", "case"),
    [("pixel_corner", "flux_conservation/north"), ("no_aspect", "nearest/coincident")],
)
def test_what_rounding_alone_decides_under_a_mistake_does_not_contradict_it(
    program: Path, mistake: str, case: str, tmp_path: Path
) -> None:
    (one,) = diagnosing.evidence_of(switched(program, mistake), tmp_path, (case,))[diagnosing.STAGED]
    (way,) = MISTAKES[mistake].ways

    tally = trial(one, way)

    assert tally is not None
    assert tally.fits
    assert tally.judged > 0.7 * one.wrong.size


# Cases in which a mistake makes surfaces coincide, or puts one to the eye or to a light, or starts feelers on a face.
BY_ROUNDING_ALONE = {
    "no_translation": (
        "acne/layered", "combined/18_mesh_none", "combined/27_square_sheared", "nearest/layers", "watertight/vertices",
    ),
    "behind_the_eye": ("reported/nested_icosahedra", "watertight/feelers"),
    "triangle_no_sum": (
        "combined/31_mesh_sheared", "meshes/divided_box", "watertight/diagonal", "watertight/whole_metres",
    ),
    "normal_not_normalised": ("combined/18_mesh_none", "combined/20_mesh_stretched"),
    "facing_mixed": ("combined/13_triangle_none", "combined/24_mesh_sheared"),
    "blockers_behind": ("tolerances/hall",),
    "rays_by_inverse_transpose": ("acne/grazing", "combined/01_sphere_turned"),
}  # fmt: skip


@pytest.mark.process
@pytest.mark.parametrize("mistake", BY_ROUNDING_ALONE)
def test_a_case_of_rounding_does_not_contradict_the_mistake_that_is_made(
    program: Path, mistake: str, tmp_path: Path
) -> None:
    renderer = switched(program, mistake)
    evidence = diagnosing.evidence_of(renderer, tmp_path, BY_ROUNDING_ALONE[mistake])
    ((name,),) = renderer.accepted
    fitted = MISTAKES[name].fitted
    ways = MISTAKES[name].ways if fitted is None else tuple(fitted([]))
    staged = [Continued(evidence=one) for one in evidence[diagnosing.STAGED]]

    assert len(staged) == len(BY_ROUNDING_ALONE[mistake])
    assert any(fits(one.trial(way) for one in staged) for way in ways)
    assert any(fits(trial(one, way) for one in evidence[diagnosing.ALONE]) for way in ways)


@pytest.mark.process
@pytest.mark.parametrize(
    ("one", "other", "case"),
    [
        # The last hit lies where its own face is seen at a grazing angle, 0.5 degrees, from a light.
        (("last_hit", "last_hit"), ("unit_feelers", "unit_feelers"), "random_scenes/seed_3"),
        # 20 of 7680 pixels are within a rounding of the next whole number.
        (("no_four_pi", "no_four_pi"), ("wrapped_bytes", "wrapped"), "flux_conservation/floor"),
    ],
)
def test_a_case_of_rounding_does_not_contradict_two_mistakes_at_once(
    program: Path, one: tuple[str, str], other: tuple[str, str], case: str, tmp_path: Path
) -> None:
    both = replace(switched(program, one[0]), mistakes=(one[0], other[0]))
    (staged,) = diagnosing.evidence_of(both, tmp_path, (case,))[diagnosing.STAGED]
    (way,) = joined(MISTAKES[one[1]].ways[0], MISTAKES[other[1]].ways[0])

    tally = Continued(evidence=staged).trial(way)

    assert tally is not None
    assert tally.explains
    assert tally.judged > 0.9 * staged.wrong.size


def fits(tallies: Iterable[Tally | None]) -> bool:
    return all(tally is not None and tally.fits for tally in tallies)


@pytest.mark.process
def test_an_offset_of_feelers_is_estimated_from_small_and_large_scenes_together(program: Path, tmp_path: Path) -> None:
    # In the first, a few millimetres large, every offset from 2 cm on has the same image.
    names = ("combined/00_sphere_none", "random_scenes/seed_2", "shadows/every_blocker")
    evidence = diagnosing.evidence_of(switched(program, "offset_5cm"), tmp_path, names)[diagnosing.ALONE]
    offset = MISTAKES["feeler_offset"]
    assert offset.fit is not None

    estimate = estimated(offset.fit, offset.ways[0], evidence)

    assert estimate == pytest.approx(0.05, abs=0.015)


@pytest.mark.parametrize(
    ("fault", "named", "cases"),
    [
        # Light by the lecture's own model stays right where the other model is spoilt, and the other way round.
        ("radiance/fault_srgb", "srgb", ("primitives/sphere", "primitives/plane", "simplified/shadows")),
        ("simplified/fault_over_four_pi", "four_pi_in_simplified", ("primitives/sphere", "simplified/shadows")),
        # A shadow's border is the disc's, of which the right answer knows nothing.
        ("square/fault_disc_local", "square_disc", ("primitives/square", "several_lights/eight", "models/ant")),
        # The tracer passes over spheres by right bounds, which its stages one by one do not.
        ("sphere/fault_discriminant_sign", "sphere/fault_discriminant_sign", ("primitives/sphere", "nearest/spheres")),
        # Another mistake meets spheres in the same place, and has their normals turned by it.
        (
            "sphere/fault_center_ignored",
            "sphere/fault_center_ignored",
            ("primitives/sphere", "normals/offset_sphere", UNSTEADY),
        ),
        ("sphere/fault_negative_root", "negative_root", ("behind/sphere", "behind/all_lit", UNSTEADY)),
        ("clip_none/fault_behind", "clip_none/fault_behind", ("behind/sphere", "behind/cube", "inside/sphere")),
    ],
)
def test_a_fault_of_the_tracer_is_named_by_all_stages(
    fault: str, named: str, cases: tuple[str, ...], tmp_path: Path
) -> None:
    planted = diagnosing.Renderer(
        kind=diagnosing.PLANTED, mistakes=(fault,), accepted=(frozenset({named}),), program=None
    )

    found = diagnosing.outcomes(planted, tmp_path, cases)

    assert [(one.written, one.right) for one in found if one.written == diagnosing.STAGED] == [
        (diagnosing.STAGED, True)
    ]


def test_of_the_tracers_own_fault_what_its_precisions_decide_does_not_contradict_it(tmp_path: Path) -> None:
    fault = "position/fault_left_in_object_space"
    tracer = diagnosing.Renderer(kind=diagnosing.PLANTED, mistakes=(fault,), accepted=(), program=None)
    (one,) = diagnosing.evidence_of(tracer, tmp_path, ("flux_conservation/south",))[diagnosing.STAGED]

    tallies = [trial(one, way) for way in MISTAKES["position_in_object_space"].ways]

    assert any(tally is not None and tally.explains for tally in tallies), "in the right surroundings of the default"


@pytest.mark.parametrize(
    ("fault", "case", "explains"),
    [
        # The tracer loses the sphere to rounding by the formula that it has a mistake in, and not by the right one.
        ("sphere/fault_negative_root", UNSTEADY, False),
        ("sphere/fault_center_ignored", UNSTEADY, False),
        # Whether a shape is met beyond its bounds depends on the rays that the tracer sends together.
        ("sphere/fault_center_ignored", "nearest/lit_crowd", True),
    ],
)
def test_a_case_in_which_the_tracer_answers_by_chance_does_not_contradict_its_own_fault(
    fault: str, case: str, explains: bool, tmp_path: Path
) -> None:
    tracer = diagnosing.Renderer(kind=diagnosing.PLANTED, mistakes=(fault,), accepted=(), program=None)
    evidence = diagnosing.evidence_of(tracer, tmp_path, (case,))
    (staged,), (alone,) = evidence[diagnosing.STAGED], evidence[diagnosing.ALONE]
    way = MISTAKES[NAME_OF[fault]].ways[0]

    assert staged.failed
    for tally in (Continued(evidence=staged).trial(way), trial(alone, way)):
        assert tally is not None
        assert (tally.fits, tally.explains) == (True, explains)


@pytest.mark.process
def test_a_failing_case_that_says_nothing_under_the_right_mistake_does_not_take_its_name(
    program: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    names = ("clipping/sphere_depth", "parallel_rays/flat", "walls/far", "clipping/sphere_shell", "primitives/plane")
    (way,) = MISTAKES["far_ignored"].ways
    asked = Hypothesis(mistakes=("far_ignored",), parameters={}, way=way)
    for module in (searching, stage_by_stage):
        monkeypatch.setattr(module, "singles", lambda _: [asked])

    for evidence in diagnosing.evidence_of(switched(program, "far_ignored"), tmp_path, names).values():
        flat = next(one for one in evidence if one.case == "parallel_rays/flat")
        tally = trial(flat, way)

        assert flat.failed
        assert tally is not None
        assert (tally.fits, tally.agree) == (True, 0), "else it says something"
        assert [one.hypothesis for one in searching.search(evidence).found] == [asked]


def shown(one: Evidence, dark: np.ndarray) -> Evidence:
    """Return what a renderer shows whose radiance is right but where it is dark."""
    light = np.where(dark[..., np.newaxis], 0.0, one.right.answers[Stage.RADIANCE])
    found = Evidence(
        case=one.case, scene=one.scene, load=lambda: {Stage.RADIANCE: light}, failed=True, oracle=ORACLE, undecided=None
    )
    vars(found)["right"] = one.right
    return found


def test_acne_is_scattered_dark_points_and_a_shadow_that_is_missing_light_elsewhere_is_none() -> None:
    case = select(["primitives/sphere"])[0]
    plain = Evidence(case=case.name, scene=case.scene, load=dict, failed=True, oracle=ORACLE, undecided=None)
    size = plain.right.edge.shape
    _, columns = np.indices(size)
    points = np.random.default_rng(1).random(size) < 0.4
    region = columns < size[1] / 2

    assert scattered(shown(plain, points)) is True
    assert scattered(shown(plain, region)) is None
    assert scattered(shown(plain, np.zeros(size, dtype=bool))) is None
    dimmed = shown(plain, np.zeros(size, dtype=bool))
    vars(dimmed)["ours"] = {Stage.RADIANCE: 0.5 * plain.right.answers[Stage.RADIANCE]}
    assert scattered(dimmed) is False


def test_acne_is_seen_where_a_few_other_pixels_are_wrong_and_not_where_many_are() -> None:
    case = select(["primitives/sphere"])[0]
    plain = Evidence(case=case.name, scene=case.scene, load=dict, failed=True, oracle=ORACLE, undecided=None)
    lit = np.any(plain.right.answers[Stage.RADIANCE] > 0, axis=-1) & ~plain.right.edge
    points = np.random.default_rng(1).random(lit.shape) < 0.05
    others = np.argwhere(lit & ~points)
    for count, seen in ((20, True), (100, False)):
        one = shown(plain, points)
        rows, columns = others[:count].T
        one.ours[Stage.RADIANCE][rows, columns] *= 2.0

        assert scattered(one) is seen, "20 of 6912 pixels are few, of 200 wrong ones they are many"


def dark_rows(name: str, first: int, last: int) -> Evidence:
    """Return what a renderer shows whose radiance is right but for some rows, which are black."""
    case = select([name])[0]
    blank = Evidence(case=name, scene=case.scene, load=dict, failed=True, oracle=ORACLE, undecided=None)
    height, width = blank.right.edge.shape
    rows = np.broadcast_to(np.arange(height)[:, np.newaxis], (height, width))
    return shown(blank, (rows >= first) & (rows < last))


def test_rows_are_undrawn_only_if_they_are_the_same_in_another_image_of_that_size() -> None:
    def found(*cases: Evidence) -> list[tuple[str, ...]]:
        return [one.mistakes for one in damages(cases) if one.mistakes == ("undrawn",)]

    # A floor that ends too near by a wrong far plane is cut at a row, too, but not at the same one in each scene.
    floor, wall = dark_rows("primitives/plane", 0, 40), dark_rows("primitives/square", 0, 40)
    nearer = dark_rows("primitives/square", 0, 47)

    assert found(floor, wall)
    assert not found(floor), "one image says nothing of where drawing ends by itself"
    black = [dark_rows(name, 0, 1000) for name in ("primitives/plane", "primitives/square")]
    assert not found(*black), "no surface is cut: light may be missing as well"
    strip = dark_rows("primitives/plane", 20, 40)
    assert found(strip), "but a strip in its midst does"
    assert searching.search([floor, nearer]).found == ()
    assert [one.hypothesis.mistakes for one in searching.search([floor, wall]).found] == [("undrawn",)]
