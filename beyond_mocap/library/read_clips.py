"""Reads the clips of a library: every recording once, repaired, on one skeleton, with its labels, and its twin."""

from __future__ import annotations

import os
import re
from collections import deque
from collections.abc import Iterable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from ..annotation import ClipAnnotation
from ..base.errors import InputError, UserCancelledError
from ..base.settings import find_setting
from ..files.clip_file import read_clip
from ..files.motion_file import MotionWriter
from ..motion.motion import Motion
from . import cache
from .clip import Clip, RepairFigures
from .folder.annotations import Annotations
from .library import Progress

if TYPE_CHECKING:
    from .classify.classifier import Classifier
    from .recorded_ball.body_ball import BodyBall
    from .repair import Repair, TPoses

_ROUNDING_SECONDS = 0.1  # s after its clip's end up to which a row's end counts as rounded


@dataclass(frozen=True, kw_only=True)
class Recordings:
    """The recordings of a library and how they are read; see `build_library`.

    Attributes:
        folder: the library's.
        paths: the recordings.
        files: what to read for each of them (`conversions.Conversions`).
        annotations: their labels.
        unit: metres per file unit; None: guessed for each file.
        threads: number of files that are read at once.
        skeleton: file with the library's skeleton; None: that of most frames.
        classifier: proposes labels where no recording has any; None: rules do.
        notes: for the user, so far.
    """

    folder: Path
    paths: list[Path]
    files: list[Path]
    annotations: Annotations
    unit: float | None
    threads: int
    skeleton: Path | None
    classifier: Classifier | None
    notes: tuple[str, ...]


def read_clips(recordings: Recordings, arrays: Path | None, notes: list[str], report: Progress,
               cancelled) -> tuple[list[Clip], Sequence[Motion]]:
    """Read all recordings, repair them, bring them to one skeleton, put each on the floor, and add the twins.

    One motion is in memory at a time; the others wait in files of the folder `arrays` (None: in memory).

    Returns:
        The clips, and their motions, which let go of memory where they lie in a file.
    """
    from .recorded_ball.contact_keys import move_keys_to_contacts
    from .repair import describe_repairs

    levelled, repaired = (MotionWriter(arrays and arrays / f"{name}.npy") for name in ("levelled", "repaired"))
    motions, read = _level_recordings(recordings, levelled, notes, report, cancelled)
    rows = _read_rows(recordings, motions, notes)
    is_proposed = not any(rows)
    repairs, contacts = _repair_clips(recordings, motions, read.drifts, repaired, notes=notes, report=report,
                                      cancelled=cancelled)
    levelled.discard()
    motions, t_poses = repaired.finish(), read.t_poses  # a file that is still mapped keeps its place on the disk
    if is_proposed:
        rows = _propose_rows(recordings, motions, t_poses.frames, report, cancelled)
    balls = [None if ball is None else ball.place(motion) for ball, motion in zip(read.balls, motions)]
    rows = move_keys_to_contacts(motions, balls, t_poses.cut_rows(rows), notes)
    notes += [*t_poses.describe(), *describe_repairs(list(zip(repairs, read.pop_counts)))]
    found = zip(_iter_completed(recordings, motions, rows, contacts, notes), repairs, read.pop_counts, balls,
                t_poses.frames)
    originals = (replace(clip, repair_figures=RepairFigures(pops, repair.drift, *repair.slide), ball=ball,
                         has_proposed_labels=is_proposed, t_pose_frames=frames)
                 for clip, repair, pops, ball, frames in found)
    shown = (motion for motion, is_shown in zip(motions, t_poses.is_shown) if is_shown)
    clips, finished = _write_clips(originals, shown, MotionWriter(arrays and arrays / cache.MOTIONS), notes, cancelled)
    repaired.discard()
    return clips, finished


@dataclass(frozen=True, kw_only=True)
class _Levelled:
    """What is known of recordings when they are read.

    Attributes:
        pop_counts: number of pops that were removed from each.
        drifts: metres by which the floor of each rose or sank.
        balls: theirs; None for recordings without one.
        t_poses: theirs.
    """

    pop_counts: list[int]
    drifts: list[float]
    balls: list[BodyBall | None]
    t_poses: TPoses


