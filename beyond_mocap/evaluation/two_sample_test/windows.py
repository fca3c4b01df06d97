"""Windows of 1 s of takes and of recordings that show locomotion, matched by speed.

Frames that are not locomotion are left out: on both sides those whose source has the label of an action or of the ball,
and of recordings those whose postures do not belong to normal locomotion (`Library.strangeness`), which a take should
not show.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from ...annotation import LOCOMOTION
from ...annotation.vocabulary import DIRECTIONS
from ...base.errors import InputError, format_count
from ...library.clip import LANDING_FOLDER
from ...library.library import Library
from ...motion.motion import Motion, resample, sample_frames
from ...synthesis.quality.playback import Playback, find_transitions
from ...synthesis.synthesize import estimate_look
from ..view import compute_scale
from .window_features import SECONDS, Feature, WindowFeatures, list_window_frames, measure_windows

SPEED_EDGES = (1.0, 2.0, 4.5)  # m/s between the classes that have figures of their own
_MATCHED = np.concatenate([np.arange(0.25, 2.0, 0.25), np.arange(2.0, 12.0, 0.5)])  # m/s between matched speeds
_LABELS = frozenset((*LOCOMOTION, *DIRECTIONS, "turning"))  # of locomotion without a ball

Sides = tuple[np.ndarray, np.ndarray]
"""Flags of windows: (A,) of takes, (B,) of recordings."""


@dataclass(frozen=True, eq=False, kw_only=True)
class Windows:
    """Windows of takes or of recordings, W of them.

    Attributes:
        values: (W, F) of `window_features`.
        speed: (W,) m/s.
        recording: (W,) path of the recording that most of the window shows.
        source: (W,) name of the take, or of the recording.
        has_cut: (W,) whether the clip changes within the window.
    """

    values: np.ndarray
    speed: np.ndarray
    recording: np.ndarray
    source: np.ndarray
    has_cut: np.ndarray

    def __len__(self) -> int:
        return len(self.speed)

    def select(self, rows: np.ndarray) -> Windows:
        """Select windows by number or flag."""
        return Windows(**{name: values[rows] for name, values in vars(self).items()})

    def select_features(self, columns: np.ndarray) -> Windows:
        """Select columns of `values` by number or flag."""
        return replace(self, values=self.values[:, columns])


def collect_take_windows(takes: Mapping[str, Playback], library: Library) -> tuple[Windows, tuple[Feature, ...]]:
    """Collect the windows of takes that show locomotion, and their features.

    Args:
        takes: name -> a take.
        library: its recordings.
    Raises:
        InputError: without takes, or for one without sources, with clips that the library does not have, on another
            skeleton or too short.
    """
    parts = [_measure_take(name, played, library) for name, played in takes.items()]
    if not parts:
        raise InputError("takes", "none", "one take or more")
    return _join_windows([windows for windows, _ in parts]), parts[0][1]


def _measure_take(name: str, played: Playback, library: Library) -> tuple[Windows, tuple[Feature, ...]]:
    """Measure the windows of one take."""
    if played.words is None:
        raise InputError(name, "the clips that it shows are not known", "its table of sources", "add --provenance")
    if unknown := played.list_unknown_clips(library):
        # of these it is not known which recordings the folds have to leave out with them
        raise InputError(name, f"shows {format_count(len(unknown), 'clip')} that {library.folder} does not have, such "
                         f"as {unknown[0]}", "a take synthesized from this library", "compare it with its own library")
    motion = _fit_to_library(name, played.motion, library)
    measured = _measure_motion(name, motion, library)
    stride = played.compute_stride(library)
    starts_piece = np.zeros(len(played.clip), bool)
    starts_piece[find_transitions(played.clip, played.mirrored, played.clip_frame, stride)] = True
    is_locomotion = np.array([set(words) <= _LABELS for words in played.words])
    shown = np.rint(np.arange(len(motion)) * (played.motion.fps / motion.fps)).astype(int)
    shown = shown.clip(0, len(played.clip) - 1)[measured.frames]
    clip = [np.bincount(row).argmax() for row in played.clip[shown]]
    windows = Windows(
        values=measured.values, speed=measured.speed, source=np.full(len(clip), name),
        recording=np.array([path.removeprefix(LANDING_FOLDER) for path in played.clips])[clip],
        has_cut=starts_piece[shown[:, 1:]].any(axis=1),
    )
    return windows.select(is_locomotion[shown].all(axis=1)), measured.features


def _fit_to_library(name: str, motion: Motion, library: Library) -> Motion:
    """Bring a take to the library's stature and rate; InputError for another skeleton."""
    try:
        size = compute_scale(motion.skeleton, library.skeleton)
    except InputError as error:
        raise InputError(name, str(error)) from None
    return resample(Motion(library.skeleton, motion.root_positions / size, motion.rotations, motion.fps), library.fps)


