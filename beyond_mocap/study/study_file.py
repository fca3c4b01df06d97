"""A study on disk: study.json, which raters must not see, and the table of clips that it is made from."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path

from ..base.errors import InputError
from ..files.content import utf8
from ..files.tables import read_rows, write_report
from .order import Clip, Study

NAME = "study.json"
VERSION = 1
COLUMNS = ("file", "system", "scenario")
_LARGEST = 20_000_000
_NAME = re.compile(r"[A-Za-z0-9_-]{1,40}")  # of clips and raters: files are called so


def read_clips(path: Path) -> tuple[Clip, ...]:
    """The clips of a table `file,system,scenario`, without names; InputError with the line of a row that lacks one."""
    clips = []
    for place, row in read_rows(path, COLUMNS, separators=",;\t"):
        for column in COLUMNS[:2]:
            if not row[column]:
                raise InputError(place, f"no {column}", f"{','.join(COLUMNS)} in each row", "complete the row")
        clips.append(Clip(row["file"], row["system"], row["scenario"]))
    return tuple(clips)


def write_study(folder: Path, study: Study) -> None:
    """Writes study.json into a folder."""
    write_report(folder / NAME, {
        "version": VERSION, "study": study.id, "seed": study.seed, "pairs": study.pairs,
        "clips": [{"name": c.name, "file": c.file, "system": c.system, "scenario": c.scenario} for c in study.clips],
        "orders": study.orders,
    })  # fmt: skip


def read_study(folder: Path) -> Study:
    """The study of a folder; InputError where its study.json is missing or is not of that form."""
    path = Path(folder) / NAME
    text = utf8(path, "a study.json, as 'beyond-mocap study order' writes it", _LARGEST)
    try:
        told = json.loads(text)
        json.dumps(told, ensure_ascii=False).encode("utf-8")  # halves of characters can be read but not written
        clips = tuple(Clip(*(str(row[key]) for key in ("file", "system", "scenario", "name"))) for row in told["clips"])
        names = {clip.name for clip in clips}
        orders = {str(rater): tuple(_shown(row, names) for row in rows) for rater, rows in told["orders"].items()}
        if told["version"] != VERSION or not isinstance(told["pairs"], bool) or len(names) != len(clips):
            raise ValueError("another version")
        if odd := next((name for name in (*names, *orders) if not _NAME.fullmatch(name)), None):
            raise ValueError(f"{odd!r} is no name")
        return Study(id=str(told["study"]), seed=int(told["seed"]), pairs=told["pairs"], clips=clips, orders=orders)
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError) as error:
        found = f"not of the form of a study ({type(error).__name__}: {error})"
        raise InputError(path, found, "what 'study order' writes", "make the study again") from None


def _shown(row, names: set[str]) -> tuple[str, ...]:
    """One entry of an order: one or two names that there are."""
    shown = tuple(map(str, row))
    if isinstance(row, (str, Mapping)) or not 1 <= len(shown) <= 2 or not set(shown) <= names:
        raise ValueError(f"{row!r} in an order")
    return shown
