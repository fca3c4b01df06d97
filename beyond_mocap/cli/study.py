"""The verb `study`: prepare, run and analyse a rating study of how natural motions look."""

from __future__ import annotations

import mimetypes
import os
import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from ..base.errors import InputError, format_count
from ..base.settings.options import add_options, parse_path
from .outputs import ProgressReporter, Writer, add_subverbs, check_outputs

CLIPS, FORMS, ANSWERS = "clips", "forms", "answers"
"""Folders inside a study's folder."""
_MOVIE = ".mp4"
_MAX_EMBEDDED = 200_000_000  # bytes of all clips in one form at most


def add_study(verbs):
    """Add the verb `study`.

    Args:
        verbs: the sub-parsers to add it to.
    Returns:
        The parser of this verb.
    """
    verb = verbs.add_parser("study", help="how natural motions look to raters: order, form, analyse")
    return add_subverbs(verb, "study_verb", _add_order, _add_form, _add_analyse)


def _add_order(verbs):
    verb = verbs.add_parser("order", help="give clips neutral names and each rater an order")
    verb.add_argument("clips", type=parse_path, metavar="CLIPS.csv", help="file,system,scenario; two are 'training'")
    add_options(verb, "study.order")
    verb.set_defaults(run=run_order)
    return verb


def _add_form(verbs):
    verb = verbs.add_parser("form", help="write a page and a table for each rater")
    verb.add_argument("study", type=parse_path, metavar="FOLDER", help="folder written by study order")
    add_options(verb, "study.form")
    verb.set_defaults(run=run_form)
    return verb


def _add_analyse(verbs):
    verb = verbs.add_parser("analyse", help="test the answers: one-sided tests, effect sizes")
    verb.add_argument("study", type=parse_path, metavar="FOLDER", help="the folder of the study")
    verb.add_argument("--answers", type=parse_path, nargs="+", metavar="FILE",
                      help="files or folders; else FOLDER/answers")
    add_options(verb, "study.analyse")
    verb.add_argument("--report", type=parse_path, required=True, metavar="R.json", help="the tests and effect sizes")
    verb.add_argument("--html", type=parse_path, metavar="R.html", help="a page with plots; needs matplotlib")
    verb.set_defaults(run=run_analyse)
    return verb


