"""Builds a library from a folder: every recording read once, repaired, on one skeleton, indexed and cached.

In a folder without any annotation, labels are proposed (`library.proposals`), used at once, and marked as proposed.
"""

from __future__ import annotations

import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from pathlib import Path
from typing import Callable, Iterable

from ..annotation import ClipAnnotation
from ..base.errors import InputError, UserCancelledError
from ..base.settings import find_setting
from ..files.bvh import bvh
from ..synthetic.landing import ends_in_flight
from . import cache, landings, repair
from . import common_skeleton as one_skeleton
from .cache import write_synthetic_clips
from .classify.classifier import FILE_NAME, Classifier, read_classifier
from .clip import Clip
from .features import FPS, build_frames
from .library import Library, Progress
from .proposals import propose_labels
from .scan import Annotations, find_readable_clips


def build_library(
    folder: str | Path, *, rebuild: bool = False, cache_dir: str | Path | None = None,
    skeleton: str | Path | None = None, unit: float | None = None, seed: int = 0, threads: int = 1,
    progress: Progress | None = None, cancelled: Callable[[], bool] | None = None,
) -> Library:
    """Build the library of all recordings below a folder, or load it from its cache where nothing has changed.

    Clips of other skeletons are retargeted to this one and all are repaired (`common_skeleton`, `repair`); notes say
    how. Where no clip has an annotation, labels are proposed, by the model that was learned for this folder if there is
    one, and `Library.proposal_notes` says so.

    Args:
        folder: where the recordings are.
        rebuild: ignore the cache.
        cache_dir: where to save it (default: the folder itself, else the user's cache folder).
        skeleton: a BVH file with the library's skeleton (default: the one with most frames, ties by name).
        unit: metres per file unit (default: guessed per file).
        seed: of the clustering.
        threads: number of files read at once; changes no bit of the result.
        progress: called with a fraction and a text.
        cancelled: called often; True stops the work.
    Returns:
        The library.
    Raises:
        InputError: for unreadable files, a folder without clips, clips without legs, or of which neither annotations
            nor proposals say anything.
        UserCancelledError: if `cancelled` returns True.
    """
    folder = Path(folder)
    report = progress or (lambda fraction, text: None)
    place, cache_note = cache.find_cache_folder(folder, cache_dir)
    paths, conversions, waiting = find_readable_clips(folder, place)
    files = [conversions.find_readable_file(path) for path in paths]
    annotations = Annotations(folder, paths)
    skeleton_file = Path(skeleton) if skeleton else None
    model = _find_model(place, annotations, paths)
    sources = [*annotations.list_sources(paths), *([model] if model else [])]
    key = cache.compute_fingerprint(folder, files, sources, skeleton_file, unit=unit)
    if not rebuild:
        report(0.0, "Reading the cache")
        found = cache.load_library(place, key)
        if found is not None:
            write_synthetic_clips(place, _list_completed(found["clips"]), missing_only=True)
            found["notes"] += tuple(waiting)
            return Library(folder=str(folder), cache_location=(place, key), seed=seed, **found)
    notes: list[str] = [*([cache_note] if cache_note else []), *annotations.describe_unknown_files(folder),
                        *annotations.describe_lone_texts(folder)]
    clips = _read_clips(folder, paths, files, annotations=annotations, chosen=skeleton_file, unit=unit, threads=threads,
                        notes=notes, report=report, cancelled=cancelled,
                        classifier=read_classifier(model) if model else None)
    library = _index_clips(str(folder), clips, tuple(notes), seed=seed, report=report, cancelled=cancelled)
    write_synthetic_clips(place, _list_completed(library.clips))
    if not cache.save_library(place, key, library):
        note = (
            f"{place} cannot be written: the library is rebuilt each time; "
            "choose a cache folder that you can write to"
        )
        library = replace(library, notes=(*library.notes, note))
    report(1.0, "Library ready")
    return replace(library, cache_location=(place, key), notes=(*library.notes, *waiting))


def _list_completed(clips: Iterable[Clip]) -> list[Clip]:
    """List the clips that continue after their recording's end."""
    return [clip for clip in clips if clip.recorded_count is not None]


def _find_model(place: Path, annotations: Annotations, paths: list[Path]) -> Path | None:
    """Find the learned model in the cache folder; None where there is none, or where any clip has annotations."""
    model = place / FILE_NAME
    return model if model.is_file() and not any(annotations.read_rows(path, FPS) for path in paths) else None


def _read_clips(folder, paths, files, annotations, chosen, unit, threads, notes, report, cancelled,
                classifier) -> tuple[Clip, ...]:
    """Read all recordings, repair them, bring them to one skeleton, put each on the floor, and add the twins."""
    read, without_pops, levelled = zip(*_read_files(paths, files, unit, threads=threads, report=report,
                                                    cancelled=cancelled))
    notes += _collect_unit_notes(read)
    example = bvh.read_bvh(chosen, unit).motion if chosen is not None else None
    unified = one_skeleton.unify_skeletons(paths, [motion for motion, _ in levelled], example, notes)
    repaired, rows = [], []
    for number, (path, (motion, standing, was_retargeted)) in enumerate(zip(paths, unified)):
        _check_cancelled(cancelled)
        report(0.4 + 0.3 * number / len(paths), f"Repairing and mirroring {path.name}")
        one = repair.repair_floor_and_feet(motion, standing, was_retargeted)
        repaired.append(replace(one, drift=one.drift + levelled[number][1]))
        rows.append(_limit_rows(path, annotations.read_rows(path, motion.fps), len(motion)))
    is_proposed = not any(rows)
    if is_proposed:
        rows = _propose_rows(folder, repaired, classifier, report, cancelled)
    notes += repair.describe_repairs([(one, pops) for one, (_, pops) in zip(repaired, without_pops)])
    originals = _complete_landings([path.relative_to(folder).as_posix() for path in paths], repaired, rows, notes)
    figures = [repair.RepairFigures(pops, one.drift, *one.slide) for one, (_, pops) in zip(repaired, without_pops)]
    originals = [replace(clip, repair_figures=what, has_proposed_labels=is_proposed)
                 for clip, what in zip(originals, figures)]
    return tuple(clip for original in originals for clip in (original, original.build_twin()))


