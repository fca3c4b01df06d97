"""Clean a trial: exchange swapped labels back, remove jumps, label unlabeled markers, fill gaps (Fredriksson section
5.1).

The source did this by hand, for four of seven subjects. Here each marker is compared with the markers that carry it
(`carriers`), and only clear contradictions are changed; a clean trial is returned as it was. The report describes what
was done.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import NamedTuple

import numpy as np

from ...base.errors import InputError, TimedMessage, UserCancelledError, format_some
from ...base.time_series import find_runs
from ..trial import MarkerTrial
from .carriers import find_carriers, measure_softness
from .gaps import GapLimits, fill_gaps
from .pieces import assign_labels, detect_leaps, find_unlabeled, remove_jumps
from .swaps import correct_double_leaps, correct_swaps

# A marker is reported whose deviation exceeds so many times its tolerance for so many seconds.
_STRAY_RATIO, _STRAY_SECONDS = 1.5, 0.1
_BREAK_MARGIN = 3  # frames from a leap or a gap within which such a stretch must begin or end


_LONGEST_FILLING = 0.08  # s up to which a soft or curved filling is evidence for a pose
_MAX_LINES = 6  # messages of one kind; with more, one message covers all markers


@dataclass(frozen=True, kw_only=True)
class Stretch:
    """A finding between two moments.

    Attributes:
        labels: the markers concerned.
        start: seconds on the trial's clock, the first frame.
        end: seconds, the last frame.
        frames: number of frames.
        how: what was done, in a word; "" where nothing could be done.
        off: metres by which the marker was off its place.
    """

    labels: tuple[str, ...]
    start: float
    end: float
    frames: int
    how: str = ""
    off: float = 0.0

    def format_time(self) -> str:
        """Format the time, as `at 1.234 s` or `1.234 to 1.300 s`."""
        return f"at {self.start:.3f} s" if self.frames == 1 else f"{self.start:.3f} to {self.end:.3f} s"


@dataclass(frozen=True, kw_only=True)
class CleanReport:
    """What was found and done.

    Attributes:
        seen: label -> share of the frames in which the recording shows it.
        gaps: filled gaps; `how` is "cluster", "soft" or "spline".
        left: gaps that stay open.
        swaps: `how` is "mended" (exchanged back, and corrected) or ""; the labels are in pairs.
        jumps: samples that were removed (filled again where a gap says so).
        assigned: (unlabeled marker, label).
        strayed: markers that stay far from where their carriers predict them.
        unnamed: unlabeled markers that remain, with their share of frames.
    """

    seen: Mapping[str, float] = field(default_factory=dict)
    gaps: tuple[Stretch, ...] = ()
    left: tuple[Stretch, ...] = ()
    swaps: tuple[Stretch, ...] = ()
    jumps: tuple[Stretch, ...] = ()
    assigned: tuple[Stretch, ...] = ()
    strayed: tuple[Stretch, ...] = ()
    unnamed: Mapping[str, float] = field(default_factory=dict)

    @property
    def lines(self) -> tuple[str, ...]:
        """Messages for people, the most serious first; each has its seconds (`errors.line_spans`)."""
        return (*(_describe_swap(swap) for swap in self.swaps),
                *(_build_line(f"{one.labels[0]} labeled as {one.labels[1]} {one.format_time()}", [one])
                  for one in self.assigned), *_describe_by_label(self.jumps, "jumping frames removed"),
                *_describe_by_label(self.strayed, "frames far from where the surrounding markers place it"),
                *_describe_by_label(self.left, "occluded frames left open"),
                *_summarize(self.gaps, "occluded frames filled"))

    def as_dict(self) -> dict:
        """Return the report as plain values, for JSON."""
        return asdict(self) | {"lines": list(self.lines)}


def _describe_swap(swap):
    """Describe a swap of labels."""
    pairs = ", ".join(f"{a} and {b}" for a, b in zip(swap.labels[::2], swap.labels[1::2]))
    done = "were exchanged, corrected" if swap.how else "seem exchanged, not corrected: no markers around confirm it"
    return _build_line(f"{pairs} {done} {swap.format_time()}", [swap])


def _describe_by_label(stretches, what):
    """Describe stretches in one message for each label; labels with the same stretches share one, many labels share
    a summary.
    """
    by_label: dict[str, list] = {}
    for stretch in stretches:
        by_label.setdefault(stretch.labels[0], []).append(stretch)
    groups: dict[tuple, list[str]] = {}
    for label, own in by_label.items():
        groups.setdefault(tuple((one.start, one.frames) for one in own), []).append(label)
    if len(groups) > _MAX_LINES:
        yield from _summarize(stretches, what)
        return
    for labels in groups.values():
        own = by_label[labels[0]]
        count = sum(one.frames for one in own)
        noun = what if count != 1 else what.replace("frames", "frame")
        times = format_some([one.format_time() for one in own], 3)
        yield _build_line(f"{_format_labels(labels)}: {count} {noun}: {times}", own)


def _summarize(stretches, what):
    """Describe all stretches in one message: how many frames, and the markers with the most."""
    count: dict[str, int] = {}
    for stretch in stretches:
        count[stretch.labels[0]] = count.get(stretch.labels[0], 0) + stretch.frames
    most = sorted(count, key=lambda label: -count[label])
    listed = ", ".join(f"{label} {count[label]}" for label in most[:5]) + (", ..." if len(most) > 5 else "")
    if count:
        yield _build_line(f"{sum(count.values())} {what}: {listed}", stretches)


def _format_labels(labels):
    """Format labels, as `LKNE`, `LKNE and LANK`, or `46 markers (LFHD, RFHD, LBHD, ...)`."""
    if len(labels) > 4:
        return f"{len(labels)} markers ({', '.join(labels[:3])}, ...)"
    return " and ".join([", ".join(labels[:-1]), labels[-1]] if len(labels) > 1 else labels)


def _build_line(text, stretches):
    return TimedMessage(text, *((stretch.start, stretch.end) for stretch in stretches))


@dataclass(frozen=True, kw_only=True)
class CleanSettings:
    """Options of the clean-up.

    Attributes:
        swaps: exchange swapped labels back.
        jumps: remove jumps.
        assign: label unlabeled markers.
        longest_gap: seconds up to which a gap is filled by firm carriers; 0 for none.
        longest_soft_gap: seconds up to which a gap is filled by soft carriers; 0 for none.
        longest_spline: seconds up to which a gap is filled by a curve alone; 0 for none.
    Raises:
        InputError: if a duration is negative or infinite.
    """

    swaps: bool = True
    jumps: bool = True
    assign: bool = True
    longest_gap: float = 2.0
    longest_soft_gap: float = 0.25
    longest_spline: float = 0.1

    def __post_init__(self):
        for name in ("longest_gap", "longest_soft_gap", "longest_spline"):
            value = getattr(self, name)
            if not 0.0 <= value < np.inf:
                raise InputError(name, f"{value:g} s", "0 or more seconds")


class CleaningResult(NamedTuple):
    """A cleaned trial and the report.

    Attributes:
        trial: the same labels, without unlabeled markers that were all assigned.
        report: what was found and done.
    """

    trial: MarkerTrial
    report: CleanReport

    def build_pose_trial(self) -> MarkerTrial:
        """Return the trial for the pose solver, without long uncertain fillings.

        Gaps filled softly or by a curve are good for display, but no evidence for a pose.

        Returns:
            The trial.
        """
        positions = np.array(self.trial.positions)
        for gap in self.report.gaps:
            if gap.how != "cluster" and gap.frames > _LONGEST_FILLING * self.trial.fps:
                first = round((gap.start - self.trial.start) * self.trial.fps)
                positions[first : first + gap.frames, self.trial.index_of(gap.labels[0])] = np.nan
        return self.trial.with_positions(positions)


@dataclass
class _CleanUp:
    """A trial in the clean-up: its present places, and the findings."""

    trial: MarkerTrial
    positions: np.ndarray
    clusters: list[list[int]]
    unlabeled: list[int]
    check_cancelled: Callable[[], None]
    findings: dict = field(default_factory=dict)
    carried_markers: dict = field(default_factory=dict)
    softness: np.ndarray | None = None

    def find_carriers(self):
        """Find which markers carry which."""
        labeled = [i for i in range(len(self.trial.labels)) if i not in self.unlabeled and self.is_visible(i)]
        self.softness = measure_softness(self.positions, self.clusters)
        self.softness[self.unlabeled], self.softness[:, self.unlabeled] = np.inf, np.inf
        self.carried_markers = find_carriers(self.positions, self.softness, labeled,
                                             check_cancelled=self.check_cancelled)

    def update_carriers(self, changed: Sequence[int]):
        """Update the carriers where a few samples of these markers have changed."""
        labeled = [i for i in self.carried_markers if self.is_visible(i)]
        self.carried_markers = find_carriers(self.positions, self.softness, labeled, known=self.carried_markers,
                                             changed=changed, check_cancelled=self.check_cancelled)

    def is_visible(self, marker):
        """Return whether a marker is visible in any frame."""
        return np.isfinite(self.positions[:, marker, 0]).any()

    def build_stretch(self, labels, first, end, how="", off=0.0):
        """Build the stretch of these markers' frames, in seconds."""
        clock = self.trial.start + np.array([first, end - 1]) / self.trial.fps
        names = tuple(self.trial.labels[i] for i in labels)
        return Stretch(labels=names, start=float(clock[0]), end=float(clock[1]), frames=end - first, how=how,
                       off=float(off))