def _level_recordings(recordings: Recordings, levelled: MotionWriter, notes: list[str], report: Progress,
                      cancelled) -> tuple[Sequence[Motion], _Levelled]:
    """Read all recordings into `levelled`, without their T-poses; notes get the readers' lines.

    Returns:
        Their motions without pops and drift, on their own skeletons, and what is known of them.
    Raises:
        InputError: if a recording has no legs, or none shows more than a T-pose.
    """
    from .repair import TPoses

    t_poses, unit_notes, changes = TPoses(), [], []
    for path, (source_notes, motion, *change) in zip(recordings.paths, _iter_levelled(recordings, report, cancelled)):
        unit_notes += source_notes
        read_rows = partial(recordings.annotations.read_rows, path, motion.fps)
        levelled.append(t_poses.add_recording(path, motion, read_rows))
        changes.append(change)
    t_poses.check(recordings.folder)
    notes += _collect_unit_notes(unit_notes)
    pop_counts, drifts, balls = (list(column) for column in zip(*changes))
    return levelled.finish(), _Levelled(pop_counts=pop_counts, drifts=drifts, balls=balls, t_poses=t_poses)


def _write_clips(originals: Iterable[Clip], shown: Iterable[Motion], complete: MotionWriter, notes: list[str],
                 cancelled) -> tuple[list[Clip], Sequence[Motion]]:
    """Write the motions of clips and of their twins, with arms outside the trunk.

    Args:
        originals: the clips.
        shown: motions that show how arms hang.
        complete: where to write.
        notes: get a line about the arms.
        cancelled: asked for each clip.
    Returns:
        Clips and twins with the written motions, and these.
    """
    from ..appearance.arm_clearance import ArmClearance
    from .synthetic_clips import sample_each_second

    arms = ArmClearance(sample_each_second(shown))
    known: list[dict] = []  # all of a clip but its motion
    for original in originals:
        check_cancelled(cancelled)
        cleared = replace(original, motion=arms.clear(original.motion))
        for clip in (cleared, cleared.build_twin()):
            complete.append(clip.motion)
            known.append({name: value for name, value in vars(clip).items() if name != "motion"})
    notes += arms.describe()
    finished = complete.finish()
    return [Clip(motion=motion, **rest) for motion, rest in zip(finished, known)], finished


def _repair_clips(recordings: Recordings, motions: Sequence[Motion], drifts: Sequence[float], repaired: MotionWriter,
                  notes: list[str], report: Progress, cancelled) -> tuple[list[Repair], list[np.ndarray]]:
    """Bring motions to one skeleton and repair them into `repaired`; returns what was changed, and their contacts."""
    from . import repair
    from .common_skeleton import unify_skeletons

    chosen, paths = recordings.skeleton, recordings.paths
    example = read_clip(chosen, recordings.unit).motion if chosen is not None else None
    repairs, contacts = [], []
    for number, unified in enumerate(unify_skeletons(paths, motions, example, notes)):
        check_cancelled(cancelled)
        report(0.4 + 0.3 * number / len(paths), f"Repairing and mirroring {paths[number].name}")
        one = repair.repair_floor_and_feet(*unified)
        repaired.append(one.motion)
        contacts.append(one.heel_toe_contacts)
        repairs.append(repair.Repair(drift=one.drift + drifts[number], travel=one.travel, slide=one.slide,
                                     was_sliding=one.was_sliding))
    return repairs, contacts


def _read_rows(recordings: Recordings, motions: Sequence[Motion],
               notes: list[str]) -> list[tuple[ClipAnnotation, ...]]:
    """Read the annotations of all clips, cut to the clips; notes get a line about rows that lose more than rounding."""
    found, cut = [], []
    for path, motion in zip(recordings.paths, motions):
        rows, last = recordings.annotations.read_rows(path, motion.fps), len(motion) - 1
        found.append(_limit_rows(path, rows, len(motion)))
        cut += [(row, last) for row in rows if row.end - last > max(1.0, _ROUNDING_SECONDS * motion.fps)]
    notes += _describe_cut_rows(cut, recordings.folder)
    return found


def _describe_cut_rows(cut: Sequence[tuple[ClipAnnotation, int]], folder: Path) -> list[str]:
    """Describe in a line the rows that end after their clip; each with the clip's last frame."""
    if not cut:
        return []
    row, last = max(cut, key=lambda one: one[0].end - one[1])
    place = Path(os.path.relpath(row.place, folder)).as_posix()
    similar = f" (similar in {len(cut)} rows)" if len(cut) > 1 else ""
    return [f"{place}: the row ends at frame {row.end:.0f}, cut to the clip's last, {last}{similar}"]


