"""Why a figure of a report is not known: nothing that has a target, or is the recordings' own, is silently empty."""

from __future__ import annotations

import re
from collections.abc import Mapping

from ..synthesis.quality.targets import find_target
from .view import View

_NEEDS_TRACK = r"(slow_)?root_error_m|pelvis_error_m\.(mean|keys)|pelvis_surge_m_s\.track|speed_coverage|keys \d+\."
_NEEDS_TRACK += r"(position|pelvis)_error_m|naturalness\.(off_plan|unasked|off_travel_aside|standing)"
_NEEDS_LIBRARY = r"(.*\.)?(source_\w+|own)$|pelvis_surge_ratio|seam_jerk_ratio|jerk_ratio|pose_realism|speed_coverage|"
_NEEDS_LIBRARY += r"bone_change_m|annotation_similarity\.had_keys|naturalness\.(unusual|jolts)"
_NEEDS_CLIPS = r"warp_rate|loop_share|seams|naturalness\.(cuts|dwell|short)|annotation_similarity"
_NEEDS_RECORDINGS = r"(.*\.)?(source_\w+|own)$|pelvis_surge_ratio"

_MADE_ONLY = "known only while the take is made"

_REASONS = (
    (r"root_error_m", "the track is never faster than 1 m/s"),
    (r"slow_root_error_m", "the track is never slower than 1 m/s"),
    (r"pelvis_surge", "fewer than 30 recorded frames at each speed of the take"),
    (r"skate\.(source_)?stance", "no foot stays in contact for two frames"),
    (r"skate|ground_mm\.(source_)?support|foot_correction", "no foot is in contact"),
    (r"ground_mm\.(source_)?tip", "the feet of the skeleton have no end"),
    (r"ik_miss_share", _MADE_ONLY),
    (r"pose_realism", "fewer than 3 recordings at each speed of the take"),
    (r"seam_jerk_ratio\.rest", "no frame is far from a cut"),
    (r"seam_jerk_ratio", "the take has no cut"),
    (r"warp_rate", "no piece has two frames"),
    (r"naturalness\.off_travel_aside", "the ball never lies aside of a body faster than 2 m/s"),
    (r"naturalness\.(source_)?off_travel", "the body is never faster than 2 m/s"),
    (r"naturalness\.(source_)?unusual",
     "never slower than 2 m/s without a label that asks for it, at a speed whose postures the library knows"),
    (r"naturalness\.(dwell|short)", "no piece between two cuts is slower than 2 m/s"),
    (r"naturalness\.off_plan", "the plan of headings is for another time"),
    (r"naturalness\.standing\.source_", "no recorded stand of 1.5 s is used"),
    (r"naturalness\.standing", "the track stands nowhere for 1.5 s"),
    (r"naturalness\.tempo\.source_", "no steady running above 4 m/s is used"),
    (r"naturalness\.tempo", "nowhere two strides of steady running above 4 m/s"),
    (r"physics\.flight\.accelerating", "fewer than 3 flights above 2 m/s whose path accelerates by more than 2 m/s²"),
    (r"physics\.flight", "fewer than 3 flights of 5 frames at that speed"),
    (r"physics\.step_force", "fewer than 3 running steps at that speed"),
    (r"physics\.lean\.side", "fewer than 3 stances in bends"),
    (r"physics\.lean\.fore", "fewer than 3 stances that start or stop"),
    (r"physics\.lean\.hard", "fewer than 3 stances pushed by more than 3 m/s²"),
    (r"physics\.sprint_form", "fewer than 3 strides between 6 and 8 m/s"),
    (r"touches\.reception\.source_", "the library has no labelled reception with the foot"),
    (r"touches\.(fast_)?kick\.source_", "the library has no labelled kick"),
    (r"touches\.reception", "no key moment is a reception with the foot"),
    (r"touches\.fast_kick", "no ball leaves a kick faster than 18 m/s"),
    (r"touches\.ball_inside", "no ball"),
    (r"touches\.contact", "no key moment has a ball in reach"),
    (r"touches\.ball_speed", "no ball leaves a kick faster than 5 m/s"),
    (r"annotation_similarity\.had_keys", "no key moment has a label that the library has"),
    (r"annotation_similarity\.(keys|eq18_keys)", "no key moments"),
    (r"annotation_similarity", "no labels are requested"),
)


def list_unknown_figures(flat: Mapping[str, object], view: View) -> dict[str, str]:
    """List why figures are not known.

    Args:
        flat: the report, flat as by `report.flatten_report`.
        view: the take beside its library and track.
    Returns:
        Dotted name -> reason, of each figure without a value that has a target or is the recordings' own.
    """
    unknown = [name for name, value in flat.items() if value is None and _is_expected(name, view.fps)]
    return {name: _find_reason(name, view) for name in unknown}


def _is_expected(name: str, fps: float) -> bool:
    """Return whether a figure should have a value: it has a target, or is the recordings' own."""
    if name.startswith(("keys ", "dribbles", "pins", "touches.substituted")):
        return False
    return find_target(name, fps) is not None or _matches(_NEEDS_RECORDINGS, name)


def _find_reason(name: str, view: View) -> str:
    """Find why a figure has no value: what is missing, or what the take does not have."""
    if view.track is None and _matches(_NEEDS_TRACK, name):
        return "no track"
    if view.library is None and _matches(_NEEDS_LIBRARY, name):
        return "no library"
    is_of_library = name.startswith("touches.")  # its recordings' own figures are those of the whole library
    if not is_of_library and not view.are_clips_known and _matches(f"{_NEEDS_CLIPS}|{_NEEDS_RECORDINGS}", name):
        return "the played clips are not known"
    if view.played.correction is None and name.startswith("foot_correction_m"):
        return _MADE_ONLY
    if not is_of_library and not len(view.used_rows) and _matches(_NEEDS_RECORDINGS, name):
        return "no recording is used: all clips are synthetic"
    return next((reason for pattern, reason in _REASONS if _matches(pattern, name)), "nothing to measure")


def _matches(pattern: str, name: str) -> bool:
    return re.match(pattern, name) is not None
