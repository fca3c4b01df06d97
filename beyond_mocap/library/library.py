"""A library: the clips of a folder, a mirrored twin of each, their labels, features and key moments.

`build_library` reads a folder once and saves the results in a cache (`library.cache`); the next call is quick.
"""

from __future__ import annotations

import weakref
from collections import Counter
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Callable

import numpy as np

from ..annotation import LOCOMOTION, ClipAnnotation, estimate_gait_thresholds
from ..annotation.gaits import STANDING, STANDING_SPEED
from ..annotation.vocabulary import DIRECTIONS
from ..base.errors import InputError, format_count, format_some
from ..motion.retargeting.neutral import NeutralStance, build_neutral_stance
from ..motion.skeleton import Skeleton
from . import cache
from .cache import write_synthetic_clips
from .clip import Clip
from .clusters import BLOCK_LENGTHS, Clusters, cluster_blocks
from .coverage import BACK_SPEEDS, TURNS, Coverage, measure_coverage
from .features import FPS, Frames, build_frames, join_frames, join_vocabularies, list_frame_arrays
from .keys import KICK_STEP, Key, collect_keys, measure_kick_speed
from .loops.run_loops import MIN_SPEED
from .loops.standing_loops import MIN_STAND_SECONDS
from .manners import Manners, measure_manners
from .posture import NormalPostures, fit_normal_postures, measure_falls
from .receptions import find_cut_receptions

MIN_RUN_SECONDS = 2.0  # of a track's runs from which on long runs are needed
RESTING_SPEED = 0.1  # m/s of a track below which a player stands
_NEVER_SHOWN = np.float32(10.0)  # strangeness of T-poses
RECORDED_INDEX = "index"
"""Name under which what is computed from the recordings alone is cached."""
_NAMED_CLIPS = 3  # clips that a line names
_STANCE_NUMBERS = tuple(field.name for field in fields(NeutralStance) if field.name != "skeleton")
Progress = Callable[[float, str], None]


@dataclass(frozen=True)
class Gait:
    """A kind of locomotion in the library.

    Attributes:
        label: its label.
        labels: all labels of its most common row.
        speed: mean, m/s.
    """

    label: str
    labels: tuple[str, ...]
    speed: float


