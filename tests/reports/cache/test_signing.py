"""The cache's key: the user's alone, made once, whoever asks at the same time."""

from concurrent.futures import ThreadPoolExecutor

import pytest

from rayproof.reports.cache import signing
from rayproof.reports.cache.signing import NoSecretError, usual_secret


@pytest.fixture
def home(tmp_path, monkeypatch):
    """Return a state folder of our own, in which no key is yet."""
    monkeypatch.delenv(signing.VARIABLE)
    monkeypatch.setenv("XDG_STATE_HOME", str(tmp_path))
    signing._kept.cache_clear()
    yield tmp_path / "rayproof"
    signing._kept.cache_clear()


def test_a_key_is_made_once_and_nobody_else_can_read_it(home):
    first = usual_secret()
    signing._kept.cache_clear()

    assert usual_secret() == first
    assert len(first) == signing.SIZE
    assert [path.name for path in home.iterdir()] == ["cache.key"]
    assert (home / "cache.key").stat().st_mode & 0o777 == 0o600


def test_of_many_that_make_a_key_at_once_one_counts(home):
    home.mkdir()
    with ThreadPoolExecutor(8) as pool:
        secrets = set(pool.map(lambda _: signing._made(home / "cache.key"), range(8)))

    assert len(secrets) == 1


@pytest.mark.parametrize("harm", ["readable", "short", "link", "folder"])
def test_a_key_that_may_be_anybodys_is_none(harm, home):
    usual_secret()
    signing._kept.cache_clear()
    path = home / "cache.key"
    if harm == "readable":
        path.chmod(0o644)
    elif harm == "short":
        path.write_bytes(b"short")
    else:
        path.rename(home / "elsewhere")
        path.symlink_to(home / "elsewhere") if harm == "link" else path.mkdir()

    with pytest.raises(NoSecretError, match="key of the cache"):
        usual_secret()


def test_a_state_folder_that_cannot_be_made_is_a_reason(home):
    home.write_text("a file")

    with pytest.raises(NoSecretError, match="RAYPROOF_CACHE_KEY can give one"):
        usual_secret()


def test_machines_that_were_given_the_same_key_have_the_same_secret(monkeypatch):
    monkeypatch.setenv(signing.VARIABLE, "shared between two machines")
    first = usual_secret()
    monkeypatch.setenv(signing.VARIABLE, "another, of another project")

    assert usual_secret() != first