def clean_trial(trial: MarkerTrial, clusters: Mapping[str, Sequence[str]] | None = None,
                settings: CleanSettings = CleanSettings(), progress: Callable[[float, str], None] | None = None,
                cancelled: Callable[[], bool] | None = None) -> CleaningResult:
    """Clean a trial: remove swaps and jumps, label unlabeled markers and fill gaps.

    Args:
        trial: the recorded markers.
        clusters: segment -> labels of its markers, where a marker set is known (labels not in the trial are skipped);
            None uses the trial alone to find what moves together.
        settings: the options.
        progress: called with the share that is done and a text.
        cancelled: returns True when the user stops the job.
    Returns:
        The cleaned trial and the report.
    Raises:
        UserCancelledError: if the user stops the job.
    Source: Fredriksson section 5.1.
    """
    clusters = clusters or {}
    known = [label for labels in clusters.values() for label in labels]
    index = {label: i for i, label in enumerate(trial.labels)}
    work = _CleanUp(trial, np.array(trial.positions),
                    [[index[label] for label in labels if label in index] for labels in clusters.values()],
                    find_unlabeled(trial.labels, known), lambda: _check_cancelled(cancelled))
    work.findings = {name: () for name in ("swaps", "jumps", "assigned", "strayed", "gaps", "left")}
    steps = [("finding carriers", _CleanUp.find_carriers)]
    steps += [("swaps", _correct_swaps)] if settings.swaps else []
    steps += [("jumps", _remove_jumps)] if settings.jumps else []
    steps += [("unlabeled markers", _label_unlabeled)] if settings.assign and work.unlabeled else []
    steps += [("gaps", lambda work: _fill_gaps(work, settings))]
    for number, (text, step) in enumerate(steps):
        work.check_cancelled()
        if progress:
            progress(number / len(steps), f"markers: {text}")
        if len(trial) and trial.labels:
            step(work)
    if progress:
        progress(1.0, "markers: clean")
    return _build_result(work)