def _propose_rows(folder: Path, repaired: list[repair.RepairedClip], classifier: Classifier | None,
                  report: Progress, cancelled) -> list[tuple[ClipAnnotation, ...]]:
    """Propose the annotations of all clips; InputError where nothing is proposed."""
    rows, least = [], find_setting("library.learn", "least").default
    for number, one in enumerate(repaired):
        _check_cancelled(cancelled)
        report(0.68 + 0.02 * number / len(repaired), "Proposing labels")
        proposals = propose_labels(one.motion, classifier=classifier)
        rows.append(tuple(one.annotation for one in proposals if one.confidence >= least))
    if not any(rows):
        raise InputError(
            folder, "no annotation for any clip, and no label to propose",
            "NAME.txt beside NAME.bvh or an annotations.csv",
            "label frames as standing, walking, jogging, running, kick ...",
        )
    return rows


def _read_files(paths, files, unit, threads, report, cancelled) -> list[tuple]:
    """Read files, several at once: each as read, without pops (and their number), and without drift (and its metres).

    files: what to read for each of `paths` (`scan.Conversions`); the unit applies to the user's own files only.
    """

    def read_one(path: Path, file: Path):
        source = bvh.read_bvh(file, unit if file == path else None)
        unpopped = repair.remove_pops(source.motion)
        return source, unpopped, repair.remove_drift(unpopped[0])

    read = []
    with ThreadPoolExecutor(max(1, threads)) as pool:
        waiting = [pool.submit(read_one, *both) for both in zip(paths, files)]
        try:
            for number, (path, one) in enumerate(zip(paths, waiting)):
                _check_cancelled(cancelled)
                report(0.4 * number / len(paths), f"Reading {path.name}")
                read.append(one.result())
        finally:
            pool.shutdown(wait=True, cancel_futures=True)
    return read


def _complete_landings(names: list[str], repaired: list[repair.RepairedClip], rows, notes: list[str]) -> list[Clip]:
    """Build the clips; those that end in flight get a landing and getting up."""
    flying = [ends_in_flight(one.motion) for one in repaired]
    getting_ups = landings.collect_getting_ups([(one.motion, own, one.heel_toe_contacts) for one,
                                                own in zip(repaired, rows)]) if any(flying) else []
    clips, ends = [], []
    for name, one, own, flies in zip(names, repaired, rows, flying):
        if flies:
            ends.append(landings.complete_clip(one.motion, own, one.heel_toe_contacts, getting_ups))
            clips.append(Clip(path=name, mirrored=False, motion=ends[-1].motion, annotations=ends[-1].rows,
                              heel_toe_contacts=ends[-1].heel_toe_contacts, recorded_count=ends[-1].recorded_count))
        else:
            clips.append(Clip(path=name, mirrored=False, motion=one.motion, annotations=own,
                              heel_toe_contacts=one.heel_toe_contacts))
    notes += landings.describe_landings(ends, getting_ups)
    return clips


def _limit_rows(path: Path, rows: tuple[ClipAnnotation, ...], count: int) -> tuple[ClipAnnotation, ...]:
    """Cut rows to the clip; InputError for one that starts, or has its key moment, after the clip's end."""
    for row in rows:
        if row.start >= count:
            what = f"a row that starts at frame {row.start:g}"
            raise InputError(path, what, f"frames 0 to {count - 1}", "correct the row")
        if row.key is not None and row.key >= count:
            raise InputError(path, f"a key moment at frame {row.key:g}", f"frames 0 to {count - 1}", "correct the row")
    return tuple(replace(row, end=min(row.end, count - 1)) for row in rows)


def _collect_unit_notes(read) -> list[str]:
    """Collect the reader's notes: each kind of sentence once (numbers aside), with the number of clips that it applies
    to.
    """
    kinds: dict[str, list[str]] = {}
    for source in read:
        for note in source.notes:
            kinds.setdefault(re.sub(r"(?<=hips )[\d.]+", "", note), []).append(note)
    return [f"{notes[0]} (similar in {len(notes)} clips)" if len(notes) > 1 else notes[0] for notes in kinds.values()]


def _index_clips(folder: str, clips, notes, seed, report, cancelled) -> Library:
    """Index the clips: features and labels."""
    _check_cancelled(cancelled)
    report(0.7, "Describing frames")
    return Library(folder=folder, skeleton=clips[0].motion.skeleton, clips=clips, frames=build_frames(clips), fps=FPS,
                   notes=notes, seed=seed)


def _check_cancelled(cancelled) -> None:
    """Raise UserCancelledError if the work was cancelled."""
    if cancelled is not None and cancelled():
        raise UserCancelledError("library: cancelled")
