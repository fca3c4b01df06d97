"""The results of a folder of reconstructed trials, one row for each trial, read from the written reports.

Also: where the throws land, and how fast they are compared with a radar gun.
"""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from ..base.errors import InputError
from ..base.vectors import unit_vector, unit_vectors
from ..evaluation.report import check_depth

OUTLIER_DEVIATIONS = 3.0  # standard deviations from the mean, beyond which a throw is left out (Fredriksson §8.2)

MIN_PAIRS = 6  # pairs; with fewer, Wilcoxon's test cannot reject anything at 0.05 (two-sided: 2 / 2^n)


@dataclass(frozen=True, eq=False, kw_only=True)
class Throw:
    """The release of a throw, as the report has it.

    Attributes:
        speed: m/s.
        radar: m/s of a radar gun; None where the file name has none.
        side: "left" or "right", the throwing hand.
        hips: (2,) metres, level, at the start.
        impact: (2,) metres, level, on the ground; None where the ball never came down.
        velocity: (3,) m/s.
        method: "ball" or "hand", what the release was estimated from.
    """

    speed: float
    radar: float | None
    side: str
    hips: np.ndarray
    impact: np.ndarray | None
    velocity: np.ndarray
    method: str


@dataclass(frozen=True, eq=False, kw_only=True)
class TrialResult:
    """The result of one trial.

    Attributes:
        name: of the trial.
        subject: as the file says, else its session; "" where unknown.
        frames: number of frames.
        squares: (mean, standard deviation) of the weighted squared residuals per frame, square metres (eq. 5.1).
        residual: mm, root mean square distance of the model's markers.
        single: mm, the same with every segment fitted alone.
        rate: frames solved per second.
        throw: the release, or None.
        error: why there is no motion; "" where there is one.
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
    """Read the results of a folder, sorted by name.

    Args:
        folder: with a trials.json, else with *.report.json files in it or below.
    Returns:
        One result for each trial.
    Raises:
        InputError: if there are none, or a report cannot be read.
    """
    table = folder / "trials.json"
    if table.is_file():
        rows = _read_json(table).get("trials", ())
        return tuple(_parse_row(folder, row) for row in rows)
    reports = sorted(folder.rglob("*.report.json"))
    if not reports:
        raise InputError(folder, "no reports of trials", "the output of a reconstructed folder", "check the folder")
    return tuple(_parse_report(path.name.removesuffix(".report.json"), _read_json(path)) for path in reports)


def _parse_row(folder: Path, row: Mapping) -> TrialResult:
    """Build a result from a row of trials.json and the report that it names."""
    name = str(row.get("trial", ""))
    if row.get("error") or not row.get("report"):
        return TrialResult(name=name, subject=str(row.get("subject") or ""), error=str(row.get("error") or "no motion"))
    found = _parse_report(name, _read_json(folder / row["report"]))
    return found if found.subject else replace(found, subject=str(row.get("session") or ""))


def _parse_report(name: str, report: Mapping) -> TrialResult:
    """Build a result from the report of one trial."""
    residual, squares = report.get("residual_mm") or {}, report.get("weighted_se") or {}
    return TrialResult(name=name, subject=str(report.get("subject") or ""), frames=int(report.get("frames") or 0),
                       squares=(_to_float(squares.get("mean")), _to_float(squares.get("sd"))),
                       residual=_to_float(residual.get("rms", residual.get("mean"))),
                       single=_to_float(residual.get("single_rms", residual.get("single_mean"))),
                       rate=_to_float(report.get("frames_per_second")),
                       throw=_parse_throw(report.get("release")))  # fmt: skip


def _parse_throw(release: Mapping | None) -> Throw | None:
    """Build a throw from the release of a report; None where there is none."""
    if not release or release.get("speed_m_s") is None:
        return None
    impact = release.get("impact_m")
    speed = float(release["speed_m_s"])
    return Throw(speed=speed, radar=release.get("radar_speed_m_s"), side=str(release.get("hand", "")),
                 hips=np.array(release.get("hips_m", (0.0, 0.0, 0.0))[:2], float),
                 impact=None if impact is None else np.array(impact[:2], float),
                 velocity=speed * np.array(release.get("direction", (1.0, 0.0, 0.0)), float),
                 method=str(release.get("how", "")))


def _to_float(value) -> float:
    return float("nan") if value is None else float(value)


def _read_json(path: Path) -> Mapping:
    """Read a JSON object; raise InputError where it cannot be read."""
    try:
        content = json.loads(path.read_text("utf-8"))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(path, f"cannot be read: {error}", "a report in JSON", "reconstruct the folder again") from None
    if not isinstance(content, Mapping):
        raise InputError(path, "contains no object", "a report in JSON", "reconstruct the folder again")
    check_depth(content, path)
    return content


def find_dominant_sides(results: Sequence[TrialResult]) -> dict[str, str]:
    """Find the hand with which each subject throws more often.

    Returns:
        Subject -> "left" or "right"; ties go to the right.
    """
    sides: dict[str, list[str]] = {}
    for result in results:
        if result.throw is not None:
            sides.setdefault(result.subject, []).append(result.throw.side)
    return {subject: "left" if thrown.count("left") > thrown.count("right") else "right"
            for subject, thrown in sides.items()}


def align_impacts(results: Sequence[TrialResult]) -> np.ndarray:
    """Place the impacts of all throws in a common frame, as in figure 8.2.

    The origin is at the hips in the trial's first frame. The y axis is the direction of a subject's throws (the mean of
    their level directions, since the target is unknown), the x axis points to the right of it.

    Args:
        results: N results.
    Returns:
        (N, 2) metres, where each throw meets the ground; NaN where it does not.
    Source: Fredriksson section 8.2.
    """
    out = np.full((len(results), 2), np.nan)
    for subject in {result.subject for result in results}:
        rows = [i for i, result in enumerate(results)
                if result.subject == subject and result.throw is not None and result.throw.impact is not None]
        if not rows:
            continue
        directions = np.array([results[i].throw.velocity[:2] for i in rows])
        mean = np.sum(unit_vectors(directions), axis=0)
        along = unit_vector(mean)
        across = np.array([along[1], -along[0]])
        for i in rows:
            offset = results[i].throw.impact - results[i].throw.hips
            out[i] = offset @ across, offset @ along
    return out


def select_near_mean(points: np.ndarray) -> np.ndarray:
    """Select the points within three standard deviations of their mean on both axes.

    Args:
        points: (N, 2) metres.
    Returns:
        (N,) bool; False for NaN.
    """
    known = np.isfinite(points).all(axis=-1)
    if np.count_nonzero(known) < 3:
        return known
    mean, spread = points[known].mean(axis=0), points[known].std(axis=0)
    return known & (np.abs(points - mean) <= OUTLIER_DEVIATIONS * np.maximum(spread, 1e-9) + 1e-9).all(axis=-1)


@dataclass(frozen=True, kw_only=True)
class SpeedComparison:
    """A comparison of estimated with measured speeds. Tests are NaN where there are too few pairs.

    Attributes:
        count: number of pairs.
        mean: m/s, mean of estimated - measured.
        sd: m/s, their standard deviation.
        share: mean absolute difference as a share of the measured speed.
        within: share of pairs that differ by at most 10 %.
        wilcoxon: two-sided p-value that the differences are centred on zero.
        normal: p-value of the Shapiro-Wilk test that they are normal.
    """

    count: int
    mean: float
    sd: float
    share: float
    within: float
    wilcoxon: float
    normal: float


def compare_speeds(estimated: np.ndarray, measured: np.ndarray) -> SpeedComparison:
    """Compare paired speeds; pairs with NaN are left out.

    Args:
        estimated: (N,) m/s.
        measured: (N,) m/s.
    Returns:
        The statistics of the differences.
    """
    from scipy.stats import shapiro, wilcoxon

    estimated, measured = np.asarray(estimated, float), np.asarray(measured, float)
    known = np.isfinite(estimated) & np.isfinite(measured)
    difference, base = (estimated - measured)[known], measured[known]
    if not len(difference):
        nan = float("nan")
        return SpeedComparison(count=0, mean=nan, sd=nan, share=nan, within=nan, wilcoxon=nan, normal=nan)
    varies = len(difference) > 1 and np.ptp(difference) > 1e-12
    share = np.abs(difference) / base
    return SpeedComparison(count=len(difference), mean=float(difference.mean()), sd=float(difference.std(ddof=1))
                           if len(difference) > 1 else np.nan, share=float(share.mean()),
                           within=float(np.mean(share <= 0.1)), wilcoxon=float(wilcoxon(difference).pvalue)
                           if len(difference) >= MIN_PAIRS and np.any(difference != 0.0) else np.nan,
                           normal=float(shapiro(difference).pvalue) if len(difference) >= 3 and varies
                           else np.nan)  # fmt: skip