@dataclass(frozen=True, eq=False, kw_only=True)
class Library:
    """Everything that a search needs.

    Attributes:
        folder: where the recordings are.
        skeleton: of all clips.
        clips: recordings and their twins.
        frames: all clips at `fps`.
        fps: 30.
        notes: decisions made while building, for people.
        seed: of the clustering.
        cache_location: the cache's folder and key, for results that are computed later.
        chosen_gaits: (gait label, clip path) pairs: the clip that defines a gait (`library.automatic_locomotion`).
    """

    folder: str
    skeleton: Skeleton
    clips: tuple[Clip, ...]
    frames: Frames
    fps: float = FPS
    notes: tuple[str, ...] = ()
    seed: int = 0
    cache_location: tuple[Path, str] | None = None
    chosen_gaits: tuple[tuple[str, str], ...] = ()

    @cached_property
    def keys(self) -> tuple[Key, ...]:
        """Key moments of all clips."""
        return collect_keys(self.clips)

    @cached_property
    def clusters(self) -> dict[int, Clusters]:
        """Clusters of blocks by block length, which only the block search needs; cached, since they take seconds."""
        index = self.index_place[-1] if self.index_place else ""
        stored = self._find_stored(f"clusters-{index}-{self.seed}", self._cluster_blocks)
        return {length: Clusters.from_arrays(stored, length) for length in BLOCK_LENGTHS}

    def _cluster_blocks(self) -> dict[str, np.ndarray]:
        found = (cluster_blocks(self.frames, length, self.seed) for length in BLOCK_LENGTHS)
        return {name: array for one in found for name, array in one.to_arrays().items()}

    @cached_property
    def cut_receptions(self) -> tuple[Key, ...]:
        """Key moments of receptions that are cut out of dribbles; none where a recording is labelled with one."""
        return find_cut_receptions(self.clips, self.frames, self.feet_in_contact, self.keys)

    @cached_property
    def labels(self) -> frozenset[str]:
        """Every label that a clip carries."""
        return frozenset(word for clip in self.clips for row in clip.annotations for word in row.words)

    @cached_property
    def gaits(self) -> tuple[Gait, ...]:
        """The library's own locomotion from slow to fast; InputError where it has none."""
        return measure_gaits(self)

    @cached_property
    def gait_thresholds(self) -> np.ndarray:
        """(G-1,) m/s: the speeds at which the clips' own annotations change from each gait to the next faster one."""
        frames, gaits = self.frames, self.gaits
        column = {word: i for i, word in enumerate(frames.vocabulary)}
        labelled = np.full(len(frames), -1)
        for number, gait in enumerate(gaits):
            labelled[frames.words[:, column[gait.label]]] = number
        return estimate_gait_thresholds(np.array([gait.speed for gait in gaits]), frames.speed, labelled)

    @cached_property
    def stance_seconds(self) -> np.ndarray:
        """(N,) duration in seconds of the shorter current stance of both feet; 0 while a foot is in the air.

        A body that is played faster or slower than the track drags that foot for as long.
        """
        return np.concatenate([_measure_stance_seconds(clip, self._select_clip_frames(i)) for i,
                               clip in enumerate(self.clips)])

    @cached_property
    def strangeness(self) -> np.ndarray:
        """(N,) float32: how far each frame's posture lies from normal locomotion, up to 1 it belongs (`posture`)."""
        strangeness = self.normal_postures.measure_strangeness(self.frames.posture, self.frames.speed)
        strangeness = np.maximum(strangeness, measure_falls(self.frames, self.fps))
        strangeness[self.shows_t_pose] = _NEVER_SHOWN
        # synthetic clips are locomotion at speeds that nothing recorded has
        return np.where(self._is_recorded, strangeness, np.float32(0.0))

    @cached_property
    def shows_t_pose(self) -> np.ndarray:
        """(N,) bool, frames in a T-pose at the start or the end of a recording, or beside it (`library.repair`)."""
        shown = np.zeros(len(self.frames), bool)
        for index, clip in enumerate(self.clips):
            if any(clip.t_pose_frames):
                first = self.frames.first[index]
                shown[first : first + self.frames.count[index]] = clip.select_t_poses(self._select_clip_frames(index))
        return shown

    @cached_property
    def normal_postures(self) -> NormalPostures:
        """How people of this library stand, walk, jog and run; cached, because every take asks for it."""
        return NormalPostures.from_arrays(self._find_stored(
            "postures", lambda: fit_normal_postures(self.frames, self._is_recorded & ~self.shows_t_pose,
                                                    self.fps).to_arrays()))

    @cached_property
    def neutral_stance(self) -> NeutralStance:
        """How people of this library stand; cached, because it is measured on all recordings."""
        stored = self._find_stored("stance", self._measure_stance)
        known: dict[str, Any] = {name: one if one.ndim else float(one) for name, one in stored.items()}
        return NeutralStance(skeleton=self.skeleton, **known)

    def _measure_stance(self) -> dict[str, np.ndarray]:
        from .synthetic_clips import sample_upright_example

        recordings = [clip for clip in self.clips if not clip.is_synthetic] or self.clips
        stance = build_neutral_stance(self.skeleton, sample_upright_example(recordings))
        return {name: np.asarray(getattr(stance, name)) for name in _STANCE_NUMBERS}

    def _find_stored(self, name: str, compute: Callable[[], dict[str, np.ndarray]]) -> dict[str, np.ndarray]:
        """Find arrays that are computed from the library's frames in the cache, or compute and store them."""
        place = self.index_place and (*self.index_place[:2], name)
        stored = cache.load_arrays(*place) if place else None
        if stored is None:
            stored = compute()
            if place:
                cache.save_arrays(*place, stored)
        return stored

    @cached_property
    def coverage(self) -> Coverage:
        """What the recordings lack of the motion that players need."""
        return measure_coverage(self.clips, self.frames, self.fps, self.strangeness)

    @cached_property
    def index_place(self) -> tuple[Path, str, str] | None:
        """Where what is computed from exactly these clips is cached: folder, key and name.

        None for a library that was changed after it was built or completed: `build_library` and `with_synthetic_clips`
        set it, and a changed copy does not have it.
        """
        return None

    @property
    def base_library(self) -> "Library | None":
        """The library to which `append_synthetic_clips` has appended clips, while it is in use; None for any other one.

        It is not kept: those that extend a library are kept with it (`missing_actions`), so that neither would end.
        """
        base = vars(self).get("_base")
        return None if base is None else base()

    @cached_property
    def manners(self) -> Manners:
        """How the people of this library move."""
        if (base := self.base_library) is not None:
            return base.manners.append_unknown(len(self.clips) - len(base.clips))
        is_calm = self._is_recorded & (self.strangeness <= 1.0)
        return measure_manners([clip.path for clip in self.clips], self.frames, is_calm, self.fps)

    @cached_property
    def _is_recorded(self) -> np.ndarray:
        """(N,) bool, frames of recordings."""
        return ~np.array([clip.is_synthetic for clip in self.clips])[self.frames.clip]

    @cached_property
    def feet_in_contact(self) -> np.ndarray:
        """(N, 2) bool: left and right foot on the ground, heel or toe."""
        contacts = (clip.heel_toe_contacts.any(axis=2)[_round_to_frames(clip, self._select_clip_frames(i))] for i,
                    clip in enumerate(self.clips))
        return np.concatenate(list(contacts))

    def _select_clip_frames(self, clip: int) -> np.ndarray:
        first = self.frames.first[clip]
        return self.frames.source[first : first + self.frames.count[clip]]

    @cached_property
    def with_synthetic_clips(self) -> "Library":
        """The recordings followed by the synthetic clips of `library.synthetic_clips`.

        These add the speeds between and above the recordings, and kicks on the run. They are generated on first use and
        cached. InputError where no recording shows locomotion.
        """
        self.gaits  # noqa: B018  # a library without locomotion raises InputError
        cached = cache.load_library(*self.cache_location, "made") if self.cache_location else None
        synthetic = Library(folder="", **cached) if cached else None
        if synthetic is None:
            synthetic = _build_synthetic_library(self)
            if self.cache_location:
                write_synthetic_clips(self.cache_location[0], synthetic.clips)
                _save_synthetic_library(*self.cache_location, synthetic)
        else:
            write_synthetic_clips(self.cache_location[0], synthetic.clips, missing_only=True)
        if not synthetic.clips:
            return self
        is_whole = self.index_place is not None and self.index_place[-1] == RECORDED_INDEX
        joined = self._join(synthetic, is_stored=is_whole)
        if is_whole:
            vars(joined)["index_place"] = (*self.cache_location, f"made-{RECORDED_INDEX}")
        return joined

    def append_synthetic_clips(self, clips: Sequence[Clip]) -> "Library":
        """Append synthetic clips, described like its own.

        What is known of the other clips is kept: a take asks for clips of its own, and all else takes seconds.

        Args:
            clips: on the library's skeleton.
        Returns:
            The library with them. They define no gait.
        """
        added = replace(self, clips=tuple(clips), frames=build_frames(clips, self.frames, keeps_columns=True))
        joined = self._join(added)
        known = {name: getattr(self, name)
                 for name in ("normal_postures", "cut_receptions", "gaits", "gait_thresholds", "neutral_stance")}
        known |= {name: np.concatenate([getattr(self, name), getattr(added, name)])
                  for name in ("strangeness", "stance_seconds", "feet_in_contact")}
        vars(joined).update(known, _base=weakref.ref(self))  # where cached properties keep their values
        return joined

    def _join(self, other: "Library", is_stored: bool = False) -> "Library":
        """Return the library followed by the clips of another one; is_stored: with its frames in the cache, from where
        later on only those that are used are read.
        """
        if is_stored:
            arrays = self._find_stored("made-frames", lambda: list_frame_arrays(join_frames(self.frames, other.frames)))
            frames = Frames(vocabulary=join_vocabularies(self.frames, other.frames), **arrays)
        else:
            frames = join_frames(self.frames, other.frames)
        return replace(self, clips=(*self.clips, *other.clips), frames=frames)

    def needs_synthetic_clips(self, speed: np.ndarray, offset: np.ndarray, heading: np.ndarray,
                              kick_speeds: np.ndarray) -> bool:
        """Whether a track needs the synthetic clips.

        It does if it stays in a speed gap for a fifth of a second or more, stands or runs for some seconds in all,
        goes sideways or backward while slow, turns where it stands, or has key moments that are faster than any
        recorded kick can be played without sliding.

        Args:
            speed: (T,) m/s of the track at the library's rate.
            offset: (T,) rad from its direction of travel to its heading.
            heading: (T,) rad.
            kick_speeds: (K,) m/s at its key moments, without those that take the ball with a foot.
        Returns:
            True if it does.
        """
        inside = sum(int(np.sum((speed > low) & (speed < high))) for low, high in self.coverage.speed_gaps)
        too_fast = KICK_STEP * measure_kick_speed(self.frames, self.clips, self.keys)
        rests = np.sum(speed < RESTING_SPEED) >= MIN_STAND_SECONDS * self.fps
        runs = np.sum(speed > MIN_SPEED) >= MIN_RUN_SECONDS * self.fps
        aside = (speed > STANDING_SPEED) & (speed < 1.25 * BACK_SPEEDS[-1]) & (np.abs(offset) > np.pi / 3.0)
        turned = np.sum(np.abs(np.diff(heading))[speed[1:] < STANDING_SPEED])
        steps = np.sum(aside) >= 0.5 * self.fps or turned >= 0.5 * TURNS[0]
        return inside >= 0.2 * self.fps or bool(rests | runs | steps) or bool(np.any(kick_speeds > too_fast))

    @cached_property
    def max_speed(self) -> float:
        """The highest speed that a clip reaches, m/s."""
        return float(self.frames.speed.max())

    @property
    def proposal_notes(self) -> tuple[str, ...]:
        """A line where labels are proposed and not yet checked by a person; empty where they are annotated."""
        count = sum(clip.has_proposed_labels and not clip.mirrored for clip in self.clips)
        what = f"labels proposed for {format_count(count, 'clip')}, since no clip has any: check them with Review " \
               "Proposals in Blender, or in the table that the command 'library' writes"
        return (what,) if count else ()

    @property
    def unlabelled_notes(self) -> tuple[str, ...]:
        """A line that names the recordings without labels, which are not used; empty where all have some, or none had
        and labels are proposed.
        """
        own = [clip for clip in self.clips if not (clip.mirrored or clip.is_synthetic)]
        paths = [clip.path for clip in own if not (clip.annotations or clip.is_t_pose)]
        if not paths or any(clip.has_proposed_labels for clip in own):
            return ()
        verbs = ("has", "is") if len(paths) == 1 else ("have", "are")
        what = f"{format_count(len(paths), 'clip')} {verbs[0]} no labels and {verbs[1]} not used: "
        what += format_some(paths, _NAMED_CLIPS)
        return (f"{what}; label what they show, since labels are proposed only where no clip has any",)

    @property
    def minutes(self) -> float:
        """Recorded minutes, twins not counted."""
        return sum(clip.motion.duration for clip in self.clips if not clip.mirrored) / 60.0


