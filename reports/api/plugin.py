"""The pytest plug-in: marker `rayproof` and fixture `conformance`.

    @pytest.mark.rayproof("primitives", formula="sphere=mine.py:nearest_hit")
    def test_my_sphere(conformance):
        conformance.check()

It is loaded in every pytest run of the environment, so it imports no other module of rayproof before a test needs it.
"""

from typing import TYPE_CHECKING, Any

import pytest

if TYPE_CHECKING:
    from rayproof.reports.api.conformance import Conformance

MARKER = "rayproof"
FIXTURE = "conformance"
HELP = (
    f"{MARKER}(*selectors, formula=None, configuration='float32', stages=None, precision='float32', "
    "witnesses=('analytic',)): run the test once for each conformance case that the selectors name "
    "(families, family/case, patterns); its argument `conformance` judges. formula is slot/variant or "
    "slot=FILE.py:function, with FILE beside the test; stages are those that your renderer answers."
)
OPTIONS = {"formula", "configuration", "stages", "precision", "witnesses"}


def pytest_configure(config: pytest.Config) -> None:
    """Register the marker."""
    config.addinivalue_line("markers", HELP)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Parametrize a test that uses the fixture: one item per case.

    Raises:
        pytest.UsageError: the test has no marker, or the marker has a case or an option that does not exist.

    """
    if FIXTURE not in metafunc.fixturenames:
        return
    marker = metafunc.definition.get_closest_marker(MARKER)
    if marker is None:
        raise pytest.UsageError(f"{metafunc.definition.nodeid}: {FIXTURE} needs @pytest.mark.{MARKER}(selectors)")
    if unknown := sorted(set(marker.kwargs) - OPTIONS):
        options = ", ".join(sorted(OPTIONS))
        raise pytest.UsageError(f"{metafunc.definition.nodeid}: no option is called {unknown[0]!r}; known: {options}")
    from rayproof.cases.families import select

    try:
        cases = select(marker.args)
    except LookupError as error:
        raise pytest.UsageError(f"{metafunc.definition.nodeid}: {error}") from None
    if not cases:
        raise pytest.UsageError(f"{metafunc.definition.nodeid}: the marker names no case")
    metafunc.parametrize(FIXTURE, cases, ids=[case.name for case in cases], indirect=True)


@pytest.fixture
def conformance(request: pytest.FixtureRequest) -> "Conformance":
    """Judge a renderer on one conformance case: render `conformance.scene`, then call `conformance.check(...)`."""
    from rayproof.reports.api.conformance import Conformance

    marker: Any = request.node.get_closest_marker(MARKER)
    try:
        return Conformance(case=request.param, folder=request.path.parent, **marker.kwargs)
    except (LookupError, ValueError, OSError) as error:
        raise pytest.UsageError(f"{request.node.nodeid}: {error}") from None