def _check_cancelled(cancelled):
    if cancelled and cancelled():
        raise UserCancelledError("clean-up stopped")


def _correct_swaps(work):
    """Exchange swapped labels back: first pairs that leap twice, then those that deform clusters."""
    work.positions, found = correct_double_leaps(work.positions, work.carried_markers)
    _record_swaps(work, found)
    leaping = detect_leaps(work.positions, work.carried_markers, work.trial.fps)
    work.positions, found = correct_swaps(work.positions, work.carried_markers, leaping, fps=work.trial.fps,
                                          opposite=_list_opposite_pairs(work), check_cancelled=work.check_cancelled)
    _record_swaps(work, found)


def _record_swaps(work, found):
    work.findings["swaps"] += tuple(
        work.build_stretch([i for pair in swap.pairs for i in pair], swap.first, swap.end,
                           "mended" if swap.is_corrected else "")
        for swap in found
    )
    if found:
        work.find_carriers()


def _list_opposite_pairs(work):
    """List pairs of left and right markers, and for each segment all of its pairs together."""
    index = {label: i for i, label in enumerate(work.trial.labels)}
    pairs = {}
    for label, i in index.items():
        other = index.get("R" + label[1:]) if label[:1] == "L" else None
        if other is not None and i in work.carried_markers and other in work.carried_markers:
            pairs[i] = (i, other)
    groups = [tuple(pairs[i] for i in cluster if i in pairs) for cluster in work.clusters]
    return [(pair,) for pair in pairs.values()] + [group for group in groups if len(group) > 1]