def run_order(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `study order`: write study.json and, if requested, copy the movies under neutral names.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..files.atomic import atomic_folder
    from ..study.form import MOVIES
    from ..study.order import build_study, read_clips, write_study

    table = options.clips.parent
    clips = [replace(clip, file=_relative_path(options.out, table / clip.file)) for clip in read_clips(options.clips)]
    try:
        study = build_study(clips, options.raters, options.seed, options.pairs)
    except InputError as error:
        if error.where != "clips":
            raise
        raise InputError(options.clips, str(error).removeprefix("clips: ")) from None
    movies = [clip for clip in study.clips if options.copy and Path(clip.file).suffix.lower() in MOVIES]
    with atomic_folder(options.out) as place:
        write_study(place, study)
        if movies:
            (place / CLIPS).mkdir()
        for number, clip in enumerate(movies, 1):
            reporter.check_cancelled()
            _copy_movie(options.out / clip.file, place / CLIPS / clip.name)
            reporter.show_progress(number / len(movies), clip.name)
    reporter.finish()
    if options.copy and len(movies) < len(study.clips):
        reporter.show_note(f"{len(study.clips) - len(movies)} of {len(study.clips)} clips are not movies; render them")
    pages = len(next(iter(study.orders.values())))
    print(f"{options.out}: study {study.id}, {len(study.clips)} clips of {len(study.systems)} systems, "
          f"{format_count(len(study.orders), 'rater')}, pages for each: {pages}")  # fmt: skip


def _relative_path(folder: Path, path: Path) -> str:
    """Build the relative path from a folder that need not exist yet, so that both can be moved together."""
    try:
        return Path(os.path.relpath(path.resolve(), folder.resolve())).as_posix()
    except ValueError:  # on another drive
        return path.resolve().as_posix()


def _copy_movie(source: Path, target: Path) -> None:
    """Copy one movie under its neutral name, without its time stamps and original name."""
    source = source.resolve()
    if not source.is_file():
        raise InputError(source, "no such file", "a movie", "correct the table, or remove --copy")
    shutil.copyfile(source, target.with_suffix(source.suffix.lower()))


def run_form(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `study form`: write a page and a table for each rater to FOLDER/forms.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..files.atomic import atomic_write
    from ..study.form import build_form_page, build_form_table, find_movie
    from ..study.order import read_study

    study = read_study(options.study)
    movies = {clip.name: find_movie(options.study / CLIPS, clip.name) for clip in study.clips}
    missing_names = [name for name, path in movies.items() if path is None]
    if options.embed and missing_names:
        raise InputError(options.study / CLIPS,
                         f"{format_count(len(missing_names), 'clip')} missing, such as {missing_names[0]}{_MOVIE}",
                         "a movie for each clip", "render them first")  # fmt: skip
    sources = _embed_movies(options.study, movies) if options.embed else {
        name: f"../{CLIPS}/{path.name if path else name + _MOVIE}" for name, path in movies.items()
    }
    (options.study / FORMS).mkdir(exist_ok=True)
    for number, rater in enumerate(study.orders, 1):
        reporter.check_cancelled()
        atomic_write(options.study / FORMS / f"{rater}.html", build_form_page(study, rater, sources))
        atomic_write(options.study / FORMS / f"{rater}.csv", build_form_table(study, rater))
        reporter.show_progress(number / len(study.orders), rater)
    reporter.finish()
    if missing_names:
        missing = f"missing: {len(missing_names)} of {len(movies)} clips, such as {missing_names[0]}{_MOVIE}"
        reporter.show_note(f"{options.study / CLIPS}: {missing}")
    print(f"{options.study / FORMS}: {format_count(len(study.orders), 'form')}")


def _embed_movies(folder: Path, movies: Mapping[str, Path]) -> dict[str, str]:
    """Build the data URLs of all clips."""
    from ..evaluation.html_page import build_data_url

    size = sum(path.stat().st_size for path in movies.values())
    if size > _MAX_EMBEDDED:
        what = f"{size / 1e6:.0f} MB of movies"
        raise InputError(folder / CLIPS, what, f"{_MAX_EMBEDDED / 1e6:.0f} MB at most in a page", "remove --embed")
    kinds = {name: mimetypes.guess_type(path.name)[0] or "video/mp4" for name, path in movies.items()}
    return {name: build_data_url(path.read_bytes(), kinds[name]) for name, path in movies.items()}


def run_analyse(options, reporter: ProgressReporter, writers: Mapping[str, Writer]) -> None:
    """Run `study analyse`: write the report and, if requested, its page.

    Args:
        options: the parsed command line.
        reporter: progress, notes and cancellation.
        writers: further output formats, by file suffix (Blender's).
    """
    from ..files.atomic import atomic_write
    from ..files.tables import write_report
    from ..study.analysis import analyse_study
    from ..study.answers import list_answer_files, read_answers
    from ..study.order import read_study
    from ..study.page import build_study_page, build_study_report, format_p

    answers = options.answers or [options.study / ANSWERS]
    check_outputs(options.report, options.html, reserved=(*list_answer_files(answers), options.study / "study.json"))
    study = read_study(options.study)
    analysis = analyse_study(study, read_answers(study, answers), [tuple(pair) for pair in options.better])
    page = build_study_page(analysis) if options.html else None
    write_report(options.report, build_study_report(analysis))
    if page:
        atomic_write(options.html, page)
    reporter.finish(analysis.notes)
    for finding in analysis.findings:
        verdict = "more natural" if finding.better else "not significantly more natural"
        print(f"{finding.new} over {finding.old}: {verdict}, difference {finding.mean:+.2f}, "
              f"one-sided {format_p(finding.holm_p)}")
