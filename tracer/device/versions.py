"""What computed the tracer's answers: versions, backend and the flags that change its arithmetic."""

import importlib.metadata
import os

import drjit as dr

from rayproof.tracer.device.arrays import array_types, backend
from rayproof.tracer.device.llvm import VARIABLE


def versions() -> dict[str, str]:
    """Return drjit, backend, llvm, llvm_path and the flags FastMath and others, as text for the report."""
    array_types("float32")
    name = backend()
    facts = {"drjit": importlib.metadata.version("drjit"), "backend": name}
    if name == "llvm":
        facts["llvm"] = ".".join(map(str, dr.detail.llvm_version()))
        facts["llvm_path"] = os.environ.get(VARIABLE, "chosen by Dr.Jit")
    else:
        facts["cuda"] = ".".join(map(str, dr.detail.cuda_version()))
    for flag in ("FastMath", "SymbolicLoops", "OptimizeLoops", "ConstantPropagation"):
        facts[f"drjit_{flag}"] = "on" if dr.flag(getattr(dr.JitFlag, flag)) else "off"
    return facts
