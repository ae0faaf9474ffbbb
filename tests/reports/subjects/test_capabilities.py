"""What a program declares is taken as it is, refused in one line, or, if it does not know the question, nothing."""

from dataclasses import replace

import pytest

from rayproof.cases.placement import compose, rotation, scaling, translation
from rayproof.cases.scene import Square
from rayproof.cases.stages import Stage
from rayproof.reports.subjects.program import ask_capabilities
from rayproof.reports.subjects.protocol import Capabilities, capabilities_from
from tests.reports.subjects.conftest import GREY, SCENE, Writing

# Floors that are seen from behind, one of them two-sided, and partly beyond the far plane.
FLOOR = compose(rotation((1, 0, 0), 180), scaling(9, 9, 1))
BACKS = replace(
    SCENE,
    camera=replace(SCENE.camera, far=6.0, fovy=60.0),
    shapes=(
        *SCENE.shapes,
        Square(albedo=GREY, to_world=compose(translation(4.5, 0, -1), FLOOR)),
        Square(albedo=GREY, two_sided=True, to_world=compose(translation(-4.5, 0, -1), FLOOR)),
    ),
)


def test_everything_that_can_be_declared_is_taken() -> None:
    found = capabilities_from(
        '{"protocol": 1, "name": "mine", "version": "2.1", "precision": "float64", "stages": ["normal", "radiance"],'
        ' "shapes": ["mesh"], "shading": ["simplified"], "clip": ["none"], "two_sided": false, "affine": false,'
        ' "triangulated": true, "chained": true, "world_normals": true,'
        ' "epsilons": {"shadow": 1e-6, "ray": 0.5}}'
    )

    assert found == Capabilities(
        name="mine",
        version="2.1",
        precision="float64",
        stages=(Stage.NORMAL, Stage.RADIANCE),
        shapes=("mesh",),
        shading=("simplified",),
        clip=("none",),
        two_sided=False,
        affine=False,
        triangulated=True,
        chained=True,
        world_normals=True,
        shadow_epsilon=1e-6,
        ray_epsilon=0.5,
    )
    assert found is not None
    assert found.title == "mine 2.1"


WRONG = {
    "no protocol": ('{"name": "mine"}', "protocol must be 1"),
    "another protocol": ('{"protocol": 2}', "protocol must be 1, got 2"),
    "unknown key": ('{"protocol": 1, "colour": true}', "'colour' is not known"),
    "unknown shape": ('{"protocol": 1, "shapes": ["torus"]}', "'torus' is not known; known: sphere"),
    "no list": ('{"protocol": 1, "stages": "normal"}', "stages must be a list of names"),
    "the camera stage": ('{"protocol": 1, "stages": ["camera"]}', "'camera' is not known"),
    "half precision": ('{"protocol": 1, "precision": "float16"}', "'float16' is not known"),
    "no flag": ('{"protocol": 1, "affine": 1}', "affine must be true or false"),
    "a promise in words": ('{"protocol": 1, "chained": "yes"}', "chained must be true or false"),
    "negative epsilon": ('{"protocol": 1, "epsilons": {"shadow": -1}}', "epsilons.shadow"),
    "infinite epsilon": ('{"protocol": 1, "epsilons": {"ray": Infinity}}', "epsilons.ray"),
    "unknown epsilon": ('{"protocol": 1, "epsilons": {"far": 1}}', "epsilons must be an object"),
    "a key of version 2": ('{"protocol": 1, "format": "pfm"}', "'format' belongs to version 2"),
    "sides in a word": ('{"protocol": 1, "two_sided": "never"}', 'true or false, or "always"'),
    "two lights at once": ('{"protocol": 1, "lights": 2}', "lights must be 1"),
    "a sample without a radius": ('{"protocol": 1, "sample_offset": [0, 0]}', "must be [right, down, radius]"),
    "a sample outside": ('{"protocol": 1, "sample_offset": [0, 1, 0]}', "each at most 0.5"),
    "a key of --declare": ('{"protocol": 1, "writes": "a.png"}', "'writes' is not known"),
    "a name of many lines": ('{"protocol": 1, "name": "a\\nb"}', "printable"),
}


@pytest.mark.parametrize(("text", "said"), WRONG.values(), ids=WRONG.keys())
def test_what_is_declared_wrongly_is_refused_in_one_line(text: str, said: str) -> None:
    with pytest.raises(ValueError, match=r"^[^\n]+$") as refused:
        capabilities_from(text)

    assert said in str(refused.value)


@pytest.mark.parametrize(
    ("declared", "said"),
    [
        pytest.param(Capabilities(shapes=("cube", "square")), "no sphere", id="shape"),
        pytest.param(Capabilities(two_sided=False), "no two-sided surfaces", id="one-side"),
        pytest.param(Capabilities(two_sided="always"), "no one-sided surfaces", id="both-sides"),
        pytest.param(Capabilities(affine=False), "shapes[1]", id="affine"),
        pytest.param(Capabilities(shading=("simplified",)), "inverse_square", id="light"),
        pytest.param(Capabilities(clip=("none",)), "clip by depth", id="clip"),
    ],
)
def test_a_scene_beyond_what_was_declared_is_refused_with_the_reason(declared: Capabilities, said: str) -> None:
    assert said in (declared.refusal(BACKS) or "")


@pytest.mark.parametrize(
    ("shapes", "triangulated", "handed"),
    [
        (("sphere", "mesh"), False, {"cube": "mesh", "square": "mesh", "triangle": "mesh"}),
        (("sphere", "triangle"), False, {"cube": "triangle", "square": "triangle", "mesh": "triangle"}),
        (("sphere", "cube", "triangle", "mesh"), False, {"square": "mesh"}),
        (("sphere", "cube", "mesh"), True, {"cube": "mesh", "square": "mesh", "triangle": "mesh"}),
    ],
)
def test_triangles_stand_for_what_a_program_does_not_draw_and_it_is_told(
    shapes: tuple[str, ...], triangulated: bool, handed: dict[str, str]
) -> None:
    able = Capabilities(shapes=shapes, triangulated=triangulated)

    assert able.stand_ins == handed
    assert able.refusal(SCENE) is None
    assert [one.split()[1] for one in able.told(SCENE)] == list(handed)
    assert "no cube" in (Capabilities(shapes=("sphere",)).refusal(SCENE) or "")


@pytest.mark.process
@pytest.mark.parametrize(
    "line",
    ["sys.exit(2)", "pass", "print('a renderer')", "import time; time.sleep(60)", "os.abort()"],
    ids=["exit-code", "silence", "words", "hang", "abort"],
)
def test_a_program_that_does_not_know_the_question_declares_nothing(program: Writing, line: str) -> None:
    assert ask_capabilities(program(line), seconds=0.5) == Capabilities()
