"""Records of throws and kicks: annotations, `throws.csv`, and reports of the command `release`."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..annotation import ClipAnnotation
from ..annotation.labels import list_labels
from ..ball.physics import BASEBALL, FOOTBALL, Ball
from ..base.content import read_bytes
from ..base.errors import InputError
from ..files.tables import parse_number, read_rows
from ..library.folder.annotations import Annotations
from .networks.chains import EFFECTORS as LIMBS

TABLE_NAME = "throws.csv"
TARGET = ("target_x_m", "target_y_m", "target_z_m")
LAUNCH = ("launch_x_m_s", "launch_y_m_s", "launch_z_m_s")
_SAME_MOMENT_SECONDS = 0.5  # s; closer key moments belong to one throw
_MAX_SPEED = 100.0  # m/s, upper limit of a ball from a hand or foot


@dataclass(frozen=True, kw_only=True)
class Action:
    """An action to look for.

    Attributes:
        labels: labels, any of which marks the action.
        limbs: indices of LIMBS.
        before: shortest and longest time, s, to include before the release.
        after: shortest and longest time, s, to include after the release.
        wall: m ahead at which an unknown target is assumed.
        ball: kind of ball.
    """

    labels: frozenset[str]
    limbs: tuple[int, int]
    before: tuple[float, float]
    after: tuple[float, float]
    wall: float
    ball: Ball


ACTIONS = {
    "throw": Action(labels=frozenset(list_labels(action="throw")), limbs=(0, 1), before=(1.6, 3.0), after=(1.2, 2.0),
                    wall=4.0, ball=BASEBALL),
    "kick": Action(labels=frozenset(list_labels(action="kick")), limbs=(2, 3), before=(1.2, 3.0), after=(0.8, 2.0),
                   wall=11.0, ball=FOOTBALL),
}
"""Actions by name. The walls: Fredriksson's was about 4 m away (section 8.2); a penalty is shot from 11 m."""


@dataclass(frozen=True, eq=False, kw_only=True)
class KnownThrow:
    """What is recorded about one throw; None is unknown.

    Attributes:
        stretch: first and last second.
        release: s at which the ball leaves.
        limb: index of LIMBS.
        target: (3,) m that the ball flies through.
        launch: (3,) m/s, velocity at the release.
        speed: m/s at the release.
        subject: name of the performer.
    """

    stretch: tuple[float, float] | None = None
    release: float | None = None
    limb: int | None = None
    target: np.ndarray | None = None
    launch: np.ndarray | None = None
    speed: float | None = None
    subject: str | None = None


def is_known(path: Path, action: Action, words: Annotations, rows: list[KnownThrow] | None) -> bool:
    """Return whether an annotation, a table row or a report says that a recording has such an action."""
    return bool(rows) or any(_iter_annotated(words, path, 120.0, action)) or _build_report_path(path).is_file()


def read_known(
    path: Path, fps: float, action: Action, words: Annotations, rows: list[KnownThrow] | None
) -> list[KnownThrow]:
    """Read what is recorded of each throw in a recording.

    The table has priority over the report beside it, and that over its annotations.
    """
    annotated = list(_iter_annotated(words, path, fps, action))
    measured = _read_report(_build_report_path(path), action)
    if not rows:
        return [_fill_unknown(measured, _find_nearest(annotated, measured.release))] if measured else annotated
    return [_fill_unknown(_fill_unknown(row, measured), _find_nearest(annotated, row.release)) for row in rows]


def _find_nearest(annotated: list[KnownThrow], release: float | None) -> KnownThrow | None:
    """Find the annotation of a release, the first one if its time is unknown."""
    if release is None:
        return annotated[0] if annotated else None
    close = [known for known in annotated if abs(known.release - release) < _SAME_MOMENT_SECONDS]
    return min(close, key=lambda known: abs(known.release - release), default=None)


def _fill_unknown(known: KnownThrow, other: KnownThrow | None) -> KnownThrow:
    """Fill the unknown values of `known` with those of `other`."""
    if other is None:
        return known
    unknown = {name: getattr(other, name) for name, value in vars(known).items() if value is None}
    return replace(known, **unknown)