def _build_synthetic_library(library: Library) -> Library:
    """Build the clips that the recordings lack (`library.synthetic_clips`), described like them."""
    from .synthetic_clips import complete_gaits, iter_synthetic_clips

    speeds = {gait.label: gait.speed for gait in library.gaits if gait.label != STANDING}
    gaits = complete_gaits(speeds, library.gait_thresholds[len(library.gaits) - len(speeds):])
    clips = []
    for synthetic in iter_synthetic_clips(library.clips, library.frames, library.fps, gaits, keys=library.keys,
                                          strangeness=library.strangeness, coverage=library.coverage):
        clip = Clip(path=synthetic.name, mirrored=False, motion=synthetic.motion, annotations=synthetic.rows,
                    heel_toe_contacts=synthetic.heel_toe_contacts)
        clips += [clip, clip.build_twin()]
    if not clips:
        return replace(library, clips=())
    frames = build_frames(clips, library.frames)
    return replace(library, clips=tuple(clips), frames=frames, notes=())


def _save_synthetic_library(place: Path, key: str, synthetic: Library) -> None:
    """Save the synthetic clips beside the cache of the recordings; a folder that cannot be written is left alone."""
    with suppress(OSError, InputError), cache.create_arrays_folder(place, "made") as arrays:
        cache.save_library(place, key, synthetic, arrays=arrays, name="made")


