"""A library: the clips of a folder, a mirrored twin of each, their words, features, clusters and key moments.

`build` reads a folder once and keeps what it worked out in a cache (`library.cache`); the next call is quick.
"""

from __future__ import annotations

import re
from collections import Counter
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Callable, Iterable

import numpy as np

from ..annotation import LOCOMOTION, ClipAnnotation, recorded_thresholds, swap_sides
from ..annotation.gaits import STANDING
from ..annotation.vocabulary import DIRECTIONS
from ..errors import Cancelled, InputError
from ..files import bvh
from ..motion.landing import ends_in_flight
from ..motion.mirror import mirror
from ..motion.motion import Motion
from ..motion.skeleton import Skeleton
from . import cache, landings, one_skeleton, repair
from .clusters import BLOCK_LENGTHS, Clusters, cluster_blocks
from .features import Frames, describe, joined
from .keys import Key, keys_of
from .landings import LANDING_FOLDER
from .made import KICK, MADE_FOLDER, TAKE, TAKES_FROM, gaps, locomotion, made_clips, touch_speed
from .scan import CACHE_FOLDER, Annotations, readable_clips

FPS = 30.0
Progress = Callable[[float, str], None]


@dataclass(frozen=True, eq=False)
class Clip:
    """One recording or its mirrored twin.

    path: below the library's folder, with slashes. motion: at its own rate, metres, the floor (2nd percentile of its
    toe heights, ../shared/metrics.md) at height 0. annotations: frames of its own rate, sides swapped on the twin.
    standing: (T, 2, 2) bool, left and right foot, whether heel and toe stand on the ground. recorded: number of frames
    that are recorded, where landing and getting up were made behind them (`library.landings`); None: all. mended: what
    the repair found and left; None of made clips.
    """

    path: str
    mirrored: bool
    motion: Motion
    annotations: tuple[ClipAnnotation, ...]
    standing: np.ndarray
    recorded: int | None = None
    mended: repair.Mended | None = None

    @property
    def made(self) -> bool:
        """Whether it is made (`library.made`) and no recording."""
        return self.path.startswith(MADE_FOLDER)

    @property
    def recording(self) -> Motion:
        """What of it was recorded."""
        return self.motion if self.recorded is None else self.motion.frames(0, self.recorded)

    def source_at(self, frame: float) -> str:
        """The file that shows `frame` (the clip's own rate), as a path below the library: the recording, or behind its
        end the file of the same frames that was made."""
        made = self.recorded is not None and frame > self.recorded - 1
        if not made:
            return self.path
        return LANDING_FOLDER + self.path + ("" if self.path.lower().endswith(".bvh") else ".bvh")

    @property
    def contacts(self) -> np.ndarray:
        """(T, 2) bool: left and right foot flat on the ground."""
        return self.standing.all(axis=2)

    def words_at(self, frame: float) -> frozenset[str]:
        """Words of every row that covers `frame` (the clip's own rate)."""
        return frozenset(word for row in self.annotations if row.start <= frame <= row.end for word in row.words)

    def twin(self) -> "Clip":
        """The same clip with left and right exchanged (Faustino §3.1.2), words too."""
        rows = tuple(replace(row, words=tuple(swap_sides(row.words))) for row in self.annotations)
        standing = self.standing[:, ::-1]
        return Clip(self.path, not self.mirrored, mirror(self.motion), rows, standing, self.recorded, self.mended)


@dataclass(frozen=True)
class Gait:
    """A kind of locomotion that the library holds: its word, all words of its most common row, and mean speed in
    m/s."""

    word: str
    words: tuple[str, ...]
    speed: float


