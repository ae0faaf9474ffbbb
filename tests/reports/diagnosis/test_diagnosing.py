"""What is said of renderers that are wrong in a known way, each made of the oracle and rounded to float32."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rayproof.cases.case import Case
from rayproof.cases.families import select
from rayproof.cases.scene import Plane, Scene, Sphere
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reports.diagnosis import diagnosing
from rayproof.reports.diagnosis.diagnosing import causes_of
from rayproof.reports.diagnosis.evidence import Evidence
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.mistakes import FAMILIES, MISTAKES, Mistake, for_kinds, together
from tests.reports.checks import recorded

CASES = (
    "primitives/sphere",
    "primitives/cube",
    "primitives/mesh",
    "clipping/sphere_depth",
    "several_lights/simplified",
    "transforms/sphere_stretched",
    "transforms/plane_sheared",
    "sidedness/square_lit_from_behind",
    "inverse_square/distance_2m",
)
Renderer = Callable[[Scene, tuple[Stage, ...]], StageImages]


@cache
def cases(*names: str) -> tuple[Case, ...]:
    return tuple(case for case in select(list(names or CASES)) if case.scene.lights)


def shown(renderer: Renderer, *, names: Sequence[str] = (), staged: bool = False) -> list[Evidence]:
    """Return what a renderer shows in some cases."""
    found = []
    for case in cases(*names):
        stages = tuple(stage for stage in stages_of(case.scene) if stage is not Stage.CAMERA)
        with np.errstate(all="ignore"):
            images = renderer(case.scene, stages if staged else (Stage.RADIANCE,))
        ours = {stage: image.astype(np.float32) for stage, image in images.items()}
        one = Evidence(case=case.name, scene=case.scene, load=lambda ours=ours: ours, failed=False)
        one.failed = bool(one.wrong.any())
        found.append(one)
    return found


def by(mistake: type[Mistake]) -> Renderer:
    return lambda scene, stages: mistake().render(scene, stages)


def named(evidence: Sequence[Evidence]) -> set[str]:
    """Return every name that is said of some evidence."""
    findings, searched = causes_of(evidence)
    parts = [part.name for cause in searched.causes for part in cause.mistake.parts or (cause.mistake,)]
    return {finding.name for finding in findings} | set(parts)


@pytest.mark.parametrize("staged", [True, False], ids=["all stages", "radiance alone"])
@pytest.mark.parametrize(
    "name",
    [
        "no_pi",
        "no_falloff",
        "pixel_corner",
        "clips_nothing",
        "fovx_for_fovy",
        "albedo_squared",
        "srgb",
    ],
)
def test_a_mistake_of_the_catalogue_is_named_and_no_other(name: str, staged: bool) -> None:
    assert named(shown(by(MISTAKES[name]), staged=staged)) == {name}


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        ("falloff_exponent", (1.7,)),
        ("factor_of_radiance", (1.3,)),
        ("sample_position", (0.0005, -0.0005)),
        ("gamma", (1.8,)),
    ],
)
def test_numbers_are_fitted(name: str, numbers: tuple[float, ...]) -> None:
    _, searched = causes_of(shown(by(FAMILIES[name].of(numbers))))

    (cause,) = searched.causes
    assert name in {cause.mistake.name, *(one.name for one in cause.alternatives)}
    assert list(cause.mistake.parameters.values()) == pytest.approx(numbers, rel=1e-3)


def test_a_right_renderer_has_no_cause() -> None:
    evidence = shown(lambda scene, stages: Analytic().render(scene, stages))

    assert not any(one.failed for one in evidence)
    assert named(evidence) == set()


def test_a_black_image_is_no_mistake_of_a_formula() -> None:
    assert named(shown(lambda scene, _: {Stage.RADIANCE: np.zeros((scene.camera.height, scene.camera.width, 3))})) == {
        "black"
    }


def test_shadow_rays_from_the_front_of_two_sided_surfaces_are_told_from_one_sided_surfaces() -> None:
    names = ["sidedness/square*", "sidedness/mesh*", "primitives/sphere"]
    evidence = shown(by(MISTAKES["shadow_rays_from_the_front"]), names=names, staged=True)

    assert named(evidence) == {"shadow_rays_from_the_front"}


def test_two_mistakes_in_one_image_are_both_named() -> None:
    both = together(MISTAKES["fovx_for_fovy"], MISTAKES["no_four_pi"])

    found = named(shown(by(both), names=["primitives/sphere", "primitives/cube", "inverse_square/distance_2m"]))

    assert found >= {"no_four_pi"}
    assert len(found) == 2
    assert found & {"fovx_for_fovy", "diagonal_fov", "fixed_fov", "one_fov", "smaller_side_fov"}


def test_a_mistake_of_some_kinds_of_shapes_is_named_for_these() -> None:
    some = for_kinds(MISTAKES["normal_by_model"], (Sphere, Plane))
    assert some is not None

    _, searched = causes_of(
        shown(by(some), names=["transforms/*_stretched", "transforms/*_sheared", "primitives/sphere"])
    )

    (cause,) = searched.causes
    assert cause.mistake.name == "normal_by_model"
    assert "for spheres" in cause.mistake.sentence


def test_half_floats_are_no_obstacle() -> None:
    def renderer(scene: Scene, _: tuple[Stage, ...]) -> StageImages:
        image = Analytic().render(replace(scene, clip="none"), [Stage.RADIANCE])[Stage.RADIANCE]
        return {Stage.RADIANCE: image.astype(np.float16)}

    names = ["clipping/sphere_depth", "clipping/sphere_shell", "primitives/sphere"]

    assert named(shown(renderer, names=names)) == {"clips_nothing", "half_floats"}


def test_eight_bits_of_srgb_decoded_are_stored_wrongly() -> None:
    def renderer(scene: Scene, _: tuple[Stage, ...]) -> StageImages:
        image = np.clip(Analytic().render(scene, [Stage.RADIANCE])[Stage.RADIANCE], 0, 1)
        coded = np.where(image <= 0.0031308, 12.92 * image, 1.055 * image ** (1 / 2.4) - 0.055)
        back = np.round(255 * coded) / 255
        return {Stage.RADIANCE: np.where(back <= 0.04045, back / 12.92, ((back + 0.055) / 1.055) ** 2.4)}

    assert named(shown(renderer, names=["primitives/sphere", "primitives/cube", "primitives/plane"])) == {
        "too_few_bits"
    }


def test_widened_triangles_are_named() -> None:
    assert named(shown(by(MISTAKES["triangles_widened_2"]), names=["primitives/triangle", "primitives/mesh"])) == {
        "triangles_widened_2"
    }


def test_acne_is_dark_points_scattered_over_lit_surfaces() -> None:
    def renderer(scene: Scene, stages: tuple[Stage, ...]) -> StageImages:
        images = Analytic().render(scene, stages)
        dark = np.random.default_rng(3).random(images[Stage.RADIANCE].shape[:2]) < 0.1
        return {stage: np.where(dark[..., np.newaxis], 0.0, image) for stage, image in images.items()}

    assert named(shown(renderer, names=["primitives/sphere", "primitives/plane", "primitives/cube"])) == {"acne"}


CLIPPED = cases("clipping/sphere_depth")[0].scene


def test_acne_beside_another_mistake_hides_neither() -> None:
    def renderer(scene: Scene, stages: tuple[Stage, ...]) -> StageImages:
        if scene is CLIPPED:
            return MISTAKES["clips_nothing"]().render(scene, stages)
        image = Analytic().render(scene, [Stage.RADIANCE])[Stage.RADIANCE]
        dark = np.random.default_rng(3).random(image.shape[:2]) < 0.1
        return {Stage.RADIANCE: np.where(dark[..., np.newaxis], 0.0, image)}

    names = ["primitives/sphere", "primitives/plane", "primitives/cube", "clipping/sphere_depth"]

    assert named(shown(renderer, names=names)) == {"acne", "clips_nothing"}


def test_one_light_that_is_drawn_at_random_is_said_where_there_are_several() -> None:
    def renderer(scene: Scene, _: tuple[Stage, ...]) -> StageImages:
        draw, count = np.random.default_rng(5), len(scene.lights)
        size = scene.camera.height, scene.camera.width
        each = [Analytic().render(replace(scene, lights=(light,)), [Stage.RADIANCE]) for light in scene.lights]
        chosen = draw.integers(0, count, size)[..., np.newaxis]
        return {Stage.RADIANCE: np.choose(chosen, [count * one[Stage.RADIANCE] for one in each])}

    evidence = shown(renderer, names=["several_lights/inverse_square", "random_scenes/seed_1", "primitives/sphere"])

    assert named(evidence) == {"one_light_at_random"}


@pytest.mark.parametrize("staged", [True, False], ids=["all stages", "radiance alone"])
def test_swapped_bytes_are_said_and_hide_no_other_mistake(staged: bool) -> None:
    def renderer(scene: Scene, stages: tuple[Stage, ...]) -> StageImages:
        wrong = MISTAKES["clips_nothing"] if scene is CLIPPED else Analytic
        images = wrong().render(scene, stages)
        return {stage: np.asarray(image, dtype=np.float32).byteswap() for stage, image in images.items()}

    names = ["primitives/sphere", "primitives/cube", "clipping/sphere_depth"]

    assert named(shown(renderer, names=names, staged=staged)) == {"bytes_swapped", "clips_nothing"}


def test_hits_behind_the_eye_are_named_by_all_stages() -> None:
    """The limits of a distance behind the eye were negative, so that nothing was within them."""
    names = ["clipping/sphere_depth", "inside/cube", "primitives/sphere"]

    assert "behind_the_eye" in named(shown(by(MISTAKES["behind_the_eye"]), names=names, staged=True))


def test_a_blank_image_among_others_names_nothing() -> None:
    def renderer(scene: Scene, _: tuple[Stage, ...]) -> StageImages:
        image = Analytic().render(scene, [Stage.RADIANCE])[Stage.RADIANCE]
        dark = isinstance(scene.shapes[0], Plane)
        rows = np.arange(scene.camera.height)[:, np.newaxis, np.newaxis]
        return {Stage.RADIANCE: 0 * image if dark else image * (1 + 0.3 * np.sin(rows))}

    evidence = shown(renderer, names=["primitives/plane", "primitives/sphere", "primitives/cube"])

    assert sum(one.blank for one in evidence) == 1
    assert named(evidence) == set()


def many_lights(scene: Scene) -> Scene:
    place = np.asarray(scene.lights[0].position)
    lights = [replace(scene.lights[0], position=tuple(place + 0.3 * np.array([i % 3, i // 3, 0.0]))) for i in range(9)]
    return replace(scene, lights=tuple(lights))


def steep_view(scene: Scene) -> Scene:
    forward = np.subtract(scene.camera.target, scene.camera.eye)
    aside = 0.1 * np.linalg.norm(forward) * np.asarray(scene.camera.up)
    return replace(scene, camera=replace(scene.camera, up=tuple(map(float, forward + aside))))


@pytest.mark.parametrize(
    ("name", "changed"), [("at_most_8_lights", many_lights), ("another_up_when_steep", steep_view)]
)
def test_what_only_an_unusual_scene_shows_is_named(name: str, changed: Callable[[Scene], Scene]) -> None:
    evidence = []
    for one in cases("primitives/sphere", "primitives/cube"):
        scene = changed(one.scene)
        images = MISTAKES[name]().render(scene, [Stage.RADIANCE])
        evidence.append(Evidence(case=one.name, scene=scene, load=lambda images=images: images, failed=True))

    assert all(one.wrong.any() for one in evidence)
    assert name in named(evidence)


def test_an_accepted_cause_hides_no_new_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Failures that a gate accepts are searched by themselves, and their causes come last."""

    def renderer(scene: Scene, stages: tuple[Stage, ...]) -> StageImages:
        wrong = MISTAKES["clips_nothing"] if scene is CLIPPED else MISTAKES["no_pi"]
        return wrong().render(scene, stages)

    evidence = {one.case: one for one in shown(renderer, names=["primitives/*", "clipping/sphere_depth"])}
    monkeypatch.setattr(diagnosing, "_evidence", lambda _, record, *rest: evidence[record["name"]])
    records = [case(name, float32=1) for name in evidence]
    accepted = set(evidence) - {"clipping/sphere_depth"}

    causes = diagnosing.diagnose(Path(), {"cases": records, "declared": {}}, accepted=accepted)  # type: ignore[typeddict-item]

    assert [cause["mistake"] for cause in causes] == ["clips_nothing", "no_pi"]
    assert "explains 1 of 1 failing case" in causes[0]["sentence"]
    assert f"explains {len(accepted)} of {len(accepted)} accepted failures" in causes[1]["sentence"]


def test_noise_is_no_mistake_of_a_formula() -> None:
    def renderer(scene: Scene, stages: tuple[Stage, ...]) -> StageImages:
        draw = np.random.default_rng(5)
        return {
            stage: image * draw.normal(1, 0.2, image.shape[:2])[..., np.newaxis]
            for stage, image in Analytic().render(scene, stages).items()
        }

    assert named(shown(renderer, names=["primitives/sphere", "primitives/plane", "primitives/cube"])) == {"noise"}


def case(name: str, **failing: int) -> Any:
    """Return a case's record in which each configuration fails so many checks."""
    checks = [recorded(configuration=one, verdict="fail") for one, count in failing.items() for _ in range(count)]
    renders = [{"renderer": f"tracer-{one}", "configuration": one} for one in failing]
    return {"name": name, "checks": [*checks, recorded(configuration="float64")], "renders": renders}
