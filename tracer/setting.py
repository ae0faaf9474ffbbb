"""What everything that takes part in tracing a scene goes by."""

from dataclasses import dataclass

from cases.scene import Scene
from tracer.arrays import ArrayTypes
from tracer.assets import Assets
from tracer.configuration import Configuration
from tracer.parameters import Parameters
from tracer.plan import Plan


@dataclass(frozen=True, kw_only=True)
class Setting:
    """A scene, by which formulas it is traced and how, and where its numbers are."""

    scene: Scene
    configuration: Configuration
    types: ArrayTypes
    plan: Plan
    assets: Assets
    parameters: Parameters