@dataclass(frozen=True, eq=False)
class Library:
    """Everything a search needs. `frames`: all clips at `fps` (30); `clusters` by block length; notes: what was
    decided; kept: where its cache is and under which key, for what is worked out later; chosen: which clip stands for
    which gait, (word, path) pairs (`library.chosen`)."""

    folder: str
    skeleton: Skeleton
    clips: tuple[Clip, ...]
    frames: Frames
    clusters: dict[int, Clusters]
    fps: float = FPS
    notes: tuple[str, ...] = ()
    kept: tuple[Path, str] | None = None
    chosen: tuple[tuple[str, str], ...] = ()

    @cached_property
    def keys(self) -> tuple[Key, ...]:
        """Key moments of all clips."""
        return keys_of(self.clips)

    @cached_property
    def words(self) -> frozenset[str]:
        """Every word that a clip carries."""
        return frozenset(word for clip in self.clips for row in clip.annotations for word in row.words)

    @cached_property
    def gaits(self) -> tuple[Gait, ...]:
        """The library's own locomotion from slow to fast; InputError where it has none."""
        return measure_gaits(self)

    @cached_property
    def gait_thresholds(self) -> np.ndarray:
        """(G-1,) m/s: where the clips' own annotations change from each gait to the next faster one."""
        frames, gaits = self.frames, self.gaits
        column = {word: i for i, word in enumerate(frames.vocabulary)}
        labelled = np.full(len(frames), -1)
        for number, gait in enumerate(gaits):
            labelled[frames.words[:, column[gait.word]]] = number
        return recorded_thresholds(np.array([gait.speed for gait in gaits]), frames.speed, labelled)

    @cached_property
    def stance_seconds(self) -> np.ndarray:
        """(N,) seconds that the foot which leaves the ground sooner stands there in all at each frame; 0 while one is
        in the air. Whoever plays it faster or slower than the track drags that foot as long."""
        return np.concatenate([_stance_seconds(clip, self._own_frames(i)) for i, clip in enumerate(self.clips)])

    @cached_property
    def feet_standing(self) -> np.ndarray:
        """(N, 2) bool: left and right foot on the ground, heel or toe."""
        return np.concatenate([_standing(clip, self._own_frames(i)) for i, clip in enumerate(self.clips)])

    def _own_frames(self, clip: int) -> np.ndarray:
        first = self.frames.first[clip]
        return self.frames.source[first : first + self.frames.count[clip]]

    @cached_property
    def extended(self) -> "Library":
        """The recordings and, behind them, what `library.made` makes of them: the speeds between and above them, and
        kicks and taken balls on the run; made on first use and kept beside the cache. It has no clusters. InputError
        where no recording shows locomotion."""
        measure_gaits(self)  # a library without locomotion stays an error
        made = cache.load(*self.kept, "made") if self.kept else None
        if made is None:
            made = _made(self)
            if self.kept:
                _keep_made(self.kept[0], made.clips)
                cache.save(*self.kept, made, "made")
        else:
            _keep_made(self.kept[0], made.clips, missing_only=True)
        if not made.clips:
            return self
        frames = joined(self.frames, made.frames)
        return replace(self, clips=(*self.clips, *made.clips), frames=frames, clusters={})

    @cached_property
    def gaps(self) -> tuple[tuple[float, float], ...]:
        """(from, to) m/s of the speeds that recorded locomotion does not reach."""
        return gaps(self.frames.speed[locomotion(self.frames, self.clips)], self.fps)

    def lacks(self, speed: np.ndarray, at_keys: np.ndarray, takes: np.ndarray) -> bool:
        """Whether a track at `speed` (T,) m/s, at the library's rate, stays in a gap for a fifth of a second or more,
        or has key moments, at `at_keys` (K,) m/s, that are faster than any recorded kick, or, where one `takes` (K,)
        bool the ball, any recorded taking of a ball with the foot, can be played without sliding."""
        inside = sum(int(np.sum((speed > low) & (speed < high))) for low, high in self.gaps)
        kick, take = (touch_speed(self.frames, self.clips, self.keys, act) for act in (KICK, TAKE))
        too_fast = 1.3 * np.where(takes & np.isfinite(take), max(take, TAKES_FROM), kick)
        return inside >= 0.2 * self.fps or bool(np.any(at_keys > too_fast))

    @cached_property
    def fastest(self) -> float:
        """m/s: the highest speed that a clip reaches."""
        return float(self.frames.speed.max())

    @property
    def minutes(self) -> float:
        """Recorded minutes, twins not counted."""
        return sum(clip.motion.duration for clip in self.clips if not clip.mirrored) / 60.0


