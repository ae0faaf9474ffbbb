"""Independent answers: one file (or folder) each, none imports another, none sees the tracer.

To add one: a class that keeps `cases.answers.Reference`, in a new file, under `@REFERENCES.register("name")`.
`independent=True` says that it shares neither code nor Dr.Jit's compiler with the tracer and so can be a witness.
"""

from cases.answers import Reference
from cases.registry import Registry

REFERENCES: Registry[type[Reference]] = Registry("reference", package="reference")