def _remove_jumps(work):
    work.positions, found = remove_jumps(work.positions, work.carried_markers, work.trial.fps)
    work.findings["jumps"] = tuple(work.build_stretch([j.marker], j.first, j.end, "taken out", j.off) for j in found)
    if found:
        work.update_carriers([jump.marker for jump in found])


def _label_unlabeled(work):
    work.positions, found = assign_labels(work.positions, work.carried_markers, work.unlabeled, work.trial.fps)
    work.findings["assigned"] = tuple(
        work.build_stretch([one.unlabeled, one.label], one.first, one.end, "assigned", one.off) for one in found
    )
    if found:
        work.update_carriers([one.label for one in found])


def _fill_gaps(work, settings):
    """Report markers that stray, fill the gaps, and record which are filled and which stay open."""
    longest = GapLimits(settings.longest_gap, settings.longest_soft_gap, settings.longest_spline)
    work.findings["strayed"] = tuple(_find_strayed(work))
    work.positions, found = fill_gaps(work.positions, work.softness, work.trial.fps, limits=longest,
                                      known=work.carried_markers, check_cancelled=work.check_cancelled)
    for name, is_filled in (("gaps", True), ("left", False)):
        work.findings[name] = tuple(
            work.build_stretch([gap.marker], gap.first, gap.end, gap.how) for gap in found if bool(gap.how) is is_filled
        )


def _find_strayed(work):
    """Find markers far from where their carriers predict them, after or until a leap or a gap.

    They were attached again, or labeled wrongly. A marker that goes there smoothly follows the body.
    """
    leaping = detect_leaps(work.positions, work.carried_markers, work.trial.fps)
    broken = np.pad(leaping | np.isnan(work.positions[..., 0]), ((_BREAK_MARGIN, _BREAK_MARGIN), (0, 0)))
    for marker, one in work.carried_markers.items():
        if not one.carriers:
            continue
        far = np.nan_to_num(one.deviation) > np.maximum(_STRAY_RATIO * one.tolerance, 0.06)
        for first, end in find_runs(far):
            edges = broken[first : first + 2 * _BREAK_MARGIN + 1, marker], broken[end : end + 2 * _BREAK_MARGIN + 1,
                                                                                  marker]
            if end - first >= _STRAY_SECONDS * work.trial.fps and any(edge.any() for edge in edges):
                yield work.build_stretch([marker], first, end, "", float(np.median(one.deviation[first:end])))


def _build_result(work):
    """Build the cleaned trial and its report."""
    trial, seen = work.trial, work.trial.visibility
    share = {label: float(seen[:, i].mean()) if len(trial) else 0.0 for i, label in enumerate(trial.labels)}
    remaining = [i for i in range(len(trial.labels)) if i not in work.unlabeled or work.is_visible(i)]
    cleaned = trial.with_positions(work.positions).select_markers([trial.labels[i] for i in remaining])
    nameless = {trial.labels[i] for i in work.unlabeled}
    report = CleanReport(
        seen={label: part for label, part in share.items() if label not in nameless},
        unnamed={trial.labels[i]: float(np.isfinite(work.positions[:, i, 0]).mean()) for i in work.unlabeled
                 if i in remaining}, **work.findings,
    )
    return CleaningResult(cleaned, report)
