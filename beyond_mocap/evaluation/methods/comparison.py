"""Synthesize scenarios by several methods and measure every take alike."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from ...annotation import Timeline
from ...base.errors import InputError, UserCancelledError
from ...library.library import Library
from ...synthesis.plan import METHODS, Plan
from ...synthesis.quality.playback import playback_from_take
from ...synthesis.synthesize import synthesize
from ...synthesis.take import Take
from .. import figures
from ..annotation_similarity import (
    compute_mean,
    list_had_labels,
    list_requested_labels,
    measure_annotation_similarity,
    measure_similarity,
)
from ..realism import measure_smoothness
from ..view import View
from .scenarios import Scenario

NO_CATCH_UP = "distance-no-catch-up"
"""Method "distance" as in the thesis' chapter 5, which leaves out the catch-up of 3.3.2."""
METHOD_OPTIONS: dict[str, dict] = {
    **{name: {"method": name} for name in METHODS}, NO_CATCH_UP: {"method": "distance", "catch_up": False},
}  # fmt: skip
"""Name in a comparison -> settings of the plan."""


@dataclass(frozen=True, eq=False, kw_only=True)
class MethodResult:
    """What a method made of a scenario.

    Attributes:
        take: the take.
        figures: groups of the report that the tables show (`measure_take`).
        times: (T-1,) s on the track's clock.
        smoothness: (T-1,) m, distance of features from the frame before (Faustino App. D).
        seconds: processor time of the synthesis.
    """

    take: Take
    figures: Mapping
    times: np.ndarray
    smoothness: np.ndarray
    seconds: float


@dataclass(frozen=True, eq=False, kw_only=True)
class MethodComparison:
    """Methods side by side.

    Attributes:
        library: folder of the clips.
        clips: number of recordings, without mirrored ones.
        minutes: of recordings.
        scenarios: in the order of their names.
        methods: in the order in which they were asked for.
        results: (scenario's name, method) -> what came out.
        notes: lines on the scenarios, such as which have no labels.
    """

    library: str
    clips: int
    minutes: float
    scenarios: Sequence[Scenario]
    methods: Sequence[str]
    results: Mapping[tuple[str, str], MethodResult]
    notes: Sequence[str] = ()

    def collect(self, method: str, read: Callable[[MethodResult], float | None]) -> np.ndarray:
        """Collect a figure of a method for each scenario, NaN where it is unknown."""
        values = [read(self.results[scenario.name, method]) for scenario in self.scenarios]
        return np.array([np.nan if value is None else value for value in values], dtype=float)


def choose_methods(text: str) -> tuple[str, ...]:
    """Choose methods by a list of names.

    Args:
        text: names with commas between them.
    Raises:
        InputError: for no name, an unknown one, and one that comes twice.
    """
    names = [name.strip() for name in text.split(",") if name.strip()]
    expected = f"some of {', '.join(METHOD_OPTIONS)}"
    if not names:
        raise InputError("--methods", "no method", expected, "name one or more, with commas between them")
    for place, name in enumerate(names):
        if name not in METHOD_OPTIONS:
            raise InputError("--methods", f"no method is named {name!r}", expected, "correct the name")
        if name in names[:place]:
            raise InputError("--methods", f"{name} twice", "each method once", "remove one of them")
    return tuple(names)


def compare_methods(
    library: Library, scenarios: Sequence[Scenario], methods: Sequence[str], fps: float, seed: int = 0,
    progress: Callable[[float, str], None] | None = None, cancelled: Callable[[], bool] | None = None,
) -> MethodComparison:
    """Synthesize every scenario by every method and measure the takes.

    Where no recording carries the labels of a key moment, the nearest ones serve, for all methods alike.

    Args:
        library: the clips.
        scenarios: tracks with labels.
        methods: names of METHOD_OPTIONS.
        fps: frames per second of the takes.
        seed: of every plan.
        progress: called as progress(fraction, text).
        cancelled: returns whether to stop.
    Raises:
        UserCancelledError: when `cancelled` returns true.
    """
    results, pairs = {}, [(scenario, method) for scenario in scenarios for method in methods]
    for number, (scenario, method) in enumerate(pairs):
        if cancelled is not None and cancelled():
            raise UserCancelledError("compare: cancelled")
        if progress is not None:
            progress(number / len(pairs), f"{scenario.name}, {method}")
        plan = Plan(track=scenario.track, timeline=scenario.timeline, library=library.folder, fps=fps, seed=seed,
                    nearest=True, **METHOD_OPTIONS[method])
        # what is computed once is no part of the seconds: for the library, and the clips that "path" adds for a track
        if scenario is scenarios[0] or method == "path":
            synthesize(library, plan, cancelled=cancelled)
        started = time.process_time()
        take = synthesize(library, plan, cancelled=cancelled)
        seconds = time.process_time() - started
        results[scenario.name, method] = measure_take(take, library, scenario.timeline, seconds)
    recorded = [clip for clip in library.clips if not clip.mirrored]
    return MethodComparison(library=library.folder, clips=len(recorded), minutes=library.minutes, scenarios=scenarios,
                            methods=methods, results=results)


def measure_take(take: Take, library: Library, timeline: Timeline, seconds: float) -> MethodResult:
    """Measure a take.

    Beside the labels that the method was asked for, `asked` measures those of the scenario alone: automatic locomotion
    differs by method, since only "path" takes its gaits from the clips' labels. `asked_keys` measures those at the key
    moments. Labels that no recording carries count for no method, also where "path" shows them with a synthetic clip.

    Args:
        take: the take.
        library: its clips.
        timeline: the scenario's own labels, not filled.
        seconds: processor time of its synthesis.
    """
    played = playback_from_take(take)
    view = View(played, take.plan.track, take.timeline, library)
    labels = [row and (row & library.labels) or None
              for row in list_requested_labels(timeline, played.times, view.moments)]
    key_labels = list_had_labels(view.moments, library.keys)
    similarity = {**measure_annotation_similarity(view),
                  "asked": compute_mean(measure_similarity(labels, played.words)),
                  "asked_keys": compute_mean(measure_similarity(key_labels, [m.words for m in view.moments]))}
    groups = {**figures.measure_path_errors(view), **figures.measure_feet(view), **figures.measure_transitions(view),
              "annotation_similarity": similarity}
    curve = measure_smoothness(played.motion.skeleton, played.positions, view.fps)
    return MethodResult(take=take, figures=groups, times=played.times[1:], smoothness=curve, seconds=seconds)
