"""A classifier of acts: for each act its kernel, confidence, key frame and labels; its proposals for a recording,
combined with the rules; and its file: one `.npz` of plain arrays with a JSON header, never pickled, checked when it is
read.
"""

from __future__ import annotations

import io
import json
import os
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from ...annotation import LOCOMOTION, ClipAnnotation, swap_sides
from ...base.content import read_bytes
from ...base.errors import InputError, format_count
from ...base.time_series import find_runs
from ...files.atomic import atomic_write
from ...files.plain_npz import HEADER, read_own_arrays
from ...motion.motion import Motion
from ..folder.label_sources import LEARNED, Proposal
from .details import Details
from .kernel import Kernel, compute_confidence
from .signals import LENGTH, RATE, STRIKES, Signals, Space, build_signals, build_windows

MIN_CONFIDENCE = 0.2
"""Moments of lower confidence are not proposed."""

# seconds between two moments of any acts: of two nearer ones the one of higher confidence counts
_MIN_SEPARATION = 0.35
_MIN_SECONDS = 0.3  # least duration of a stretch, seconds
NEAR = 0.15  # seconds within which a rule's moment and a candidate are the same
_CANDIDATES_APART = 10  # samples between two candidates
_STEADY = 9  # samples over which a stretch's score is averaged
_MIN_LEAD = 0.01  # seconds: shorter leads are within the accuracy of annotation
_STRIKE_SEARCH = 0.12  # seconds around a candidate in which its strike is searched

_FILE_VERSION = 1

_KIND = "a file of learned labels"
_MAX_BYTES = 256 * 1024 * 1024  # of the file, and of its arrays
_NEXT_STEP = "learn from annotated clips again"


@dataclass(frozen=True, eq=False, kw_only=True)
class Act:
    """What is learned of one act.

    Attributes:
        word: the act's label.
        moment: whether it has key moments, else it is a stretch.
        kernel: similarity of windows to the act.
        weights: (3,) of its confidence (`kernel.compute_confidence`).
        silence: the value that replaces the rules' confidence where they propose nothing.
        example_amount: number of moments, or seconds, that it was learned from.
        strike: index of STRIKES whose peak gives the key frame, -1 for the score's own peak.
        lead: seconds from that peak to the key.
        before, after: seconds of a row around its key.
        details: the labels beside the act.
    """

    word: str
    moment: bool
    kernel: Kernel
    weights: np.ndarray
    silence: float
    example_amount: float
    strike: int
    lead: float
    before: float
    after: float
    details: Details

    def describe(self) -> str:
        """Describe the act and what it was learned from."""
        if self.moment:
            return f"{self.word}: {self.example_amount:.0f} moments"
        return f"{self.word}: {self.example_amount:.1f} s"


def find_candidates(kernel: Kernel, rows: np.ndarray, seconds: np.ndarray, ruled: Sequence[Proposal], word: str):
    """Find the samples at which an act may have its moment: peaks of the score, and moments of the rules without a peak
    near.

    Args:
        kernel: of the act.
        rows: (N, K) windows in their space.
        seconds: (N,) of the samples.
        ruled: what the rules propose, in seconds.
        word: the act's label.
    Returns:
        Samples (C,) and their scores (C,).
    """
    from scipy.signal import find_peaks

    score = smooth_score(kernel.compute_scores(rows))
    at = find_peaks(np.pad(score, 1, constant_values=-9.0), distance=_CANDIDATES_APART)[0] - 1
    for time in list_rule_moments(ruled, word):
        if not np.any(np.abs(seconds[at] - time) <= NEAR):
            at = np.append(at, np.argmin(np.abs(seconds - time)))
    return np.sort(at), score[np.sort(at)]


def smooth_score(score: np.ndarray) -> np.ndarray:
    """Smooth a score (N,) so that single samples do not count."""
    padded = np.pad(score, 1, mode="edge")
    return 0.25 * padded[:-2] + 0.5 * padded[1:-1] + 0.25 * padded[2:]


def average_score(score: np.ndarray) -> np.ndarray:
    """Average a stretch's score (N,) over a third of a second."""
    return uniform_filter1d(score, _STEADY, mode="nearest") if len(score) else score


