"""`ORACLE`, the analytic reference's name among the references, and the stages that a scene needs."""

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

ORACLE = "analytic"


def stages_of(scene: Scene) -> tuple[Stage, ...]:
    """Return the stages that a scene needs: without lights, none from visibility on."""
    stages = tuple(Stage)
    return stages if scene.lights else stages[: stages.index(Stage.VISIBILITY)]
