"""How much processor time a search has left."""

import time


class Clock:
    """Processor time [s] that is left for looking."""

    def __init__(self, seconds: float) -> None:
        self._start, self._most = time.process_time(), seconds

    @property
    def spent(self) -> float:
        """Return what is spent [s]."""
        return time.process_time() - self._start

    @property
    def over(self) -> bool:
        """Say whether nothing is left."""
        return self.spent > self._most
