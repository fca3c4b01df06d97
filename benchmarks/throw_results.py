"""What the experiments with throws found, kept beside them so that another machine goes on where this one stopped:
figures alone, one line a run, in benchmarks/throw_results/SCALE_DATA.jsonl.

A line has what its run was asked for as a `stamp`: a run that would be asked for something else now is done anew.
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping
from pathlib import Path

from beyond_mocap.files.whole import atomic_write

Key = tuple[str, str, str]
"""data, variant, subject."""
LIMBS = ("deviation", "network", "body")
SINGLES = ("impact", "head", "head_share", "jerk", "beyond", "seconds")
"""Figures of a motion: four of each limb name (m, by effector), then single ones, as `throw evaluate` has them."""
DIGITS = 4


def read(folder: Path, scale: str) -> dict[Key, dict]:
    """All runs of one scale; a line that cannot be read is none."""
    found = {}
    for path in sorted(folder.glob(f"{scale}_*.jsonl")):
        data = path.stem.removeprefix(f"{scale}_")
        for line in path.read_text("utf-8").splitlines():
            try:
                run = json.loads(line)
                found[data, run["variant"], run["subject"]] = {**run, "each": _motions(run["each"])}
            except (ValueError, KeyError, TypeError):
                continue
    return found


def keep(folder: Path, scale: str, key: Key, run: Mapping) -> None:
    """Adds one run, which counts in place of what it was before; several processes may do so."""
    data, variant, subject = key
    folder.mkdir(parents=True, exist_ok=True)
    with open(folder / f"{scale}_{data}.jsonl", "a+b") as out:
        torn = out.tell() and not _ends_a_line(out)
        out.write((b"\n" if torn else b"") + _line({"variant": variant, "subject": subject, **run}).encode())


def _ends_a_line(file) -> bool:
    file.seek(-1, os.SEEK_END)
    return file.read(1) == b"\n"


def tidy(folder: Path, scale: str) -> None:
    """Leaves out what has been done anew since, and sorts the rest."""
    found = read(folder, scale)
    for data in {key[0] for key in found}:
        lines = [_line(found[key]) for key in sorted(found) if key[0] == data]
        atomic_write(folder / f"{scale}_{data}.jsonl", "".join(lines))


def _line(run: Mapping) -> str:
    return json.dumps({**run, "each": _rows(run["each"])}, separators=(",", ":")) + "\n"


def _rows(each) -> dict[str, list]:
    """Motions by the subject that was tested, each a row of numbers."""
    rows: dict[str, list] = {}
    for one in each:
        flat = [value for name in LIMBS for value in one[name]] + [one[name] for name in SINGLES]
        rows.setdefault(one["subject"], []).append(
            [None if value is None else float(f"{value:.{DIGITS}g}") for value in flat]
        )
    return rows


def _motions(rows: Mapping[str, list]) -> list[dict]:
    """The other way round."""
    return [
        {"subject": subject, **{name: row[4 * k : 4 * k + 4] for k, name in enumerate(LIMBS)},
         **dict(zip(SINGLES, row[4 * len(LIMBS) :], strict=True))}
        for subject, motions in rows.items() for row in motions
    ]  # fmt: skip
