"""Questions as digests: whatever decides an answer changes them."""

import pytest

from rayproof.reports.run.reference_cache import machine


@pytest.mark.parametrize("name", ["DRJIT_LIBLLVM_PATH", "RAYPROOF_BACKEND"])
def test_the_compiler_and_the_backend_chosen_are_part_of_every_question(name, monkeypatch):
    monkeypatch.delenv(name, raising=False)
    ask = machine.__wrapped__  # what this process was told first it keeps

    before = ask(("numpy",))
    monkeypatch.setenv(name, "another")

    assert ask(("numpy",)) != before
