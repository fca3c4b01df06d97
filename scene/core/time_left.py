"""How long work will still take, from the share that is done: smoothed, so that the seconds do not jump about."""

from __future__ import annotations

LEAST_SHARE, LEAST_SECONDS = 0.05, 1.0  # before that nothing is said
WEIGHT = 0.25  # of each new share in the smoothed end
RISE = 1.3  # seconds shown only grow where they are wrong by this factor
STEP = 5  # above ten seconds they are rounded to as many


class TimeLeft:
    """An estimate of the seconds that are left of some work, which runs since `start`; times in seconds of one clock.
    """

    def __init__(self, start: float):
        """Begin.

        Args:
            start: seconds, when the work began.
        """
        self._start, self._share, self._end, self._shown = start, 0.0, None, None

    def add_share(self, share: float, now: float) -> None:
        """Take in how much is done.

        Args:
            share: 0 to 1; a share below the one before begins again, as work in several parts does.
            now: seconds.
        """
        if share < self._share:
            self._start, self._end, self._shown = now, None, None
        if share == self._share:
            return
        self._share = share
        if share < LEAST_SHARE or now - self._start < LEAST_SECONDS:
            return
        end = self._start + (now - self._start) / share
        self._end = end if self._end is None else self._end + WEIGHT * (end - self._end)

    def compute_seconds(self, now: float) -> float | None:
        """Compute the seconds that are left.

        Args:
            now: seconds.
        Returns:
            Seconds, at least 1; None while too little is done to tell.
        """
        if self._end is None:
            return None
        left = max(self._end - now, 1.0)
        if self._shown is None or left < self._shown or left > RISE * self._shown:
            self._shown = left
        return self._shown

    def describe(self, now: float) -> str:
        """Describe the time left, such as "about 6 s left"; "" while too little is done to tell.

        Args:
            now: seconds.
        """
        seconds = self.compute_seconds(now)
        if seconds is None:
            return ""
        if seconds >= 90.0:
            return f"about {seconds / 60.0:.0f} min left"
        return f"about {round(seconds) if seconds < 10.0 else STEP * round(seconds / STEP)} s left"
