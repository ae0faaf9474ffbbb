"""What everything that takes part in tracing a scene goes by."""

from dataclasses import dataclass

from rayproof.cases.scene import Scene
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.device.arrays import ArrayTypes
from rayproof.tracer.device.buffers import DeviceBuffers
from rayproof.tracer.device.kernel_constants import KernelConstants
from rayproof.tracer.plan import Plan


@dataclass(frozen=True, kw_only=True)
class Context:
    """A scene, by which formulas it is traced and how, and where its numbers are."""

    scene: Scene
    configuration: Configuration
    types: ArrayTypes
    plan: Plan
    buffers: DeviceBuffers
    parameters: KernelConstants
