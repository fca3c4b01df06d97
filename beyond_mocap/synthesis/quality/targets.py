"""Targets of the report's figures (docs/reference/report-figures.md): fixed limits, or the recordings' own."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from ...motion.motion import ACCEPTED_RATES

_SLACK = 1e-9  # of a comparison, for rounding


@dataclass(frozen=True)
class Target:
    """The target of a figure: between `least` and `most`, or at most another figure plus a margin.

    Attributes:
        least: lower limit, None without one.
        most: upper limit, None without one.
        own: dotted name of the figure of the recordings that is the upper limit, None for a fixed one.
        beyond: margin added to it.
    """

    least: float | None = None
    most: float | None = None
    own: str | None = None
    beyond: float = 0.0

    def bounds(self, flat: Mapping[str, Any]) -> tuple[float | None, float | None]:
        """Return least and most for one report.

        Args:
            flat: the report, flat as by `report.flatten_report`.
        Returns:
            None where there is no such bound or it is unknown.
        """
        if self.own is None:
            return self.least, self.most
        score = flat.get(self.own)
        return self.least, None if score is None else float(score) + self.beyond

    def describe(self, flat: Mapping[str, object]) -> str:
        """Describe the target, such as "≤ 0.005"."""
        least, most = self.bounds(flat)
        if least is not None and most is not None:
            return f"± {most:.3g}" if least == -most else f"{least:g} .. {most:g}"
        if most is not None:
            beyond = f" + {self.beyond:g}" if self.beyond else ""
            return f"≤ {most:.4g}" + (f" (recordings{beyond})" if self.own else "")
        return "" if least is None else f"≥ {least:g}"

    def is_met(self, value: float, flat: Mapping[str, object]) -> bool | None:
        """Return whether a value meets the target; None where the bound is not known."""
        least, most = self.bounds(flat)
        if least is None and most is None:
            return None
        return (least is None or value >= least - _SLACK) and (most is None or value <= most + _SLACK)


TARGETS = {
    "root_error_m.mean": Target(most=0.005),
    "root_error_m.p95": Target(most=0.015),
    "slow_root_error_m.mean": Target(most=0.05),
    "slow_root_error_m.max": Target(most=0.12),
    "naturalness.snap_turns_per_min": Target(most=0.6),
    "naturalness.spins_per_min": Target(most=0.3),
    "naturalness.unasked_spins_per_min": Target(most=0.0),
    "naturalness.pelvis_drops_per_min": Target(most=0.6),
    "naturalness.pelvis_drops_in_locomotion_per_min": Target(most=0.0),
    "naturalness.cuts_per_min": Target(most=30.0),
    "naturalness.dwell_s_median": Target(least=1.5),
    "naturalness.short_dwell_share": Target(most=0.05),
    "naturalness.unusual_posture_share": Target(most=0.05),
    "naturalness.standing.foot_lifts_per_min": Target(most=30.0),
    "naturalness.standing.both_down": Target(least=0.8),
    "naturalness.off_travel_aside_deg_p90": Target(least=30.0),
    "naturalness.tempo.sd_ms": Target(most=15.0),
    "naturalness.off_plan_deg_median": Target(most=10.0),
    "naturalness.off_plan_deg_p90": Target(most=25.0),
    "naturalness.jolts_per_min": Target(most=1.0),
    "naturalness.arms.inside_share": Target(most=0.005),
    "naturalness.arms.depth_m_max": Target(most=0.02),
    **{f"physics.flight.{speed}.vertical_m_s2_median": Target(least=-10.81, most=-8.81)
       for speed in ("2-4", "4-6", "6+")},
    **{f"physics.flight.{speed}.level_m_s2_median": Target(most=1.4) for speed in ("2-4", "4-6", "6+")},
    "physics.flight.accelerating.level_m_s2_median": Target(most=1.6),
    **{f"physics.step_force.{speed}.force_ratio_median": Target(least=0.85, most=1.15)
       for speed in ("2-4", "4-6", "6+")},
    "physics.lean.side.lean_error_deg_median": Target(most=3.0),
    "physics.lean.fore.lean_error_deg_median": Target(most=3.0),
    "physics.sprint_form.knee_flexion_deg_median": Target(least=139.0, most=151.0),
    "physics.sprint_form.ankle_lift_m_median": Target(least=0.67, most=0.79),
    "physics.sprint_form.trunk_lean_deg_median": Target(least=-2.0, most=8.0),
    "physics.boots.below_share": Target(most=0.10),
    "touches.reception.speed_m_s_median": Target(most=3.0),
    "touches.reception.strike_count": Target(most=0.0),
    "touches.second_strike_count": Target(most=0.0),
    "touches.unasked_strike_count": Target(most=0.0),
    "touches.fast_kick.ankle_speed_m_s_median": Target(least=9.0),
    "touches.fast_kick.plant_beside_m_median": Target(least=0.2, most=0.37),
    "touches.fast_kick.plant_ahead_m_median": Target(least=-0.05, most=0.2),
    "touches.ball_speed.ratio_median": Target(least=1.06, most=1.3),
    "touches.contact.reachable_met_share": Target(least=0.95),
    "touches.ball_inside.inside_frames": Target(most=0.0),
    "pelvis_error_m.mean": Target(own="pelvis_error_m.own", beyond=0.015),
    "pelvis_surge_ratio": Target(most=1.3),
    "skate.contact_cm_s": Target(own="skate.source_contact_cm_s"),
    "skate.stance_mm_median": Target(most=5.0),
    "skate.stances_over_21mm": Target(own="skate.source_stances_over_21mm"),
    "skate.gmd_ratio": Target(own="skate.source_gmd_ratio"),
    "ground_mm.min": Target(least=-5.0),
    "ground_mm.support_max": Target(most=5.0),
    "foot_correction_m.p95": Target(most=0.10),
    "ik_miss_share": Target(most=0.0),
    "pelvis_drop_m": Target(most=0.04),
    "bone_change_m": Target(most=1e-6),
    "seam_jerk_ratio.share_above_real": Target(most=0.10),
    "seam_jerk_ratio.max": Target(most=1.3),
    "seam_jerk_ratio.rest_max": Target(most=1.3),
    "warp_rate.min": Target(least=ACCEPTED_RATES[0]),
    "warp_rate.max": Target(most=ACCEPTED_RATES[1]),
    "loop_share": Target(most=0.05),
    "pose_realism": Target(most=0.10),
    "annotation_similarity.all": Target(most=-0.9),
    "annotation_similarity.had_keys": Target(most=-1.0),
}
"""Dotted name of a figure -> its target. Those of key moments are in `KEY_TARGETS`."""

KEY_TARGETS = {
    "position_error_m": Target(most=0.05),
    "contact_gap_m": Target(most=0.005),
    "ball_shift_m": Target(most=0.3),
}


def find_target(name: str, fps: float) -> Target | None:
    """Find the target of a figure.

    Args:
        name: dotted name, such as "keys 2.contact_gap_m".
        fps: output frames per second.
    Returns:
        None where it has no target.
    """
    key = re.fullmatch(r"keys \d+\.(\w+)", name)
    if key and key[1] == "time_error_s":
        half = round(0.5 / fps, 6)
        return Target(least=-half, most=half)
    return KEY_TARGETS.get(key[1]) if key else TARGETS.get(name)
