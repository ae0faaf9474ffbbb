"""How near a kernel comes to what the machine can do: its operations at the measured rate, or its writes."""

from typing import Any

from cases.scene import Scene

BYTES = 12  # a pixel's three float32 channels


def limit_fraction(scene: Scene, seconds: float, operations: int, machine: dict[str, Any]) -> float | None:
    """Return the least time that the machine could need over the time that the kernel took; at most about 1.

    The least time is the larger of two: every operation of the kernel's code once a pixel, at half the measured rate of
    multiply-add flops (one instruction is one operation), or the image written at the measured bandwidth. It is a bound
    only for code without loops, in which every operation runs once; None says that it has none to offer.
    """
    if not seconds > 0 or operations <= 0:
        return None
    pixels = scene.camera.width * scene.camera.height
    computing = pixels * operations / (machine["fma_gflops"] * 1e9 / 2)
    writing = pixels * BYTES / machine["write_bytes_per_second"]
    return max(computing, writing) / seconds
