"""The ground that all judging of a scene stands on: the oracle's truth, its edges, the scene's conditioning."""

from dataclasses import dataclass, field

from cases.answers import Answers
from cases.scene import Scene
from cases.stages import Stage
from reports.judge.classes import Edges
from reports.judge.conditioning import Conditioning, condition
from reports.judge.limits import Limits, Roundoff, limits
from reports.judge.oracle import FullOracle


@dataclass(frozen=True, kw_only=True)
class Ground:
    """What does not depend on who is judged. Limits are kept, since few kinds of rounding meet in a case."""

    scene: Scene
    truth: Answers
    edges: Edges
    conditioning: Conditioning
    oracle: FullOracle
    _limits: dict[tuple[str, float, bool, bool], Limits] = field(default_factory=dict)

    def limits(self, g: Roundoff, *, by_matrices: bool) -> Limits:
        """Return the limits of one kind of rounding."""
        key = (g.precision, g.scale, g.baked, by_matrices)
        if key not in self._limits:
            self._limits[key] = limits(self.scene, self.truth, self.conditioning, g, by_matrices=by_matrices)
        return self._limits[key]


def ground(scene: Scene, stages: tuple[Stage, ...], oracle: FullOracle, *, known: Answers) -> Ground:
    """Return the ground of a scene; `known` are the oracle's answers as far as they were given already."""
    truth = known if set(stages) <= set(known) else oracle.render(scene, stages)
    return Ground(
        scene=scene, truth=truth, edges=oracle.edges(scene), conditioning=condition(scene, truth), oracle=oracle
    )