def list_rule_moments(ruled: Sequence[Proposal], word: str) -> list[float]:
    """List the seconds of the rules' key moments of an act; `ruled` in seconds (`convert_to_seconds`)."""
    return [one.annotation.key for one in ruled if one.annotation.key is not None and word in one.annotation.words]


def find_rule_proposal(ruled: Sequence[Proposal], word: str, moment: bool, time: float) -> Proposal | None:
    """Find the rules' proposal of an act at a time in seconds, of highest confidence; None where there is none."""
    matches = [one for one in ruled if word in one.annotation.words and (one.annotation.key is not None) == moment]
    if moment:
        matches = [one for one in matches if abs(one.annotation.key - time) <= NEAR]
    else:
        matches = [one for one in matches if one.annotation.start <= time <= one.annotation.end]
    return max(matches, key=lambda one: one.confidence, default=None)


def collect_rule_confidences(ruled: Sequence[Proposal], word: str, moment: bool, seconds: np.ndarray,
                             silent: float) -> np.ndarray:
    """Collect the rules' confidences (N,) at each of the times, `silent` where they propose nothing."""
    found = (find_rule_proposal(ruled, word, moment, time) for time in seconds)
    return np.array([silent if one is None else one.confidence for one in found])


def find_strike_time(signals: Signals, strike: int, time: float) -> float:
    """Find the second of the strike's peak within a few frames of a time; the time itself where there is none."""
    fps = signals.fps
    first = max(0, int(np.ceil((time - _STRIKE_SEARCH) * fps)))
    part = signals.strikes[first : int((time + _STRIKE_SEARCH) * fps) + 1, strike]
    if strike < 0 or len(part) < 3:
        return time
    return (first + int(np.argmax(part))) / fps


def select_strike(signals: Sequence[tuple[Signals, float]]) -> tuple[int, float]:
    """Select the strike that peaks most consistently near the key moments of an act.

    Args:
        signals: of each key moment its signals and its second.
    Returns:
        The strike's index and the seconds from its peak to the key; -1 where none is consistent to two samples.
    """
    best = (2.0 / RATE, -1, 0.0)
    for strike in range(len(STRIKES)):
        delays = np.array([time - find_strike_time(one, strike, time) for one, time in signals])
        lead = float(np.median(delays))
        lead = lead if abs(lead) > _MIN_LEAD else 0.0
        deviation = float(np.mean(np.abs(delays - lead)))
        best = min(best, (deviation, strike, lead))
    return best[1], best[2]


def project_signals(signals: Signals, space: Space) -> np.ndarray:
    """Project the windows of signals: (N, K)."""
    return space.project(build_windows(signals))


@dataclass(frozen=True, eq=False)
class Classifier:
    """A trained classifier.

    Attributes:
        space: of the windows.
        acts: all that it knows.
        clips: number of clips that it has learned from.
    """

    space: Space
    acts: tuple[Act, ...]
    clips: int

    def describe(self) -> tuple[str, ...]:
        """Describe what it has learned, one line each."""
        first = f"learned from {format_count(self.clips, 'clip')}"
        return (first, *(act.describe() for act in self.acts))

    def propose_labels(self, motion: Motion, ruled: Sequence[Proposal]) -> tuple[Proposal, ...]:
        """Propose labels for a recording.

        Args:
            motion: T frames.
            ruled: what the rules propose; the classifier decides about acts that it knows, the other rules' proposals
                stay.
        Returns:
            The proposals by their first frame.
        Raises:
            InputError: if the skeleton has no legs.
        """
        seen = build_signals(motion)
        rows, seconds = project_signals(seen, self.space), seen.frames / seen.fps
        rule_proposals = convert_to_seconds(ruled, seen.fps)
        moments = [one for act in self.acts if act.moment for one in _propose_moments(act, seen, rows, seconds,
                rule_proposals)]
        stretches = [one for act in self.acts if not act.moment for one in _propose_stretches(act, seen, rows, seconds,
                rule_proposals)]
        own = {(act.word, act.moment) for act in self.acts}
        rest = [one for one in ruled if not any(
            (word, one.annotation.key is not None) in own for word in one.annotation.words)]
        found = [*_select_surest(moments, seen.fps), *stretches, *rest]
        return tuple(sorted(found, key=lambda one: (one.annotation.start, one.annotation.end)))