def _measure_stance_seconds(clip: Clip, source: np.ndarray) -> np.ndarray:
    """Measure the stance durations (T,) of one clip at its frames `source` (T,)."""
    contacts = clip.heel_toe_contacts.any(axis=2)
    length = np.stack([_measure_run_lengths(contacts[:, side]) for side in (0, 1)],
                      axis=1).min(axis=1) / clip.motion.fps
    return length[_round_to_frames(clip, source)]


def _round_to_frames(clip: Clip, source: np.ndarray) -> np.ndarray:
    """Round to the clip's whole frames nearest to `source` (T,)."""
    return np.clip(np.round(source).astype(int), 0, len(clip.heel_toe_contacts) - 1)


def _measure_run_lengths(flags: np.ndarray) -> np.ndarray:
    """Measure the length of the run of True that each frame (T,) lies in, 0 for False."""
    edges = np.flatnonzero(np.diff(flags, prepend=not flags[0], append=not flags[-1]))
    lengths = np.diff(edges)
    return np.repeat(lengths, lengths) * flags


def measure_gaits(library: Library) -> tuple[Gait, ...]:
    """Measure the speeds of the library's locomotion: per gait, distance over time of its most common rows.

    A gait without a direction in its labels counts like one with. Rows of key moments and dribbles do not count, nor do
    synthetic clips of a gait that is recorded, nor clips other than the chosen one. A gait whose mean speed is not
    above that of every slower gait is dropped, since thresholds need an order.

    Args:
        library: the library.
    Returns:
        The gaits from slow to fast.
    Raises:
        InputError: if no clip shows locomotion, or none that travels faster than the library stands.
    Source: Faustino 2016, section 3.1.1.
    """
    seconds: dict[str, Any] = {word: Counter() for word in LOCOMOTION}
    metres: dict[str, Any] = {word: Counter() for word in LOCOMOTION}
    frames = library.frames
    step = np.linalg.norm(np.diff(frames.path, axis=0), axis=1)
    chosen = dict(library.chosen_gaits)
    recorded = {word for clip in library.clips if not clip.is_synthetic for row in clip.annotations
                for word in row.words}
    for index, clip in enumerate(library.clips):
        first, rate = frames.first[index], library.fps / clip.motion.fps
        for row in () if clip.mirrored else clip.annotations:
            word = find_gait_label(row)
            if word is None or (clip.is_synthetic and word in recorded) or chosen.get(word, clip.path) != clip.path:
                continue
            low, high = first + int(np.ceil(row.start * rate)), first + int(row.end * rate)
            seconds[word][row.words] += (row.end - row.start) / clip.motion.fps
            metres[word][row.words] += float(step[low:high].sum())
    found = []
    for word, times in seconds.items():
        if times:
            words = max(times, key=lambda w: (times[w], w))
            found.append(Gait(word, words, metres[word][words] / max(times[words], 1e-9)))
    ordered = [gait for i, gait in enumerate(found) if all(gait.speed > other.speed for other in found[:i])]
    if not any(gait.label != STANDING for gait in ordered):
        labelled = any(gait.label != STANDING for gait in found)
        raise InputError(
            library.folder, f"no locomotion clip{' that is faster than its stands' if labelled else ''}",
            "clips annotated walking, jogging, running or sprinting", "label the clips that show locomotion",
        )
    return tuple(ordered)


def find_gait_label(row: ClipAnnotation) -> str | None:
    """Return the gait of a row that shows a gait and at most a direction; None for a key moment, an action or a
    dribble.
    """
    words = [word for word in row.words if word in LOCOMOTION]
    alone = row.key is None and len(words) == 1 and not set(row.words) - {words[0], *DIRECTIONS}
    return words[0] if alone else None