def _propose_rows(recordings: Recordings, motions: Sequence[Motion], t_pose_frames: Sequence[tuple[int, int]],
                  report: Progress, cancelled) -> list[tuple[ClipAnnotation, ...]]:
    """Propose the annotations of all clips; InputError where nothing is proposed."""
    from .proposals import propose_labels

    rows, least = [], find_setting("library.learn", "least").default
    for number, (motion, left_out) in enumerate(zip(motions, t_pose_frames)):
        check_cancelled(cancelled)
        report(0.68 + 0.02 * number / len(motions), "Proposing labels")
        proposals = propose_labels(motion, classifier=recordings.classifier, t_pose_frames=left_out)
        rows.append(tuple(one.annotation for one in proposals if one.confidence >= least))
    if not any(rows):
        raise InputError(
            recordings.folder, "no annotation for any clip, and no label to propose",
            "NAME.txt beside the clip or an annotations.csv",
            "label frames as standing, walking, jogging, running, kick ...",
        )
    return rows


def _iter_levelled(recordings: Recordings, report: Progress,
                   cancelled) -> Iterator[tuple[tuple[str, ...], Motion, int, float, BodyBall | None]]:
    """Read files, a few at once: the reader's notes, and the motion without pops and drift, with the number of pops,
    metres of drift, and the ball.

    The unit applies to the user's own files only.
    """
    from . import repair
    from .recorded_ball.body_ball import read_recorded_ball

    paths, ahead = recordings.paths, 2 * max(1, recordings.threads)

    def read_one(path: Path, file: Path):
        source = read_clip(file, recordings.unit if file == path else None)
        motion, pops = repair.remove_pops(source.motion)
        motion, drift = repair.remove_drift(motion)
        ball, ball_notes = read_recorded_ball(path, file, source)
        return (*source.notes, *ball_notes), motion, pops, drift, ball

    both, waiting = zip(paths, recordings.files), deque()
    with ThreadPoolExecutor(max(1, recordings.threads)) as pool:
        try:
            waiting.extend(pool.submit(read_one, *one) for one in islice(both, ahead))
            for number, path in enumerate(paths):
                check_cancelled(cancelled)
                report(0.4 * number / len(paths), f"Reading {path.name}")
                yield waiting.popleft().result()
                waiting.extend(pool.submit(read_one, *one) for one in islice(both, 1))
        finally:
            pool.shutdown(wait=True, cancel_futures=True)


def _iter_completed(recordings: Recordings, motions: Sequence[Motion], rows: Sequence[tuple[ClipAnnotation, ...]],
                    contacts: Sequence[np.ndarray], notes: list[str]) -> Iterator[Clip]:
    """Iterate over the clips; those that end in flight get a landing and getting up, and notes a line about them."""
    from ..synthetic.landing import ends_in_flight
    from . import landings

    flying = [ends_in_flight(motion) for motion in motions]
    getting_ups = landings.collect_getting_ups(motions, rows, contacts) if any(flying) else []
    seconds = []
    for number, path in enumerate(recordings.paths):
        name, own = path.relative_to(recordings.folder).as_posix(), (motions[number], rows[number], contacts[number])
        clip: dict = dict(zip(("motion", "annotations", "heel_toe_contacts"), own))
        if flying[number]:
            end = landings.complete_clip(*own, getting_ups)
            seconds.append(end.seconds)
            clip = {"motion": end.motion, "annotations": end.rows, "heel_toe_contacts": end.heel_toe_contacts,
                    "recorded_count": end.recorded_count}
        yield Clip(path=name, mirrored=False, **clip)
    notes += landings.describe_landings(seconds, getting_ups)


def _limit_rows(path: Path, rows: tuple[ClipAnnotation, ...], count: int) -> tuple[ClipAnnotation, ...]:
    """Cut rows to the clip; InputError for one that starts, or has its key moment, after the clip's end."""
    for row in rows:
        place, expected = row.place or f"annotations of {path}", f"frames 0 to {count - 1} of {path.name}"
        if row.start >= count:
            raise InputError(place, f"a row that starts at frame {row.start:.0f}", expected, "correct the row")
        if row.key is not None and row.key >= count:
            raise InputError(place, f"a key moment at frame {row.key:.0f}", expected, "correct the row")
    return tuple(replace(row, end=min(row.end, count - 1)) for row in rows)


def _collect_unit_notes(read: Sequence[str]) -> list[str]:
    """Collect the reader's notes: each kind of sentence once (numbers aside), with the number of clips that it applies
    to.
    """
    kinds: dict[str, list[str]] = {}
    for note in read:
        kinds.setdefault(re.sub(r"(?<=hips )[\d.]+|\d+(?= frames)|[\d.]+(?= m tall)", "", note), []).append(note)
    return [f"{notes[0]} (similar in {len(notes)} clips)" if len(notes) > 1 else notes[0] for notes in kinds.values()]


def check_cancelled(cancelled) -> None:
    """Raise UserCancelledError if the work was cancelled."""
    if cancelled is not None and cancelled():
        raise UserCancelledError("library: cancelled")