def convert_to_seconds(ruled: Sequence[Proposal], fps: float, mirrored: bool = False) -> tuple[Proposal, ...]:
    """Convert proposals' rows from frames to seconds; of the mirrored body if requested."""
    out = []
    for one in ruled:
        row = one.annotation
        key = None if row.key is None else row.key / fps
        words = swap_sides(row.words) if mirrored else row.words
        out.append(replace(one, annotation=ClipAnnotation(row.start / fps, row.end / fps, key, words)))
    return tuple(out)


def _propose_moments(act: Act, seen: Signals, rows, seconds, rule_proposals) -> list[Proposal]:
    """Propose the key moments of one act."""
    at, score = find_candidates(act.kernel, rows, seconds, rule_proposals, act.word)
    confidences = compute_confidence(act.weights, score, collect_rule_confidences(rule_proposals, act.word, True,
                                                                                  seconds[at], act.silence))
    likely = [(sample, float(confidence)) for sample, confidence in zip(at, confidences) if confidence
              >= MIN_CONFIDENCE]
    return [_build_moment(act, seen, rows, seconds=seconds, rule_proposals=rule_proposals, sample=sample,
                          confidence=confidence) for sample, confidence in likely]


def _build_moment(act: Act, seen: Signals, rows, seconds, rule_proposals, sample: int, confidence: float) -> Proposal:
    """Build one moment: its frame from the strike near the candidate, its labels from the windows there."""
    rule = find_rule_proposal(rule_proposals, act.word, True, float(seconds[sample]))
    key = find_strike_time(seen, act.strike, float(seconds[sample])) + act.lead
    samples = np.clip(np.round(key * RATE).astype(int) + np.arange(-1, 2), 0, len(rows) - 1)
    words = (act.word, *act.details.choose_labels(rows[samples], rule))
    row = _build_row(seen, key - act.before, key + act.after, key, words)
    return Proposal(row, confidence, f"similar to the examples; {rule.why}" if rule else "similar to the examples",
                    LEARNED)


