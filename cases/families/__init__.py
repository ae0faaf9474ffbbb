"""Case families: one file each, named after what it stresses; generated, seeded, deterministic.

To add one: a function without parameters that yields `Case`s named `family/case`, in a new file, under
`@CASE_FAMILIES.register("family")`.
"""

from collections.abc import Callable, Iterator

from cases.case import Case
from cases.registry import Registry

CASE_FAMILIES: Registry[Callable[[], Iterator[Case]]] = Registry("case family", package="cases.families")
