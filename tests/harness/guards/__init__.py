"""Guards: questions whose answer is known, put to everything that all renderers share, before a run believes it.

A fault in the mesh loader, in a ledger or in the journal makes every renderer agree, so that no comparison can see it.
`reports.judge.sentinels` guards the judge likewise.
"""

import errno
import tempfile
from collections.abc import Callable

# The machine has run out of something: that says nothing about the harness.
EXHAUSTED = {
    errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EROFS, errno.EMFILE, errno.ENFILE, errno.ENOMEM,
    errno.EIO,  # as SQLite tells whatever it could not write
}  # fmt: skip


class BrokenHarnessError(RuntimeError):
    """The harness got a question wrong whose answer is known; the message says who did and which one."""


def stand_guards() -> None:
    """Ask every guard here.

    Raises:
        BrokenHarnessError: one got a wrong answer; nothing that the harness says can be believed.
        OSError, MemoryError: no guard could be asked, because the disk is full, for example.

    """
    from rayproof.reference import REFERENCES
    from rayproof.reports.judge.oracle import ORACLE
    from tests.harness.guards.cache import guard_cache
    from tests.harness.guards.importers import guard_importers
    from tests.harness.guards.journal import guard_journal
    from tests.harness.guards.judgements import guard_judgements
    from tests.harness.guards.keys import guard_keys
    from tests.harness.guards.ledgers import guard_ledgers
    from tests.harness.guards.loader import guard_loader
    from tests.harness.guards.oracle import guard_oracle
    from tests.harness.guards.report import guard_report

    guards: tuple[Callable[[], None], ...] = (
        guard_loader,
        lambda: guard_oracle(REFERENCES[ORACLE]()),
        guard_ledgers,
        guard_journal,
        guard_cache,
        guard_judgements,
        guard_keys,
        guard_importers,
        lambda: guard_report(REFERENCES[ORACLE]()),
    )
    for guard in guards:
        try:
            guard()
        except (BrokenHarnessError, MemoryError):
            raise
        except OSError as fall:
            if fall.errno in EXHAUSTED:
                raise OSError(fall.errno, fall.strerror, fall.filename or tempfile.gettempdir()) from fall
            raise BrokenHarnessError(_fell(fall)) from fall
        except Exception as fall:  # whatever comes of a broken harness
            raise BrokenHarnessError(_fell(fall)) from fall


def _fell(fall: Exception) -> str:
    return f"the harness is broken: it fell over a known question: {type(fall).__name__}: {fall}"