def build(
    folder: str | Path,
    *,
    rebuild: bool = False,
    cache_dir: str | Path | None = None,
    skeleton: str | Path | None = None,
    unit: float | None = None,
    seed: int = 0,
    threads: int = 1,
    progress: Progress | None = None,
    cancelled: Callable[[], bool] | None = None,
) -> Library:
    """The library of all recordings below `folder`, from its cache where nothing has changed.

    rebuild: ignore the cache. cache_dir: where to keep it (default: the folder itself, else the user's cache folder).
    skeleton: a BVH file whose skeleton it is (default: the one with most frames, ties by name). unit: metres per file
    unit (default: guessed per file). seed: of the clustering. threads: how many files are read at once, which
    changes no bit of what comes out.
    Clips of other skeletons are brought to this one and all are mended (`one_skeleton`, `repair`); notes say how.
    Raises InputError for unreadable files, a folder without clips, or clips without legs; Cancelled.
    """
    folder = Path(folder)
    report = progress or (lambda fraction, text: None)
    place, where = cache.place(folder, cache_dir)
    paths, conversions, waiting = readable_clips(folder, place)
    files = [conversions.readable(path) for path in paths]
    annotations = Annotations(folder, paths)
    chosen = Path(skeleton) if skeleton else None
    key = cache.fingerprint(folder, files, annotations.sources(paths), chosen, unit=unit, seed=seed)
    if not rebuild:
        report(0.0, "Reading the cache")
        found = cache.load(place, key)
        if found is not None:
            _keep_made(place, _completed(found.clips), missing_only=True)
            return replace(found, folder=str(folder), kept=(place, key), notes=(*found.notes, *waiting))
    notes: list[str] = [where] if where else []
    clips = _read_clips(folder, paths, files, annotations, chosen, unit, threads, notes, report, cancelled)
    built = _index(str(folder), clips, tuple(notes), seed, report, cancelled)
    _keep_made(place, _completed(built.clips))
    if not cache.save(place, key, built):
        told = (
            f"{place} cannot be written: the library is worked out anew each time; give --cache "
            "(in Blender: Cache Folder in the preferences) a folder of yours"
        )
        built = replace(built, notes=(*built.notes, told))
    report(1.0, "Library ready")
    return replace(built, kept=(place, key), notes=(*built.notes, *waiting))


def _made(library: Library) -> Library:
    """What the recordings lack (`library.made`), described like them."""
    speeds = {gait.word: gait.speed for gait in library.gaits if gait.word != STANDING}
    clips = []
    for made in made_clips(library.clips, library.frames, library.fps, speeds, library.keys):
        clip = Clip(made.name, False, made.motion, made.rows, made.standing)
        clips += [clip, clip.twin()]
    if not clips:
        return replace(library, clips=())
    frames = described(clips, library.frames)
    return replace(library, clips=tuple(clips), frames=frames, clusters={}, notes=())


def _completed(clips: Iterable[Clip]) -> list[Clip]:
    """Those that go on behind their recording's end."""
    return [clip for clip in clips if clip.recorded is not None]


def _keep_made(place: Path, made: Iterable[Clip], missing_only: bool = False) -> None:
    """Writes clips that are made, or end so, as BVH beside the cache, so that whoever follows a take's provenance finds
    them; a place that cannot be written is left alone. missing_only: those that are not there, as when someone has
    tidied up."""
    try:
        for clip in made:
            file = place / Path(clip.source_at(len(clip.motion) - 1)).relative_to(CACHE_FOLDER)
            if not clip.mirrored and not (missing_only and file.exists()):
                file.parent.mkdir(parents=True, exist_ok=True)
                bvh.write(file, clip.motion)
    except OSError:
        return


def _read_clips(folder, paths, files, annotations, chosen, unit, threads, notes, report, cancelled) -> tuple[Clip, ...]:
    """Reads all recordings, mends them, brings them to one skeleton, sets each on the floor, and adds the twins."""
    read, unpopped, level = zip(*_read_files(paths, files, unit, threads, report, cancelled))
    notes += _unit_notes(read)
    carried = one_skeleton.bring(paths, [motion for motion, _ in level], _chosen(chosen, unit), notes)
    mended, rows = [], []
    for number, (path, (motion, standing, moved)) in enumerate(zip(paths, carried)):
        _check(cancelled)
        report(0.4 + 0.3 * number / len(paths), f"Mending and mirroring {path.name}")
        one = repair.grounded(motion, standing, moved)
        mended.append(replace(one, drift=one.drift + level[number][1]))
        rows.append(_rows(path, annotations.of(path, motion.fps), len(motion)))
    notes += repair.told([(one, pops) for one, (_, pops) in zip(mended, unpopped)])
    originals = _landed([path.relative_to(folder).as_posix() for path in paths], mended, rows, notes)
    told = [repair.Mended(pops, one.drift, *one.slide) for one, (_, pops) in zip(mended, unpopped)]
    originals = [replace(clip, mended=what) for clip, what in zip(originals, told)]
    clips = [clip for original in originals for clip in (original, original.twin())]
    if not any(clip.annotations for clip in clips):
        raise InputError(
            folder, "no annotation for any clip", "NAME.txt beside NAME.bvh or an annotations.csv",
            "write which frames are standing, walking, jogging, running, kick ...",
        )
    return tuple(clips)


