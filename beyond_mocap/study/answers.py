"""Read the raters' answers: files that the form saved, or tables that were typed."""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from ..base.content import read_utf8
from ..base.errors import InputError
from ..files.tables import read_rows
from .form import ANSWER_COLUMNS, BACKGROUND, SAME, SCALE
from .order import Study

_MAX_BYTES = 5_000_000


@dataclass(frozen=True)
class Answers:
    """The answers to a study.

    Attributes:
        background: rater -> question -> key of the choice.
        ratings: rater -> neutral name -> 1 to 5.
        choices: rater -> (left, right) -> the chosen name, or SAME.
        missing: number of missing answers of the raters who answered at all, training clips left out.
    """

    background: Mapping[str, Mapping[str, str]]
    ratings: Mapping[str, Mapping[str, int]]
    choices: Mapping[str, Mapping[tuple[str, ...], str]]
    missing: int

    @property
    def raters(self) -> tuple[str, ...]:
        """The raters who answered, by name."""
        return tuple(sorted(self.background))


def read_answers(study: Study, paths: Sequence[Path]) -> Answers:
    """Read the answers in files and folders of files (.csv, .json). Empty answers are left out.

    Args:
        study: the study.
        paths: files and folders.
    Returns:
        The answers.
    Raises:
        InputError: with the line, for answers to another study, of an unknown rater, to an unknown question or with an
            unknown choice; if one rater answers a question in two ways; or without any answer.
    """
    found: dict[str, dict[str, tuple[str, str]]] = {}
    for path in list_answer_files(paths):
        for place, study_id, rater, question, answer in _iter_answers(path):
            if not answer:
                continue
            answer = _check_answer(study, place, study_id, rater=rater, question=question, answer=answer)
            before = found.setdefault(rater, {}).setdefault(question, (answer, place))
            if before[0] != answer:
                conflict = f"{rater} answers {answer} to {question} here and {before[0]} in {before[1]}"
                raise InputError(place, conflict, "one answer", "remove one of the two")
    if not found:
        raise InputError(paths[0] if paths else "answers", "no answers", "files saved by the form", "add them")
    return _sort_answers(study, found)


def _sort_answers(study: Study, found: Mapping[str, Mapping[str, tuple[str, str]]]) -> Answers:
    """Sort the answers by rater into background, ratings and choices."""
    background_keys = {question.key for question in BACKGROUND}
    background, ratings, choices = {}, {}, {}
    missing = 0
    for rater in sorted(found):
        answers = {question: answer for question, (answer, _) in found[rater].items()}
        background[rater] = {key: answer for key, answer in answers.items() if key in background_keys}
        pages = [row for row in study.orders[rater] if study.is_counted(row)]
        page_answers = {row: answers["/".join(row)] for row in pages if "/".join(row) in answers}
        missing += len(pages) - len(page_answers)
        ratings[rater] = {} if study.pairs else {row[0]: int(answer) for row, answer in page_answers.items()}
        choices[rater] = {row: answer for row, answer in page_answers.items()} if study.pairs else {}
    return Answers(background, ratings, choices, missing)


def _check_answer(study: Study, place: str, study_id: str, rater: str, question: str, answer: str) -> str:
    """Check that an answer belongs to this study, and return it."""
    if study_id != study.id:
        raise InputError(place, f"answers to study {study_id or 'without an id'}", study.id,
                         "choose this study's answers")
    if rater not in study.orders:
        raise InputError(place, f"rater {rater!r}", f"one of {', '.join(list(study.orders)[:12])}", "correct the name")
    possible = {one.key: [key for key, _ in one.choices] for one in BACKGROUND}
    scale = [str(value) for value in range(1, len(SCALE) + 1)]
    possible |= {"/".join(row): [*row, SAME] if study.pairs else scale for row in study.orders[rater]}
    if question not in possible:
        raise InputError(place, f"question {question!r}", f"a question for {rater}", "correct the name")
    if answer not in possible[question]:
        raise InputError(place, f"answer {answer!r}", f"one of {', '.join(possible[question])}", "correct it")
    return answer


def list_answer_files(paths: Sequence[Path]) -> list[Path]:
    """List the files that answers are read from.

    Args:
        paths: files, and folders with .csv and .json files.
    Returns:
        The files.
    """
    out = []
    for path in map(Path, paths):
        inside = sorted(path.iterdir()) if path.is_dir() else [path]
        out += [one for one in inside if one == path or one.suffix.lower() in {".csv", ".json"}]
    return out


def _iter_answers(path: Path) -> Iterable[tuple[str, ...]]:
    """Iterate over (place, study, rater, question, answer) of one file."""
    if path.suffix.lower() != ".json":
        for place, row in read_rows(path, ANSWER_COLUMNS, separators=",;\t"):
            yield place, *(row[column] for column in ANSWER_COLUMNS)
        return
    try:
        data = json.loads(read_utf8(path, "answers in JSON", _MAX_BYTES))
        answers = data["answers"].items()
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        raise InputError(path, "not answers in JSON", "a file saved by the form", "save it again") from None
    for question, answer in answers:
        yield str(path), str(data.get("study", "")), str(data.get("rater", "")), str(question), str(answer).strip()
