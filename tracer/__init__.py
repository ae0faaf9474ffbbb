"""The renderer under test: the specification's formulas, in Dr.Jit only."""

from rayproof.tracer.kernel import compiler

# Dr.Jit loads LLVM when it is imported, so the choice must be made before any module below can import it.
compiler.choose_packaged_llvm()
