"""Which targets `path` misses, and where in the takes: at key moments, in made running, beyond the recordings'
speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from beyond_mocap.evaluation import feet, figures, jerk, pieces, realism, root, words
from beyond_mocap.evaluation.feet import contact_speeds, stance_travel, stances
from beyond_mocap.evaluation.judged import Row, judged
from beyond_mocap.evaluation.targets import TARGETS
from beyond_mocap.evaluation.view import View
from beyond_mocap.library.made import MADE_FOLDER

from . import markdown

KINDS = ("key moments", "made running", "beyond the recordings", "below 1 m/s", "elsewhere")
"""What a frame is counted as, the first that holds: within a key moment's entry and exit or 0.5 s of it; made running;
the track above the fastest recording x 1.15; the track below 1 m/s."""

SLOW = 1.0
KEY_SECONDS = 0.5


def kinds(view: View) -> np.ndarray:
    """(T,) index into KINDS of every frame."""
    times, count = view.played.times, view.count
    near = np.zeros(count, bool)
    for moment in view.moments:
        near[moment.entry : moment.exit + 1] = True
        near |= np.abs(times - moment.asked.time) <= KEY_SECONDS
    made = np.array([path.startswith(MADE_FOLDER) for path in view.played.clips] + [False])[view.played.clip]
    speed = root.travel_speed(view.wanted, view.fps)
    conditions = [near, made, speed > 1.15 * view.reference.fastest, speed < SLOW]
    return np.select(conditions, range(len(conditions)), len(conditions))


def offending(view: View, ik_miss: np.ndarray | None) -> dict[str, np.ndarray]:
    """Figure -> (T,) bool: the frames that speak against it."""
    played, fps, count = view.played, view.fps, view.count
    hard = jerk.jerk(played.positions, fps)
    ratios = jerk.seam_ratios(hard, view.seams, view.speed, view.reference.jerk_p95)
    slides = stances(played.contacts)
    slides = slides[stance_travel(played.feet[:, :, 1], slides) > feet.NOTICED_SLIDE]
    speeds = np.nan_to_num(contact_speeds(played.feet, played.contacts, fps)).max(axis=1, initial=0.0)
    own = np.nanmean(view.own("contact_speed"))
    features = realism.pose_features(played.motion.skeleton, played.positions, fps, played.body.hips)
    near = realism.nearest_distance(features, view.reference.poses)
    support = np.nan_to_num(feet.support_height(played.feet, played.contacts, view.reference.heel_rest))
    asked = figures.asked_words(figures.filled_timeline(view), played.times, view.moments)
    rate = pieces.played_rate(*view.source)
    rate[view.seams - 1] = np.nan
    none = np.zeros(count, bool)
    return {
        "skate.contact_cm_s": np.append(speeds > own, False),
        "skate.stances_over_21mm": _spans(count, slides[:, :2]),
        "foot_correction_m.p95": none if played.correction is None else
        (np.where(played.contacts, played.correction, 0.0) > TARGETS["foot_correction_m.p95"].most).any(axis=1),
        "ik_miss_share": none if ik_miss is None else (np.asarray(ik_miss) > 0.005).any(axis=1),
        "seam_jerk_ratio.share_above_real": _at(count, view.seams[ratios > 1.0]),
        "seam_jerk_ratio.max": _at(count, view.seams[ratios > TARGETS["seam_jerk_ratio.max"].most]),
        "pose_realism": realism.unreal(near, view.speed, view.reference.pose_p95),
        "ground_mm.support_max": 1000.0 * support.max(axis=1) > TARGETS["ground_mm.support_max"].most,
        "warp_rate.min": np.append(rate < TARGETS["warp_rate.min"].least - 1e-3, False),
        "warp_rate.max": np.append(rate > TARGETS["warp_rate.max"].most + 1e-3, False),
        "annotation_similarity.all": words.similarity(asked, played.words) > TARGETS["annotation_similarity.all"].most,
        "loop_share": pieces.replayed(*view.source, fps),
    }


def _spans(count: int, spans: np.ndarray) -> np.ndarray:
    flags = np.zeros(count, bool)
    for low, high in spans:
        flags[low:high] = True
    return flags


def _at(count: int, frames: np.ndarray) -> np.ndarray:
    flags = np.zeros(count, bool)
    flags[frames] = True
    return flags


@dataclass(frozen=True)
class Misses:
    """One take's. frames: figure -> offending frames of each kind, (len(KINDS),), "" -> all frames. asked, lacking:
    frames that ask for words, and those of them that ask for one which no clip carries. key_speeds: (K, 2) m/s asked at
    each key moment and recorded in the clip that is played there."""

    frames: dict[str, np.ndarray]
    asked: int
    lacking: int
    key_speeds: np.ndarray


def counted(view: View, ik_miss: np.ndarray | None) -> Misses:
    """What one take misses, and why."""
    kind = kinds(view)
    flags = {"": np.ones(view.count, bool), **offending(view, ik_miss)}
    asked = [w for w in figures.asked_words(figures.filled_timeline(view), view.played.times, view.moments) if w]
    speed = root.travel_speed(view.wanted, view.fps)
    own = [np.nan if np.isnan(row) else view.reference.speed[int(row)] for row in view.rows]
    pairs = [(speed[moment.frame], own[moment.frame]) for moment in view.moments]
    return Misses(
        {name: np.bincount(kind[mask], minlength=len(KINDS)) for name, mask in flags.items()},
        len(asked), sum(not words <= view.library.words for words in asked), np.array(pairs).reshape(-1, 2),
    )


def shares(counts: np.ndarray, least: float = 0.1) -> str:
    """The kinds with most of the frames as text: "key moments 80 %, elsewhere 15 %"."""
    total = counts.sum()
    order = np.argsort(-counts, kind="stable")
    return (
        ", ".join(f"{KINDS[k]} {counts[k] / total:.0%}" for k in order if total and counts[k] >= least * total) or "-"
    )


def summary(reports: Mapping[int, Mapping], missed: Sequence[Misses]) -> list[str]:
    """One line per figure with a target: its mean over the scenarios, in how many it is met, and where it is missed."""
    rows = {number: {row.name: row for row in judged(report)} for number, report in reports.items()}
    total = {name: np.sum([of.frames[name] for of in missed], axis=0) for name in missed[0].frames}
    lines = markdown.head(["figure", "target", "mean", "recordings", "met in", "where the frames are that miss it"])
    for name in TARGETS:
        found = [of[name] for of in rows.values() if name in of and of[name].status]
        if not found:
            continue
        met = sum(row.status == "met" for row in found)
        where = shares(total[name]) if met < len(found) and name in total else ""
        verdict = f"{met} of {len(found)}" if met == len(found) else f"**{met} of {len(found)}**"
        cells = [name, _target(found), _mean(found, "value"), _mean(found, "own"), verdict, where]
        lines.append(markdown.row(cells))
    lines += [_keys(list(reports.values()), rows), ""]
    return [*lines, f"All frames: {shares(total[''], 0.0)}. What lies behind it:", "", *_behind(reports, missed), ""]


def _behind(reports: Mapping[int, Mapping], missed: Sequence[Misses]) -> list[str]:
    """The causes that can be measured, in a line each."""
    above = [report["speed_coverage"]["above"] for report in reports.values()]
    speeds = np.concatenate([of.key_speeds for of in missed])
    speeds = speeds[np.isfinite(speeds).all(axis=1)]
    keys = [key for report in reports.values() for key in report["keys"]]
    lacking = sum(of.lacking for of in missed) / max(sum(of.asked for of in missed), 1)
    lines = [
        f"- speed coverage: the track is faster than the fastest recording x 1.15 in {np.mean(above):.0%} of the "
        f"frames ({' / '.join(f'{share:.0%}' for share in above)} by scenario)",
        f"- words: {lacking:.0%} of the frames that ask for words ask for one that no clip carries; "
        f"{sum(key['used_instead'] is not None for key in keys)} of {len(keys)} key moments are played with others",
    ]
    if len(speeds):
        lines.append(
            f"- key moments: asked at {np.median(speeds[:, 0]):.1f} m/s in the median and up to "
            f"{speeds[:, 0].max():.1f}, "
            f"recorded at {np.median(speeds[:, 1]):.1f} and up to {speeds[:, 1].max():.1f}"
        )
    return lines


def _target(found: Sequence[Row]) -> str:
    if all(row.target == found[0].target for row in found):
        return found[0].target
    beyond = found[0].target.partition("(recordings")[2].removesuffix(")")
    return f"≤ recordings{beyond}"


def _mean(found: Sequence[Row], part: str) -> str:
    known = [float(getattr(row, part)) for row in found if getattr(row, part) not in ("", "–")]
    return f"{np.mean(known):.3g}" if known else ""


def _keys(reports: Sequence[Mapping], rows) -> str:
    judged_keys = [row for of in rows.values() for row in of.values() if row.name.startswith("keys ") and row.status]
    met = sum(row.status == "met" for row in judged_keys)
    missed = sorted({row.name.partition(".")[2] for row in judged_keys if row.status == "missed"})
    count = sum(len(report["keys"]) for report in reports)
    verdict = f"{met} of {len(judged_keys)}" if met == len(judged_keys) else f"**{met} of {len(judged_keys)}**"
    return markdown.row(
        [f"figures of {count} key moments", "", "", "", verdict, f"missed: {', '.join(missed) or 'none'}"]
    )
