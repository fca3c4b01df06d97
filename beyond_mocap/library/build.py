"""Builds a library from a folder: its clips are read, indexed and cached.

In a folder without any annotation, labels are proposed (`library.proposals`), used at once, and marked as proposed.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import ExitStack
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

from ..base.errors import InputError
from ..base.memory import check_memory
from ..files.atomic import FULL
from ..files.motion_file import MappedMotions
from . import cache
from .cache import write_synthetic_clips
from .clip import Clip
from .features import FPS, build_frames
from .folder.annotations import Annotations
from .folder.conversions import find_readable_clips, read_stamp
from .folder.label_notes import describe_lone_texts, describe_misspelled_labels, describe_unused_labels
from .folder.recordings import find_recordings_and_labels
from .library import RECORDED_INDEX, Library, Progress
from .read_clips import Recordings, check_cancelled, read_clips
from .recorded_ball.ball_table import find_ball_table

if TYPE_CHECKING:
    from .classify.classifier import Classifier

_BASE_BYTES = 1e8  # of memory that a build needs
_BYTES_PER_BYTE = {".bvh": 4.0, ".npz": 16.0}  # of memory that it needs for a byte of its files: text is longer


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
    recordings, labels = find_recordings_and_labels(folder)
    paths, conversions, waiting = find_readable_clips(folder, place, recordings)
    files = [conversions.find_readable_file(path) for path in paths]
    annotations = Annotations(folder, paths)
    skeleton_file = Path(skeleton) if skeleton else None
    model = _find_model(place, annotations, paths)
    balls = [table for one in zip(paths, files) if (table := find_ball_table(*one)) is not None]
    label_files = annotations.list_sources(paths)
    sources = [*label_files, *balls, *([model] if model else [])]
    messages = [*waiting, *describe_unused_labels(folder, recordings, labels, tables=annotations.tables,
                                                  used=set(label_files))]
    digests = cache.SourceDigests(place)
    key = cache.compute_fingerprint(folder, files, sources, skeleton_file, digests, unit=unit)
    if not rebuild:
        report(0.0, "Reading the cache" if cache.has_library(place) else "Reading the recordings")
        found = cache.load_library(place, key)
        if found is not None:
            write_synthetic_clips(place, _list_completed(found["clips"]), missing_only=True)
            digests.save()
            found["notes"] += tuple(messages)
            return _remember(Library(folder=str(folder), cache_location=(place, key), seed=seed, **found))
    needed = sum(read_stamp(file)[0] * _BYTES_PER_BYTE[file.suffix.lower()] for file in files)
    check_memory(folder, _BASE_BYTES + needed, "use fewer or shorter clips")
    messages += cache.describe_outdated_cache(place)
    sources_read = Recordings(
        folder=folder, paths=paths, files=files, annotations=annotations, unit=unit, threads=threads,
        skeleton=skeleton_file, classifier=_read_model(model) if model else None,
        notes=(*([cache_note] if cache_note else []), *describe_lone_texts(folder, recordings, labels)),
    )
    library = _build_cached(sources_read, place, key, seed, report=report, cancelled=cancelled)
    digests.save()
    report(1.0, "Library ready")
    return _remember(replace(library, cache_location=(place, key), notes=(*library.notes, *messages)))


def _remember(library: Library) -> Library:
    """Give a library what the cache knows of it: what its recordings lack, and where its index is; and the notes that
    depend on the program's vocabulary, which may be newer than the cache.
    """
    rows = {clip.path: clip.annotations for clip in library.clips if not clip.mirrored}
    misspelled = [line for line in describe_misspelled_labels(rows) if line not in library.notes]
    if misspelled:
        library = replace(library, notes=(*library.notes, *misspelled))
    coverage = cache.load_coverage(*library.cache_location)
    vars(library)["index_place"] = (*library.cache_location, RECORDED_INDEX)
    if coverage is not None:
        vars(library)["coverage"] = coverage  # where a cached property keeps its value
    return library


def _build_cached(recordings: Recordings, place: Path, key: str, seed: int, report: Progress, cancelled) -> Library:
    """Build the library in files of its cache; in memory, with a note, where the cache's folder cannot be made.

    Raises:
        InputError: if a file cannot be written or read in the middle: the disk gets full, where memory would too.
    """
    with ExitStack() as stack:
        try:
            arrays = stack.enter_context(cache.create_arrays_folder(place))
        except OSError:
            library = _index_clips(recordings, None, seed, report, cancelled)
            note = (f"{place} cannot be written: the library is rebuilt each time; choose a cache folder that you can "
                    "write to")
            return replace(library, notes=(*library.notes, note))
        try:
            library = _index_clips(recordings, arrays, seed, report, cancelled)
            write_synthetic_clips(place, _list_completed(library.clips))
            cache.save_library(place, key, library, arrays=arrays)
        except OSError as error:
            raise _describe_failure(place, error) from None
        cache.save_coverage(place, key, library.coverage)
        return library


def _describe_failure(place: Path, error: OSError) -> InputError:
    """Describe what ended a build in the cache's folder `place`: a full disk, or anything else."""
    if error.errno in FULL:
        return InputError(place, f"the library's cache cannot be written ({error.strerror})", "",
                          "free space on its disk, or choose another cache folder")
    return InputError(error.filename or place, f"failed while the library was built ({error.strerror or error})",
                      "files that can be read and written until the end", "try again, or choose another cache folder")


def _list_completed(clips: Iterable[Clip]) -> list[Clip]:
    """List the clips that continue after their recording's end."""
    return [clip for clip in clips if clip.recorded_count is not None]


def _find_model(place: Path, annotations: Annotations, paths: list[Path]) -> Path | None:
    """Find the learned model in the cache folder; None where there is none, or where any clip has annotations."""
    model = place / cache.CLASSIFIER_FILE
    return model if model.is_file() and not any(annotations.read_rows(path, FPS) for path in paths) else None


def _read_model(file: Path) -> Classifier:
    """Read a learned model."""
    from .classify.classifier import read_classifier

    return read_classifier(file)


def _index_clips(recordings: Recordings, arrays: Path | None, seed: int, report: Progress, cancelled) -> Library:
    """Read and index the clips: features and labels."""
    notes = list(recordings.notes)
    clips, motions = read_clips(recordings, arrays, notes, report, cancelled)

    def report_clip(number: int) -> None:
        check_cancelled(cancelled)
        report(0.7 + 0.25 * number / len(clips), "Describing frames")
        if isinstance(motions, MappedMotions):
            motions.release()

    frames = build_frames(clips, on_clip=report_clip)
    return Library(folder=str(recordings.folder), skeleton=clips[0].motion.skeleton, clips=tuple(clips), frames=frames,
                   fps=FPS, notes=tuple(notes), seed=seed)