def _read_files(paths, files, unit, threads, report, cancelled) -> list[tuple]:
    """Each file as read, without pops (and their number), and without drift (and its metres); some at once. files: what
    to read for each of `paths` (`converted`); the unit is that of the user's own files."""

    def read_one(path: Path, file: Path):
        source = bvh.read(file, unit if file == path else None)
        unpopped = repair.without_pops(source.motion)
        return source, unpopped, repair.without_drift(unpopped[0])

    read = []
    with ThreadPoolExecutor(max(1, threads)) as pool:
        waiting = [pool.submit(read_one, *both) for both in zip(paths, files)]
        try:
            for number, (path, one) in enumerate(zip(paths, waiting)):
                _check(cancelled)
                report(0.4 * number / len(paths), f"Reading {path.name}")
                read.append(one.result())
        finally:
            pool.shutdown(wait=True, cancel_futures=True)
    return read


def _landed(names: list[str], mended: list[repair.Repaired], rows, notes: list[str]) -> list[Clip]:
    """The clips, those that end in flight with landing and getting up behind them."""
    flying = [ends_in_flight(one.motion) for one in mended]
    ways = landings.ways_up([(one.motion, own, one.standing) for one, own in zip(mended, rows)]) if any(flying) else []
    clips, ends = [], []
    for name, one, own, flies in zip(names, mended, rows, flying):
        if flies:
            ends.append(landings.completed(one.motion, own, one.standing, ways))
            clips.append(Clip(name, False, ends[-1].motion, ends[-1].rows, ends[-1].standing, ends[-1].recorded))
        else:
            clips.append(Clip(name, False, one.motion, own, one.standing))
    notes += landings.told(ends, ways)
    return clips


def _chosen(path: Path | None, unit: float | None) -> Motion | None:
    """The recording whose skeleton the user chose."""
    return bvh.read(path, unit).motion if path is not None else None


def _rows(path: Path, rows: tuple[ClipAnnotation, ...], count: int) -> tuple[ClipAnnotation, ...]:
    """Rows cut to the clip; InputError for one that begins, or has its key moment, after the clip's end."""
    for row in rows:
        if row.start >= count:
            what = f"a row that begins at frame {row.start:g}"
            raise InputError(path, what, f"frames 0 to {count - 1}", "mend the row")
        if row.key is not None and row.key >= count:
            raise InputError(path, f"a key moment at frame {row.key:g}", f"frames 0 to {count - 1}", "mend the row")
    return tuple(replace(row, end=min(row.end, count - 1)) for row in rows)


def _unit_notes(read) -> list[str]:
    """What the reader decided: each kind of sentence once (numbers apart), with the number of clips it holds for."""
    kinds: dict[str, list[str]] = {}
    for source in read:
        for note in source.notes:
            kinds.setdefault(re.sub(r"(?<=hips )[\d.]+", "", note), []).append(note)
    return [f"{told[0]} (so, or nearly so, {len(told)} clips)" if len(told) > 1 else told[0] for told in kinds.values()]


def _index(folder: str, clips, notes, seed, report, cancelled) -> Library:
    """Features, words and clusters of `clips`."""
    _check(cancelled)
    report(0.7, "Describing frames")
    frames = described(clips)
    clusters = {}
    for number, length in enumerate(BLOCK_LENGTHS):
        _check(cancelled)
        report(0.8 + 0.06 * number, f"Clustering blocks of {length} frames")
        clusters[length] = cluster_blocks(frames, length, seed)
    return Library(folder, clips[0].motion.skeleton, clips, frames, clusters, FPS, notes)


def described(clips, like: Frames | None = None) -> Frames:
    """Frames of `clips` with all words they carry, their features comparable with those of `like`."""
    from threadpoolctl import threadpool_limits

    vocabulary = tuple(sorted({word for clip in clips for row in clip.annotations for word in row.words}))
    words_of = lambda clip, source: words_matrix(clip, source, vocabulary)  # noqa: E731
    with threadpool_limits(limits=1):  # with more, sums of products come out in another order
        return describe(clips[0].motion.skeleton, clips, words_of, vocabulary, FPS, like)


