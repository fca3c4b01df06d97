"""The players without a part in a live pass: planned in a thread while the passer runs up, then they watch the ball."""

from __future__ import annotations

from typing import TYPE_CHECKING

from ..core import background

if TYPE_CHECKING:
    from ...beyond_mocap.library.library import Library
    from ...beyond_mocap.motion.motion import Motion
    from ...beyond_mocap.passes.live_passes import LivePass, Rally

KIND = "live watchers"


class PlannedWatchers:
    """How all but passer and receiver watch a pass; planned in a thread once it is started.

    Args:
        library: the library.
        rally: the rally, before the pass is added.
        live_pass: the pass.
        begin: s on the rally's clock at which it begins.
    """

    def __init__(self, library: Library, rally: Rally, live_pass: LivePass, begin: float):
        self._library, self._rally, self._pass, self.begin = library, rally, live_pass, begin
        self._job: background.Job | None = None

    def start(self) -> None:
        """Start to plan, once."""
        if self._job is None:
            self._job = background.Job(KIND, lambda progress, cancelled, _hurry: _build_watchers(
                self._library, self._rally, self._pass, progress, cancelled))

    def poll(self) -> bool:
        """Return True once planning has ended."""
        return self._job is not None and (self._job.poll() or self._job.is_ended)

    def cancel(self) -> None:
        """Stop planning."""
        if self._job is not None:
            self._job.cancel()

    def add_to(self, rally: Rally, at: float) -> tuple[Rally, tuple[str, ...]]:
        """Build the rally in which they watch from `at` s on, once planning has ended.

        Returns:
            The rally, and the names of those who watch: none where planning was cancelled.
        Raises:
            Exception: what went wrong in the thread.
        """
        from ...beyond_mocap.base.errors import UserCancelledError
        from ...beyond_mocap.passes.live_watchers import add_watchers

        job = self._job
        if job is not None and job.error is not None and not isinstance(job.error, UserCancelledError):
            raise job.error
        motions = (job.result if job is not None else None) or {}
        return add_watchers(rally, motions, self._pass, self.begin, at), tuple(motions)


def _build_watchers(library, rally, live_pass, progress, cancelled) -> dict[str, Motion]:
    from ...beyond_mocap.passes.live_watchers import build_watchers

    return build_watchers(library, rally, live_pass, progress, cancelled)