def _propose_stretches(act: Act, seen: Signals, rows, seconds, rule_proposals) -> list[Proposal]:
    """Propose the stretches of one act."""
    score = average_score(act.kernel.compute_scores(rows))
    rule = collect_rule_confidences(rule_proposals, act.word, False, seconds, act.silence)
    confidences = compute_confidence(act.weights, score, rule)
    out = []
    for start, stop in find_runs(confidences >= 0.5):
        if stop - start >= _MIN_SECONDS * RATE:
            rule_proposal = find_rule_proposal(rule_proposals, act.word, False, float(seconds[(start + stop) // 2]))
            labels = act.details.choose_labels(rows[start:stop], rule_proposal)
            words = (act.word, *(word for word in labels if word not in LOCOMOTION))
            row = _build_row(seen, seconds[start], seconds[stop - 1], None, words)
            out.append(Proposal(row, float(confidences[start:stop].mean()), "similar to the examples", LEARNED))
    return out


def _build_row(seen: Signals, start: float, end: float, key: float | None, words) -> ClipAnnotation:
    """Build a row in frames of the recording from seconds, cut to it."""
    last = seen.count - 1
    first, final = (int(np.clip(round(time * seen.fps), 0, last)) for time in (start, end))
    frame = None if key is None else int(np.clip(round(key * seen.fps), first, final))
    return ClipAnnotation(first, final, frame, tuple(words))


def _select_surest(found: list[Proposal], fps: float) -> list[Proposal]:
    """Select, of moments that are too near to each other, the ones of highest confidence."""
    selected: list[Proposal] = []
    for one in sorted(found, key=lambda one: -one.confidence):
        if all(abs(one.annotation.key - other.annotation.key) > _MIN_SEPARATION * fps for other in selected):
            selected.append(one)
    return selected


def write_classifier(path: str | os.PathLike, known: Classifier) -> None:
    """Write a classifier to one file, completely or not at all; InputError where it cannot be written."""
    arrays = {"mean": known.space.mean, "scale": known.space.scale, "basis": known.space.basis}
    for number, act in enumerate(known.acts):
        arrays[f"{number}.supports"], arrays[f"{number}.weights"] = act.kernel.supports, act.kernel.weights
        arrays[f"{number}.sure"] = act.weights
        for group, plane in enumerate(act.details.planes):
            arrays[f"{number}.plane.{group}"] = plane
    header = {"version": _FILE_VERSION, "clips": known.clips, "acts": [_describe_act(act) for act in known.acts]}
    arrays[HEADER] = np.frombuffer(json.dumps(header).encode(), np.uint8)
    out = io.BytesIO()
    np.savez_compressed(out, **arrays)
    atomic_write(path, out.getvalue())


def read_classifier(path: str | os.PathLike) -> Classifier:
    """Read a classifier; InputError where the file is missing, damaged, or of another version."""
    if not os.path.exists(path):
        raise InputError(path, "no such file", _KIND, _NEXT_STEP)
    content = read_bytes(path, _KIND, _MAX_BYTES)
    try:
        arrays = read_own_arrays(content, _KIND, _MAX_BYTES)
        header = json.loads(arrays[HEADER].tobytes())
        version = header["version"]
    except (InputError, LookupError, TypeError, ValueError, RecursionError):
        raise InputError(path, "a file that cannot be read", _KIND, _NEXT_STEP) from None
    if version != _FILE_VERSION:
        raise InputError(path, f"version {version!r}", f"version {_FILE_VERSION}", _NEXT_STEP)
    try:
        return _restore_classifier(header, arrays)
    except (LookupError, TypeError, ValueError, AttributeError, OverflowError):
        raise InputError(path, "inconsistent or invalid numbers", _KIND, _NEXT_STEP) from None


def _describe_act(act: Act) -> dict:
    return {
        "word": act.word, "moment": act.moment, "shift": act.kernel.shift, "gamma": act.kernel.gamma,
        "silent": act.silence, "shown": act.example_amount, "strike": act.strike, "lead": act.lead,
        "before": act.before, "after": act.after,
        "choices": act.details.choices, "by_rule": act.details.rules_first,
    }


def _restore_classifier(header: dict, arrays: dict) -> Classifier:
    """Restore a classifier from its file's parts; ValueError where a shape or number is invalid."""
    components = arrays["basis"].shape[1]
    mean, scale = _check_array(arrays, "mean", (LENGTH,)), _check_array(arrays, "scale", (LENGTH,))
    space = Space(mean, scale, _check_array(arrays, "basis", (LENGTH, components)))
    if np.any(scale <= 0.0) or not header["acts"]:
        raise ValueError("scale")
    acts = tuple(_restore_act(number, one, arrays, components) for number, one in enumerate(header["acts"]))
    return Classifier(space, acts, int(header["clips"]))


def _restore_act(number: int, header: dict, arrays: dict, components: int) -> Act:
    """Restore one act; ValueError where a part is invalid."""
    count = len(arrays[f"{number}.weights"])
    if not count or not _check_word(header["word"]):
        raise ValueError("act")
    supports = _check_array(arrays, f"{number}.supports", (count, components))
    kernel = Kernel(supports, _check_array(arrays, f"{number}.weights", (count,)), _check_number(header["shift"]),
                    _check_number(header["gamma"], least=0.0))
    choices = tuple(tuple(_check_word(word) for word in group) for group in header["choices"])
    planes = tuple(_check_array(arrays, f"{number}.plane.{group}", (len(words), components + 1))
                   for group, words in enumerate(choices))
    by_rule = tuple(bool(one) for one in header["by_rule"])
    strike = int(header["strike"])
    if len(by_rule) != len(choices) or not -1 <= strike < len(STRIKES) or not all(choices):
        raise ValueError("header")
    before, after = (_check_number(header[name], least=0.0) for name in ("before", "after"))
    return Act(word=_check_word(header["word"]), moment=bool(header["moment"]), kernel=kernel,
               weights=_check_array(arrays, f"{number}.sure", (3,)), silence=_check_number(header["silent"]),
               example_amount=_check_number(header["shown"]), strike=strike, lead=_check_number(header["lead"]),
               before=before, after=after, details=Details(choices, planes, by_rule))


def _check_array(arrays: dict, name: str, shape: tuple[int, ...]) -> np.ndarray:
    found = arrays[name]
    if found.shape != shape or found.dtype.kind != "f" or not np.all(np.isfinite(found)):
        raise ValueError(name)
    return found


def _check_number(value, least: float = -1e6) -> float:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not least <= value < 1e6:
        raise ValueError("number")
    return float(value)


def _check_word(value) -> str:
    if not isinstance(value, str) or any(not (letter.isalnum() or letter in "_-") for letter in value):
        raise ValueError("word")
    return value
