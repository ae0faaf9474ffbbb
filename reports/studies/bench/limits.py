"""How near kernels come to what the machine can do: the least time that it could need, over the time that they took.

Three things take time, side by side at best: the vector units, which issue every sum, product, comparison and choice;
the unit that divides and takes square roots, one unit in the processors of AMD and Intel (Fog, "Instruction tables");
and the memory that the image is written to. No kernel can beat the slowest of them, and a rate that is measured by a
loop of nothing else is what none exceeds.
"""

from collections.abc import Sequence

from rayproof.cases.scene import Scene
from rayproof.reports.studies.bench.branches import count
from rayproof.reports.studies.bench.kernel_arithmetic import loops, work
from rayproof.reports.studies.bench.kernels import Kernel
from rayproof.reports.studies.bench.records import LimitRecord, MachineRecord

BYTES = 12  # a pixel's three float32 channels


def limit(scene: Scene, kernels: Sequence[Kernel], machine: MachineRecord) -> LimitRecord | None:
    """Return `limit_fraction`, at most about 1, and `limit_by`, what sets it: "operations", "divisions" or "writes".

    `limit_sum_fraction` is by the sum of the three: a kernel at 1 does them one after the other, and only fewer of them
    would make it faster.

    None without a kernel, or with one that loops or whose branches nobody counted: how often its code runs is unknown.
    """
    seconds = sum(kernel.seconds for kernel in kernels)
    if not seconds > 0 or any(loops(kernel.code) or count(kernel.code) != len(kernel.shares) for kernel in kernels):
        return None
    least = {"operations": 0.0, "divisions": 0.0}
    peaks = {"float32": machine["float32"], "float64": machine["float64"]}
    for kernel in kernels:
        for precision, of in work(kernel.code, kernel.shares).items():
            rates = peaks[precision]
            least["operations"] += kernel.lanes * of.operations / rates["operations_per_second"]
            least["divisions"] += kernel.lanes * of.divisions / rates["divisions_per_second"]
            least["divisions"] += kernel.lanes * of.roots / rates["roots_per_second"]
    least["writes"] = scene.camera.width * scene.camera.height * BYTES / machine["write_bytes_per_second"]
    by = max(least, key=lambda name: least[name])
    together = sum(least.values()) / seconds
    return {"limit_fraction": least[by] / seconds, "limit_by": by, "limit_sum_fraction": together}