def _standing(clip: Clip, source: np.ndarray) -> np.ndarray:
    """(T, 2) of one clip at its frames `source` (T,)."""
    return clip.standing.any(axis=2)[_nearest(clip, source)]


def _stance_seconds(clip: Clip, source: np.ndarray) -> np.ndarray:
    """(T,) of one clip at its frames `source` (T,)."""
    stands = clip.standing.any(axis=2)
    length = np.stack([_run_lengths(stands[:, side]) for side in (0, 1)], axis=1).min(axis=1) / clip.motion.fps
    return length[_nearest(clip, source)]


def _nearest(clip: Clip, source: np.ndarray) -> np.ndarray:
    """(T,) the clip's whole frames nearest to `source` (T,)."""
    return np.clip(np.round(source).astype(int), 0, len(clip.standing) - 1)


def _run_lengths(flags: np.ndarray) -> np.ndarray:
    """(T,) length of the run of True that each frame lies in, 0 for False."""
    edges = np.flatnonzero(np.diff(flags, prepend=not flags[0], append=not flags[-1]))
    lengths = np.diff(edges)
    return np.repeat(lengths, lengths) * flags


def words_matrix(clip: Clip, source: np.ndarray, vocabulary: tuple[str, ...]) -> np.ndarray:
    """(T, V) bool: which words of `vocabulary` a clip carries at fractional frames `source` (T,) of its own rate."""
    column = {word: i for i, word in enumerate(vocabulary)}
    out = np.zeros((len(source), len(vocabulary)), bool)
    for row in clip.annotations:
        inside = (source >= row.start) & (source <= row.end)
        for word in row.words:
            out[inside, column[word]] = True
    return out


def measure_gaits(library: Library) -> tuple[Gait, ...]:
    """Speeds of the library's locomotion (Faustino §3.1.1): per gait word, distance over time of its most common rows.

    A gait without a direction in its words counts as well as one with; rows of key moments and dribbles do not count,
    nor do made clips of a gait that is recorded, nor other clips than the chosen one, nor rows that a slower one would
    overtake in the mean (then the word is dropped, since thresholds need an order).
    """
    seconds: dict[str, Counter] = {word: Counter() for word in LOCOMOTION}
    metres: dict[str, Counter] = {word: Counter() for word in LOCOMOTION}
    frames = library.frames
    step = np.linalg.norm(np.diff(frames.path, axis=0), axis=1)
    chosen = dict(library.chosen)
    recorded = {word for clip in library.clips if not clip.made for row in clip.annotations for word in row.words}
    for index, clip in enumerate(library.clips):
        first, rate = frames.first[index], library.fps / clip.motion.fps
        for row in () if clip.mirrored else clip.annotations:
            word = gait_word(row)
            if word is None or (clip.made and word in recorded) or chosen.get(word, clip.path) != clip.path:
                continue
            low, high = first + int(np.ceil(row.start * rate)), first + int(row.end * rate)
            seconds[word][row.words] += (row.end - row.start) / clip.motion.fps
            metres[word][row.words] += float(step[low:high].sum())
    found = []
    for word, times in seconds.items():
        if times:
            words = max(times, key=lambda w: (times[w], w))
            found.append(Gait(word, words, metres[word][words] / max(times[words], 1e-9)))
    if not any(gait.word != STANDING for gait in found):
        raise InputError(
            library.folder, "no locomotion clip", "clips annotated walking, jogging, running or sprinting",
            "annotate which clips are locomotion",
        )
    ordered = [gait for i, gait in enumerate(found) if all(gait.speed > other.speed for other in found[:i])]
    return tuple(ordered)


def gait_word(row: ClipAnnotation) -> str | None:
    """The gait that a row shows and nothing else, but for a direction; None of a key moment, an action or a dribble."""
    words = [word for word in row.words if word in LOCOMOTION]
    alone = row.key is None and len(words) == 1 and not set(row.words) - {words[0]} - _DIRECTIONS
    return words[0] if alone else None


_DIRECTIONS = frozenset(DIRECTIONS)


def _check(cancelled) -> None:
    if cancelled is not None and cancelled():
        raise Cancelled("library: cancelled")
