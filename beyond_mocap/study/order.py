"""A study: clips under neutral names, each rater's order (Faustino §5.1.1), and both as a file.

No name reveals which system produced a clip. All raters see other orders, with systems and scenarios mixed; two
training clips come first and do not count. Raters must not see study.json, which lists the systems.
"""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..base.content import read_utf8
from ..base.digest import hex_digest
from ..base.errors import InputError, format_count
from ..files.tables import read_rows, write_report

TRAINING = "training"
"""System of the clips that come first and do not count."""
MAX_CLIPS = 500
_LETTERS = "bcdfghjkmnpqrstvwxyz23456789"  # no vowels, so no words; no characters that look alike
_NAME_LENGTH = 4  # letters of a clip's name
_MAX_TRIES = 200  # random orders to try until one differs from all others
STUDY_FILE = "study.json"
VERSION = 1
COLUMNS = ("file", "system", "scenario")
_MAX_BYTES = 20_000_000
_NAME = re.compile(r"[A-Za-z0-9_-]{1,40}")  # of clips and raters, used as file names


@dataclass(frozen=True)
class Clip:
    """One clip of a study.

    Attributes:
        file: a movie or a motion, under its original name.
        system: the system that produced it, or TRAINING.
        scenario: what it shows, the same for all systems.
        name: the neutral name.
    """

    file: str
    system: str
    scenario: str
    name: str = ""


@dataclass(frozen=True, kw_only=True)
class Study:
    """A study.

    Attributes:
        id: eight letters that its answers carry.
        seed: seed of the names and orders.
        pairs: whether raters compare two clips of one scenario instead of rating each.
        clips: the clips, in the order of the table.
        orders: rater -> pages in their order: names of clips, two each in a study of pairs; the training clips come
            first.
    """

    id: str
    seed: int
    pairs: bool
    clips: tuple[Clip, ...]
    orders: dict[str, tuple[tuple[str, ...], ...]]

    @property
    def systems(self) -> tuple[str, ...]:
        """The compared systems, in the order of the table."""
        return tuple(dict.fromkeys(clip.system for clip in self.clips if clip.system != TRAINING))

    @property
    def scenarios(self) -> tuple[str, ...]:
        """The scenarios that count, in the order of the table."""
        return tuple(dict.fromkeys(clip.scenario for clip in self.clips if clip.system != TRAINING))

    @property
    def training(self) -> tuple[str, ...]:
        """Names of the two clips that do not count."""
        return tuple(clip.name for clip in self.clips if clip.system == TRAINING)

    def is_counted(self, shown: Sequence[str]) -> bool:
        """Return whether a page counts.

        Args:
            shown: the names of its clips.
        """
        return not set(shown) & set(self.training)


def build_study(clips: Sequence[Clip], raters: int, seed: int = 0, pairs: bool = False) -> Study:
    """Build the study of some clips.

    It is the same for the same clips and seed, and the first raters' orders do not depend on the number of raters.

    Args:
        clips: the clips, without neutral names.
        raters: number of raters.
        seed: seed of the names and orders.
        pairs: whether raters compare two clips of one scenario.
    Returns:
        The study.
    Raises:
        InputError: unless there are exactly two training clips, at least two systems, each with the same scenarios,
            each clip once, and enough clips for so many different orders.
    """
    _check_clips(clips)
    named_clips = _name_clips(clips, seed)
    study_id = hex_digest(repr((seed, pairs, [(c.file, c.system, c.scenario) for c in named_clips])), digits=8)
    used: set[tuple] = set()
    orders = {}
    for number in range(raters):
        for attempt in range(_MAX_TRIES):
            order = _build_order(named_clips, np.random.default_rng([seed, number, attempt]), pairs)
            if order not in used:
                break
        else:
            raise InputError("raters", str(raters), "at most one per order", "add clips or reduce the raters")
        used.add(order)
        orders[f"R{number + 1:02d}"] = order
    return Study(id=study_id, seed=seed, pairs=pairs, clips=named_clips, orders=orders)


def read_clips(path: Path) -> tuple[Clip, ...]:
    """Read the clips of a table with the columns file, system and scenario.

    Args:
        path: the table.
    Returns:
        The clips, without neutral names.
    Raises:
        InputError: with the line, if a row lacks a value.
    """
    clips = []
    for place, row in read_rows(path, COLUMNS, separators=",;\t"):
        for column in COLUMNS[:2]:
            if not row[column]:
                raise InputError(place, f"no {column}", f"{','.join(COLUMNS)} in each row", "complete the row")
        clips.append(Clip(row["file"], row["system"], row["scenario"]))
    return tuple(clips)


