"""Answers of a live rally that are planned while the user has not struck yet.

Planning a pass takes most of a second. What it depends on is known before the user strikes, except for the strike of
the library that is most similar to theirs, and the receiver, if they choose another one. So the likely answers are
planned as soon as the rally waits, the likeliest first and MOST_ANSWERS at most. A strike that none of them answers is
answered as soon as its pass is planned.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from ..base.errors import BeyondMocapError
from .hit_library import LibraryHit
from .hits import HitMotion
from .live_passes import LivePass, Rally
from .strike_means import StrikeMeans

MOST_ANSWERS = 24
"""Most answers that are planned ahead for one state of a rally, about three megabytes each."""
_STRIKES_IN_TURN = 4  # likeliest strikes that are planned for each receiver before others are


@dataclass(frozen=True, eq=False)
class AnswerRequest:
    """What an answer depends on, besides the rally.

    Attributes:
        strike: the library's strike that is played.
        target: name of the receiver.
        bounces: how often the ball bounces.
    """

    strike: LibraryHit
    target: str
    bounces: int

    @property
    def key(self) -> tuple:
        """Equal for requests that have the same answer."""
        hit = self.strike.hit
        return self.strike.clip, hit.part, hit.side, hit.first, self.target, self.bounces


class AnswersAhead:
    """Answers for one state of a rally; errors of what cannot be answered are stored like answers.

    Args:
        means: what the players can strike with.
        rally: the rally, waiting for its holder to act.
        latest: what the user did last; None: nothing yet.
    """

    def __init__(self, means: StrikeMeans, rally: Rally, latest: HitMotion | None = None):
        self.means, self.rally, self.latest = means, rally, latest
        self._answers: dict[tuple, LivePass | BeyondMocapError] = {}
        self._strikes: dict[tuple[str, str], tuple[LibraryHit, ...]] = {}

    def request_for(self, hit: HitMotion, target: str, bounces: int) -> AnswerRequest:
        """Build the request that answers a hit of the user.

        Raises:
            InputError, NotInLibraryError: as `StrikeMeans.find_similar`.
        """
        return AnswerRequest(self.means.find_similar(self.rally.holder, hit), target, bounces)

    def add(self, request: AnswerRequest, answer: LivePass | BeyondMocapError) -> None:
        """Store an answer, or the error that says why there is none."""
        self._answers[request.key] = answer

    def find(self, request: AnswerRequest) -> LivePass | BeyondMocapError | None:
        """Find the answer, or its error; None if it is not planned yet."""
        return self._answers.get(request.key)

    def choose_next(self, part: str, side: str, targets: Sequence[str], bounces: int) -> AnswerRequest | None:
        """Choose what to plan next.

        Args:
            part: part with which the user strikes.
            side: "left", "right", or "" for either.
            targets: receivers, the likeliest first.
            bounces: how often the ball bounces.
        Returns:
            The likeliest answer that is not planned yet; None if there are enough.
        Raises:
            InputError: if the skeleton lacks the part.
        """
        if len(self._answers) >= MOST_ANSWERS:
            return None
        if (part, side) not in self._strikes:
            self._strikes[part, side] = self.means.list_likely(self.rally.holder, part, side, self.latest)
        strikes = self._strikes[part, side]
        for first in range(0, len(strikes), _STRIKES_IN_TURN):
            for target in targets:
                for strike in strikes[first : first + _STRIKES_IN_TURN]:
                    request = AnswerRequest(strike, target, bounces)
                    if request.key not in self._answers:
                        return request
        return None