def _iter_annotated(words: Annotations, path: Path, fps: float, action: Action) -> Iterator[KnownThrow]:
    """Iterate over the throws of the annotations, each key moment once, in the order of time."""
    last = -np.inf
    rows: list[ClipAnnotation] = [row for row in words.read_rows(path, fps) if action.labels & set(row.words)]
    for row in sorted((row for row in rows if row.key is not None), key=lambda row: row.key):
        release = row.key / fps
        if release - last < _SAME_MOMENT_SECONDS:
            continue
        last = release
        sides = [side for side, word in enumerate(("left", "right")) if word in row.words]
        yield KnownThrow(stretch=(row.start / fps, row.end / fps), release=release,
                         limb=action.limbs[sides[0]] if len(sides) == 1 else None)


def read_table(folder: Path, action: Action, names: set[str]) -> dict[str, list[KnownThrow]]:
    """Read the rows of `throws.csv` in a folder by file; rows of other limbs than the action's are left out.

    Args:
        folder: the folder; an empty result if it has no table.
        action: the action.
        names: names of the recordings that rows may refer to.
    """
    path, out = folder / TABLE_NAME, {}
    if not path.is_file():
        return out
    for where, row in read_rows(path, ("file",)):
        known = _parse_row(row, where)
        file = Path(row["file"]).as_posix()
        if file not in names:
            raise InputError(where, f"no file {row['file'][:80]!r}", "a BVH file below this table, relative to it")
        if known.limb is None or known.limb in action.limbs:
            out.setdefault(file, []).append(known)
    return out


def _parse_row(row: dict[str, str], where: str) -> KnownThrow:
    """Parse one row of the table."""
    def parse_value(name: str) -> float | None:
        return parse_number(row[name], name, where) if (row.get(name) or "").strip() else None

    def parse_vector(names: tuple[str, ...]) -> np.ndarray | None:
        values = [parse_value(name) for name in names]
        if any(v is None for v in values) and any(v is not None for v in values):
            raise InputError(where, f"only some of {', '.join(names)}", "all three or none")
        return None if values[0] is None else np.array(values)

    limb = (row.get("limb") or "").strip().lower()
    if limb and limb not in LIMBS:
        raise InputError(where, f"limb {limb!r}"[:80], f"one of {', '.join(LIMBS)}")
    launch, speed = parse_vector(LAUNCH), parse_value("speed_m_s")
    for name, fast in (("speed_m_s", speed), ("launch", None if launch is None else float(np.linalg.norm(launch)))):
        if fast is not None and not 0.0 < fast <= _MAX_SPEED:
            expected = f"more than 0, at most {_MAX_SPEED:g} m/s"
            raise InputError(where, f"{name} {fast:g} m/s", expected, "correct the cell or leave it empty")
    return KnownThrow(release=parse_value("release_s"), limb=LIMBS.index(limb) if limb else None,
                      target=parse_vector(TARGET), launch=launch, speed=speed,
                      subject=(row.get("subject") or "").strip() or None)


def _build_report_path(path: Path) -> Path:
    return path.with_suffix(".release.json")


def _read_report(path: Path, action: Action) -> KnownThrow | None:
    """Read the report of `release` about a throw; None if there is none."""
    if not path.is_file() or action.ball is not BASEBALL:
        return None
    try:
        report = json.loads(read_bytes(path, "a report of 'release'").decode("utf-8"))
        speed = float(report["speed_m_s"])
        launch = speed * np.asarray(report["direction"], float)
        limb = LIMBS.index(f"{report['hand']}_hand")
        release = float(report["release_time_s"])
        impact = report.get("impact_m")
        impact = np.array(impact, float) if isinstance(impact, list) and len(impact) == 3 else None
        known = [*launch, release] if impact is None else [*launch, release, *impact]
        if not (launch.shape == (3,) and np.isfinite(known).all() and np.linalg.norm(launch) <= _MAX_SPEED):
            raise ValueError
    except (ValueError, KeyError, TypeError, UnicodeDecodeError, RecursionError):
        raise InputError(path, "not a release report", "a report written by the command 'release'") from None
    return KnownThrow(release=release, limb=limb, target=impact, launch=launch, speed=speed)
