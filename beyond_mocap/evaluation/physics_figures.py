"""The report's group `physics`: whether a take moves as its mass has to, beside the recordings that it uses."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from ..appearance.boots import build_boots
from ..appearance.mesh import BodyMesh
from ..base.errors import TimedMessage
from ..base.time_series import time_derivative
from ..motion.track import smooth_zero_phase_hann
from ..synthesis.quality.unmet_constraints import report_hard_pushes
from .body_physics import SPEED_CLASSES, measure_body_physics, summarize_physics
from .titles import Title
from .view import View

FRAMES_KEYS = {
    **dict.fromkeys(("vertical_m_s2_median", "level_m_s2_median"), "flights"),
    **dict.fromkeys(("force_ratio_median", "force_in_range_share"), "steps"),
    **dict.fromkeys(("lean_missing_deg_median", "crouch_m_median"), "pushes"),
    "lean_error_deg_median": "stances", "lean_slope": "slope_stances",
    **dict.fromkeys(("knee_flexion_deg_median", "ankle_lift_m_median",
                     "trunk_lean_deg_median", "bounce_m_median", "bounce_ratio_median"), "strides"),
}  # fmt: skip
"""What a figure rests on: a key beside it."""

_PUSH_SECONDS = 0.7  # s of the window through which a track's acceleration is seen: about two steps
_FEWEST_FRAMES = 5  # of a take whose acceleration is known
_SPEED_TEXTS = {"2-4": "2 to 4 m/s", "4-6": "4 to 6 m/s", "6+": "above 6 m/s"}

TITLES = {
    **{f"flight.{name}.vertical_m_s2_median": Title(f"Vertical acceleration in flight, {_SPEED_TEXTS[name]}", "m/s²")
       for name in SPEED_CLASSES},
    **{f"flight.{name}.level_m_s2_median": Title(f"Level acceleration in flight, {_SPEED_TEXTS[name]}", "m/s²")
       for name in SPEED_CLASSES},
    "flight.accelerating.level_m_s2_median": Title("The same while the path accelerates", "m/s²"),
    **{f"step_force.{name}.force_ratio_median": Title(f"Force in contact over that of runners, {_SPEED_TEXTS[name]}",
                                                      "", digits=2) for name in SPEED_CLASSES},
    **{f"step_force.{name}.force_in_range_share": Title(f"Steps within 15 % of it, {_SPEED_TEXTS[name]}", "%", 100.0, 0)
       for name in SPEED_CLASSES},
    "lean.side.lean_error_deg_median": Title("Lean in bends off", "°"),
    "lean.side.lean_slope": Title("Share of the lean that bends ask for", "%", 100.0, 0),
    "lean.fore.lean_error_deg_median": Title("Lean at starts and stops off", "°"),
    "lean.fore.lean_slope": Title("Share of the lean that starts and stops ask for", "%", 100.0, 0),
    "lean.hard.lean_missing_deg_median": Title("Lean that hard turns and stops lack", "°"),
    "lean.hard.crouch_m_median": Title("Crouch in hard turns and stops", "cm", 100.0),
    "sprint_form.knee_flexion_deg_median": Title("Largest knee flexion in sprints", "°", digits=0),
    "sprint_form.ankle_lift_m_median": Title("Highest ankle in sprints", "cm", 100.0, 0),
    "sprint_form.trunk_lean_deg_median": Title("Forward lean of the trunk in sprints", "°", digits=0),
    "sprint_form.bounce_m_median": Title("Bounce of the centre of mass in sprints", "cm", 100.0),
    "sprint_form.bounce_ratio_median": Title("The same over that of its contacts and flights", "", digits=2),
    "boots.below_share": Title("Boots more than 2 cm below the ground", "%", 100.0, 0),
}  # fmt: skip
"""Figure of the group -> how pages show it."""


def measure_physics(view: View) -> dict:
    """Measure whether a take moves as its mass has to, beside the same of the recordings that it uses.

    Args:
        view: the take beside its library and track.
    Returns:
        The report's group.
    """
    played = view.played
    body = measure_body_physics(played.motion, played.positions, played.rotations, view.course, _build_boots(view))
    out = summarize_physics([body], [np.ones(len(body.boots), dtype=bool)])
    if view.reference is not None:
        _add_source_figures(out, summarize_physics(view.reference.physics, view.reference.split_by_course(view.used)))
    return {"physics": out}


def list_physics_notes(view: View) -> list[TimedMessage]:
    """List a line where the track asks for more than a body on the ground can do: the track rules, the body leans less.

    Args:
        view: the take beside its library and track.
    """
    if view.target is None or view.count < _FEWEST_FRAMES:
        return []
    path = smooth_zero_phase_hann(view.target, view.fps, _PUSH_SECONDS)
    acceleration = time_derivative(time_derivative(path, view.fps), view.fps)
    line = report_hard_pushes(view.played.times, np.linalg.norm(acceleration, axis=1))
    return [] if line is None else [line]


def _build_boots(view: View) -> BodyMesh:
    """Build the boots of the take's body: those of the library's, as tall as it is, so that both are compared alike."""
    if view.reference is None:
        return build_boots(view.played.motion.skeleton, example=view.played.motion)
    return replace(view.reference.boots, vertices=view.scale * view.reference.boots.vertices)


def _add_source_figures(out: dict, own: Mapping) -> None:
    """Add the figures of the recordings as twins, group by group."""
    for name, value in own.items():
        if isinstance(value, Mapping):
            _add_source_figures(out[name], value)
        else:
            out[f"source_{name}"] = value
