"""A study: clips under neutral names, in which order each rater sees them (Faustino §5.1.1), and both as a file.

No rater can tell from a name which system made a clip; all see other orders, systems and scenarios mixed; two clips to
get used to the task come first and do not count. Raters must not see study.json, which says who made what.
"""

from __future__ import annotations

import itertools
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from ..base.digest import hex_digest
from ..base.errors import InputError
from ..files.content import utf8
from ..files.tables import read_rows, write_report

TRAINING = "training"
"""In place of a system: this clip comes first and does not count."""
MOST_CLIPS = 500
_LETTERS = "bcdfghjkmnpqrstvwxyz23456789"  # no vowels, no words; nothing that looks like something else
_LONG = 4  # letters of a clip's name
_TRIES = 200  # random orders tried until one is new
STUDY_FILE = "study.json"
VERSION = 1
COLUMNS = ("file", "system", "scenario")
_LARGEST = 20_000_000
_NAME = re.compile(r"[A-Za-z0-9_-]{1,40}")  # of clips and raters: files are called so


@dataclass(frozen=True)
class Clip:
    """One clip of a study. file: a movie or a motion, as its maker named it. system: who made it, or TRAINING.
    scenario: what it shows, the same for all systems. name: the neutral one."""

    file: str
    system: str
    scenario: str
    name: str = ""


@dataclass(frozen=True, kw_only=True)
class Study:
    """A study. id: eight letters that its answers carry. systems, scenarios: in the order of the table. pairs: whether
    two clips of one scenario are compared instead of each being rated. orders: rater -> what he sees, one after the
    other: names of clips, in a study of pairs two each; the training clips come first."""

    id: str
    seed: int
    pairs: bool
    clips: tuple[Clip, ...]
    orders: dict[str, tuple[tuple[str, ...], ...]]

    @property
    def systems(self) -> tuple[str, ...]:
        """Systems that are compared."""
        return tuple(dict.fromkeys(clip.system for clip in self.clips if clip.system != TRAINING))

    @property
    def scenarios(self) -> tuple[str, ...]:
        """Scenarios that count."""
        return tuple(dict.fromkeys(clip.scenario for clip in self.clips if clip.system != TRAINING))

    @property
    def training(self) -> tuple[str, ...]:
        """Names of the two clips that do not count."""
        return tuple(clip.name for clip in self.clips if clip.system == TRAINING)

    def counts(self, shown: Sequence[str]) -> bool:
        """Whether what is shown together counts."""
        return not set(shown) & set(self.training)


def ordered(clips: Sequence[Clip], raters: int, seed: int = 0, pairs: bool = False) -> Study:
    """The study of these clips for so many raters; the same for the same clips and seed, and the first raters' orders
    do not change with how many there are.

    InputError where there are not exactly two training clips, fewer than two systems, a system without a scenario that
    another has, a clip twice, or too few clips for so many different orders."""
    _check(clips)
    named = _named(clips, seed)
    mark = hex_digest(repr((seed, pairs, [(c.file, c.system, c.scenario) for c in named])), digits=8)
    taken: set[tuple] = set()
    orders = {}
    for number in range(raters):
        for attempt in range(_TRIES):
            order = _order(named, np.random.default_rng([seed, number, attempt]), pairs)
            if order not in taken:
                break
        else:
            raise InputError("raters", str(raters), "no more than there are orders", "add clips or ask fewer raters")
        taken.add(order)
        orders[f"R{number + 1:02d}"] = order
    return Study(id=mark, seed=seed, pairs=pairs, clips=named, orders=orders)


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
    write_report(folder / STUDY_FILE, {
        "version": VERSION, "study": study.id, "seed": study.seed, "pairs": study.pairs,
        "clips": [{"name": c.name, "file": c.file, "system": c.system, "scenario": c.scenario} for c in study.clips],
        "orders": study.orders,
    })  # fmt: skip


def read_study(folder: Path) -> Study:
    """The study of a folder; InputError where its study.json is missing or is not of that form."""
    path = Path(folder) / STUDY_FILE
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


def _order(clips: Sequence[Clip], rng: np.random.Generator, pairs: bool) -> tuple[tuple[str, ...], ...]:
    """One rater's order."""
    first = [clip.name for clip in clips if clip.system == TRAINING]
    first = [first[place] for place in rng.permutation(len(first))]
    real = [clip for clip in clips if clip.system != TRAINING]
    if not pairs:
        return tuple((name,) for name in (*first, *(real[place].name for place in rng.permutation(len(real)))))
    couples = [couple for couple in itertools.combinations(real, 2) if couple[0].scenario == couple[1].scenario]
    shown = [couples[place][:: 1 if rng.random() < 0.5 else -1] for place in rng.permutation(len(couples))]
    return (tuple(first), *((left.name, right.name) for left, right in shown))


def _named(clips: Sequence[Clip], seed: int) -> tuple[Clip, ...]:
    """The clips with neutral names, which depend on the seed and on how many there are only."""
    rng, names = np.random.default_rng([seed, len(clips)]), {}
    while len(names) < len(clips):
        names["".join(_LETTERS[letter] for letter in rng.integers(0, len(_LETTERS), _LONG))] = None
    return tuple(Clip(clip.file, clip.system, clip.scenario, name) for clip, name in zip(clips, names))


def _check(clips: Sequence[Clip]) -> None:
    if len(clips) > MOST_CLIPS:
        raise InputError("clips", str(len(clips)), f"{MOST_CLIPS} at most", "leave some out")
    training = [clip for clip in clips if clip.system == TRAINING]
    if len(training) != 2:
        found = f"{len(training)} clips of the system {TRAINING!r}"
        raise InputError("clips", found, "two, a good and a bad one", "add or remove rows")
    real = [clip for clip in clips if clip.system != TRAINING]
    systems = list(dict.fromkeys(clip.system for clip in real))
    if len(systems) < 2:
        raise InputError("clips", f"{len(systems)} systems", "two or more to compare", "add another one's clips")
    have = [(clip.system, clip.scenario) for clip in real]
    for system, scenario in itertools.product(systems, dict.fromkeys(clip.scenario for clip in real)):
        if (count := have.count((system, scenario))) != 1:
            found = f"{count} clips of scenario {scenario!r} by {system!r}"
            raise InputError("clips", found, "one of each scenario by each system", "add or remove rows")
    files = [clip.file for clip in clips]
    if twice := next((file for file in files if files.count(file) > 1), None):
        raise InputError("clips", f"{twice} twice", "a file for each row", "remove one of them")


def _shown(row, names: set[str]) -> tuple[str, ...]:
    """One entry of an order: one or two names that there are."""
    shown = tuple(map(str, row))
    if isinstance(row, (str, Mapping)) or not 1 <= len(shown) <= 2 or not set(shown) <= names:
        raise ValueError(f"{row!r} in an order")
    return shown