def write_study(folder: Path, study: Study) -> None:
    """Write study.json into a folder.

    Args:
        folder: the folder.
        study: the study.
    """
    write_report(folder / STUDY_FILE, {
        "version": VERSION, "study": study.id, "seed": study.seed, "pairs": study.pairs,
        "clips": [{"name": c.name, "file": c.file, "system": c.system, "scenario": c.scenario} for c in study.clips],
        "orders": study.orders,
    })  # fmt: skip


def read_study(folder: Path) -> Study:
    """Read the study of a folder.

    Args:
        folder: the folder with study.json.
    Returns:
        The study.
    Raises:
        InputError: if study.json is missing or invalid.
    """
    path = Path(folder) / STUDY_FILE
    text = read_utf8(path, "a study.json, as 'beyond-mocap study order' writes it", _MAX_BYTES)
    try:
        data = json.loads(text)
        json.dumps(data, ensure_ascii=False).encode("utf-8")  # lone surrogates can be read but not written
        clips = tuple(Clip(*(str(row[key]) for key in ("file", "system", "scenario", "name"))) for row in data["clips"])
        names = {clip.name for clip in clips}
        orders = {str(rater): tuple(_parse_page(row, names) for row in rows) for rater, rows in data["orders"].items()}
        if data["version"] != VERSION or not isinstance(data["pairs"], bool) or len(names) != len(clips):
            raise ValueError("another version")
        if invalid := next((name for name in (*names, *orders) if not _NAME.fullmatch(name)), None):
            raise ValueError(f"{invalid!r} is not a valid name")
        return Study(id=str(data["study"]), seed=int(data["seed"]), pairs=data["pairs"], clips=clips, orders=orders)
    except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError) as error:
        found = f"not a study ({error})" if type(error) is ValueError else "not a study"  # others are Python's words
        raise InputError(path, found, "a file written by 'study order'", "create the study again") from None


def _build_order(clips: Sequence[Clip], rng: np.random.Generator, pairs: bool) -> tuple[tuple[str, ...], ...]:
    """Build one rater's random order."""
    first = [clip.name for clip in clips if clip.system == TRAINING]
    first = [first[place] for place in rng.permutation(len(first))]
    real = [clip for clip in clips if clip.system != TRAINING]
    if not pairs:
        return tuple((name,) for name in (*first, *(real[place].name for place in rng.permutation(len(real)))))
    couples = [couple for couple in itertools.combinations(real, 2) if couple[0].scenario == couple[1].scenario]
    shown = [couples[place][:: 1 if rng.random() < 0.5 else -1] for place in rng.permutation(len(couples))]
    return (tuple(first), *((left.name, right.name) for left, right in shown))


def _name_clips(clips: Sequence[Clip], seed: int) -> tuple[Clip, ...]:
    """Give the clips neutral names, which depend only on the seed and the number of clips."""
    rng, names = np.random.default_rng([seed, len(clips)]), {}
    while len(names) < len(clips):
        names["".join(_LETTERS[letter] for letter in rng.integers(0, len(_LETTERS), _NAME_LENGTH))] = None
    return tuple(Clip(clip.file, clip.system, clip.scenario, name) for clip, name in zip(clips, names))


def _check_clips(clips: Sequence[Clip]) -> None:
    """Check the clips of a study, see `build_study`."""
    if len(clips) > MAX_CLIPS:
        raise InputError("clips", str(len(clips)), f"{MAX_CLIPS} at most", "remove some")
    training = [clip for clip in clips if clip.system == TRAINING]
    if len(training) != 2:
        found = f"{format_count(len(training), 'clip')} of the system {TRAINING!r}"
        raise InputError("clips", found, "two, a good and a bad one", "add or remove rows")
    real = [clip for clip in clips if clip.system != TRAINING]
    systems = list(dict.fromkeys(clip.system for clip in real))
    if len(systems) < 2:
        found = format_count(len(systems), "system")
        raise InputError("clips", found, "two or more to compare", "add clips of another system")
    pairs = [(clip.system, clip.scenario) for clip in real]
    for system, scenario in itertools.product(systems, dict.fromkeys(clip.scenario for clip in real)):
        if (count := pairs.count((system, scenario))) != 1:
            found = f"{format_count(count, 'clip')} of scenario {scenario!r} by {system!r}"
            raise InputError("clips", found, "one of each scenario by each system", "add or remove rows")
    files = [clip.file for clip in clips]
    if repeated := next((file for file in files if files.count(file) > 1), None):
        raise InputError("clips", f"{repeated} is listed twice", "each file once", "remove one of them")


def _parse_page(row, names: set[str]) -> tuple[str, ...]:
    """Check one page of an order: one or two known names."""
    shown = tuple(map(str, row))
    if isinstance(row, (str, Mapping)) or not 1 <= len(shown) <= 2 or not set(shown) <= names:
        raise ValueError(f"{row!r} in an order")
    return shown
