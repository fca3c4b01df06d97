"""What a folder of reconstructed trials holds: one row a trial, read from the reports that were written."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ...base.errors import InputError
from ...evaluation.report import check_depth


@dataclass(frozen=True, eq=False, kw_only=True)
class Throw:
    """A release. speed, radar: m/s, radar None where the file's name had none. side: of the hand. hips: (2,) m at the
    start, impact: (2,) m on the ground, None where the ball never came down. velocity: (3,) m/s. how: "ball" or "hand".
    """

    speed: float
    radar: float | None
    side: str
    hips: np.ndarray
    impact: np.ndarray | None
    velocity: np.ndarray
    how: str


@dataclass(frozen=True, eq=False, kw_only=True)
class TrialResult:
    """One trial. subject: as the file says, else its session, "" where unknown. frames: how many. squares: m^2,
    weighted squared residuals a frame (mean and standard deviation; eq. 5.1). residual, single: mm, root mean square of
    the model's markers and of single segments. rate: frames a second of the pose. throw: its release, or None. error:
    why there is no motion, "" where there is.
    """

    name: str
    subject: str
    frames: int = 0
    squares: tuple[float, float] = (np.nan, np.nan)
    residual: float = np.nan
    single: float = np.nan
    rate: float = np.nan
    throw: Throw | None = None
    error: str = ""


def read_results(folder: Path) -> tuple[TrialResult, ...]:
    """The trials of a folder by name: of its trials.json, else of all *.report.json below it. InputError where there
    are none, or a report cannot be read."""
    table = folder / "trials.json"
    if table.is_file():
        rows = _read(table).get("trials", ())
        return tuple(_of_row(folder, row) for row in rows)
    reports = sorted(folder.rglob("*.report.json"))
    if not reports:
        raise InputError(folder, "no reports of trials", "what 'reconstruct FOLDER --out' wrote", "check the folder")
    return tuple(_of_report(path.name.removesuffix(".report.json"), _read(path)) for path in reports)


def _of_row(folder: Path, row: Mapping) -> TrialResult:
    name = str(row.get("trial", ""))
    if row.get("error") or not row.get("report"):
        return TrialResult(name=name, subject=str(row.get("subject") or ""), error=str(row.get("error") or "no motion"))
    found = _of_report(name, _read(folder / row["report"]))
    return found if found.subject else replace(found, subject=str(row.get("session") or ""))


def _of_report(name: str, report: Mapping) -> TrialResult:
    residual, squares = report.get("residual_mm") or {}, report.get("weighted_se") or {}
    return TrialResult(name=name, subject=str(report.get("subject") or ""), frames=int(report.get("frames") or 0),
                       squares=(_number(squares.get("mean")), _number(squares.get("sd"))),
                       residual=_number(residual.get("rms", residual.get("mean"))),
                       single=_number(residual.get("single_rms", residual.get("single_mean"))),
                       rate=_number(report.get("frames_per_second")), throw=_throw(report.get("release")))  # fmt: skip


def _throw(release: Mapping | None) -> Throw | None:
    if not release or release.get("speed_m_s") is None:
        return None
    impact = release.get("impact_m")
    speed = float(release["speed_m_s"])
    return Throw(
        speed=speed, radar=release.get("radar_speed_m_s"), side=str(release.get("hand", "")),
        hips=np.array(release.get("hips_m", (0.0, 0.0, 0.0))[:2], float),
        impact=None if impact is None else np.array(impact[:2], float),
        velocity=speed * np.array(release.get("direction", (1.0, 0.0, 0.0)), float), how=str(release.get("how", "")),
    )  # fmt: skip


def _number(value) -> float:
    return float("nan") if value is None else float(value)


def _read(path: Path) -> Mapping:
    try:
        found = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(path, f"cannot be read: {error}", "a report in JSON", "reconstruct the folder again") from None
    if not isinstance(found, Mapping):
        raise InputError(path, "holds no object", "a report in JSON", "reconstruct the folder again")
    check_depth(found, path)
    return found