def _measure_motion(name: str, motion: Motion, library: Library) -> WindowFeatures:
    """Measure the windows of a motion; InputError where it is too short for one."""
    if not len(list_window_frames(len(motion), motion.fps)):
        raise InputError(name, f"lasts {motion.duration:.1f} s", f"{2 * SECONDS:g} s or more")
    return measure_windows(motion, estimate_look(library))


def collect_recorded_windows(library: Library) -> Windows:
    """Collect the windows of unmirrored recordings that show normal locomotion.

    Args:
        library: the recordings.
    Raises:
        InputError: for fewer than two recordings with such windows.
    """
    numbers = [i for i, clip in enumerate(library.clips) if not (clip.mirrored or clip.is_synthetic)]
    parts = [_measure_recording(library, i) for i in numbers if library.clips[i].recording.duration > 2.1 * SECONDS]
    found = [windows for windows in parts if len(windows)]
    if len(found) < 2:
        raise InputError(
            library.folder, f"{format_count(len(found), 'recording')} with {2 * SECONDS:g} s of locomotion",
            "2 or more", "add recordings, or compare with another library",
        )
    return _join_windows(found)


def _measure_recording(library: Library, number: int) -> Windows:
    """Measure the windows of one recording at the library's rate."""
    clip, frames = library.clips[number], library.frames
    rows = frames.first[number] + np.arange(frames.count[number])
    rows = rows[frames.source[rows] <= len(clip.recording) - 1]
    motion = Motion(library.skeleton, *sample_frames(clip.motion, frames.source[rows]), library.fps)
    measured = _measure_motion(clip.path, motion, library)
    others = [i for i, label in enumerate(frames.vocabulary) if label not in _LABELS]
    is_locomotion = ~frames.words[rows][:, others].any(axis=1)
    belongs = library.strangeness[rows][measured.frames].mean(axis=1) <= 1.0
    paths = np.full(len(belongs), clip.path)
    windows = Windows(values=measured.values, speed=measured.speed, recording=paths, source=paths,
                      has_cut=np.zeros(len(belongs), bool))
    return windows.select(is_locomotion[measured.frames].all(axis=1) & belongs)


def _join_windows(parts: list[Windows]) -> Windows:
    """Join windows in their order."""
    return Windows(**{name: np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])})


def match_windows(synthesized: Windows, recorded: Windows) -> tuple[Windows, Windows]:
    """Select as many windows of each side as both have at each speed, spread evenly over the side that has more."""
    kinds = [np.digitize(windows.speed, _MATCHED) for windows in (synthesized, recorded)]
    chosen: tuple[list[np.ndarray], list[np.ndarray]] = ([], [])
    for kind in range(len(_MATCHED) + 1):
        rows = [np.flatnonzero(own == kind) for own in kinds]
        count = min(len(own) for own in rows)
        for own, out in zip(rows, chosen):
            out.append(own[np.arange(count) * len(own) // max(count, 1)])
    first, second = (np.sort(np.concatenate(out)) for out in chosen)
    return synthesized.select(first), recorded.select(second)


def list_subsets(synthesized: Windows, recorded: Windows) -> dict[str, Sides]:
    """List the windows of both sides that have figures.

    They are all, each class of speed, takes with and without a cut, and of recordings those that the takes show: less
    area there is due to the choice of recordings.
    """
    kinds = [np.digitize(windows.speed, SPEED_EDGES) for windows in (synthesized, recorded)]
    edges = [0.0, *SPEED_EDGES]
    names = [f"{low:g} to {high:g} m/s" for low, high in zip(edges, edges[1:])] + [f"above {edges[-1]:g} m/s"]
    everything = np.ones(len(recorded), bool)
    return {
        "all": (np.ones(len(synthesized), bool), everything),
        **{name: (kinds[0] == kind, kinds[1] == kind) for kind, name in enumerate(names)},
        "with a cut": (synthesized.has_cut, everything), "without a cut": (~synthesized.has_cut, everything),
        "recordings in takes": (np.ones(len(synthesized), bool), np.isin(recorded.recording, synthesized.recording)),
    }  # fmt: skip
