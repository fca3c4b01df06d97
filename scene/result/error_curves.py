"""A take's figures as animated custom properties of its armature, to be seen in the Graph Editor.

They lie on the armature's data with an action of their own, so that the body's motion stays what it is and they are
shown whenever the armature is selected. They belong to the take that is shown: `renew` makes them anew for another one,
or takes them away.
"""

from __future__ import annotations

import bpy
import numpy as np

from ..core import channels, session
from ..core.measure import frames_per_second, whole_frames
from ..core.settings import BeyondMocapPlayer
from . import bake

GROUP = "Beyond Mocap"
MARK = "beyond_mocap_error_curves"

CURVES = (  # name, what it says
    ("Root Error (cm)", "Distance of root and track, both behind 1.5 s; the target is 1.5 cm for 95 %"),
    ("Slide Left (cm/s)", "Speed over the ground of the left foot while it stands"),
    ("Slide Right (cm/s)", "Speed over the ground of the right foot while it stands"),
    ("Correction Left (cm)", "How far polish moved the left foot from where the clips had it"),
    ("Correction Right (cm)", "How far polish moved the right foot from where the clips had it"),
    ("Jerk (of real)", "Hardest jerk around, over the 95th percentile of recordings at that speed"),
    ("Speed Gap (m/s)", "By how much the body is faster than the track asks"),
    ("Piece (0 or 1)", "Changes between 0 and 1 at every cut between two clips"),
)


def there(body: bpy.types.Object | None) -> bool:
    """Whether an armature has them."""
    return body is not None and body.data is not None and any(name in body.data for name, _ in CURVES)


def write(scene: bpy.types.Scene, player: BeyondMocapPlayer) -> bpy.types.Action | None:
    """Put the figures of the player's take onto its armature; None where there is no body or take."""
    made, body = session.made(player.take), player.body
    if made is None or body is None:
        return None
    values = _values(scene, made)
    remove(body)
    take, fps = made.take, frames_per_second(scene)
    start = bake.frame_at(scene, take.start_time)
    frames = whole_frames(start, (len(take.motion) - 1) / take.motion.fps, fps)
    at = np.clip(np.rint((frames - start) * (take.motion.fps / fps)), 0, len(take.motion) - 1).astype(int)
    for (name, told), row in zip(CURVES, values):
        body.data[name] = float(row[at[0]])
        body.data.id_properties_ui(name).update(description=told)
    curves = {_path(name): (GROUP, row[at][:, None]) for (name, _), row in zip(CURVES, values)}
    action = channels.animate(body.data, f"{player.name} errors", frames, curves)
    action[MARK] = True
    for curve in channels.curves(action, body.data.animation_data.action_slot).values():
        curve.keyframe_points.foreach_set("select_control_point", np.zeros(len(frames), bool))
    return action


def remove(body: bpy.types.Object) -> None:
    """Take them off an armature, with their action."""
    channels.discard(body.data, MARK)
    for name, _ in CURVES:
        if name in body.data:
            del body.data[name]


def renew(scene: bpy.types.Scene, player: BeyondMocapPlayer) -> None:
    """Where an armature has them, let them be those of the take that the player shows now; without one they go."""
    if there(player.body) and (not player.take or write(scene, player) is None):
        remove(player.body)


def _values(scene: bpy.types.Scene, made: session.Made) -> np.ndarray:
    """(C, T) in the order of CURVES; where nothing is known 0, since a key needs a number."""
    from ...beyond_mocap.evaluation.per_frame import per_frame
    from ...beyond_mocap.evaluation.reference import View
    from ...beyond_mocap.synthesis.quality.played import played_from_take

    take, unit = made.take, scene.beyond_mocap.library_unit or None
    library = session.library(made.plan.library, unit) if made.plan.library else None
    figures = per_frame(View(played_from_take(take), made.plan.track, take.timeline, library))
    piece = np.zeros(len(take.motion))
    piece[np.asarray(take.seams, int)] = 1.0
    rows = (
        100.0 * figures.root_error, *(100.0 * figures.slide.T), *(100.0 * figures.correction.T), figures.jerk,
        figures.speed_gap, np.cumsum(piece) % 2.0,
    )  # fmt: skip
    return np.nan_to_num(np.array(rows))


def _path(name: str) -> str:
    return f'["{bpy.utils.escape_identifier(name)}"]'
