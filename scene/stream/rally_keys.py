"""The keys of a rally's players and ball.

A pass replaces the keys from its beginning on, in the actions that are there: those before it stay, so that a step of
undo that is made meanwhile has them all. While the scene plays, only the frames that are drawn next are written at
once, since the user waits for them; `finish_pass` writes the rest of the pass after that drawing. The long standing of
its players follows with `write_all`, when there is time.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace
from types import SimpleNamespace
from typing import TYPE_CHECKING

import bpy
import numpy as np

from ...beyond_mocap.base.errors import InputError
from ..core import channels, frame_range
from ..core.action import RestPose
from ..core.measure import frames_per_second
from ..passes import generate as make
from ..rigs import armature
from ..stage import ball as balls

if TYPE_CHECKING:
    from ...beyond_mocap.motion.track.ball_path import BallPath
    from ...beyond_mocap.passes.live_passes import Rally

AT_ONCE = 3.0
"""Seconds of standing after a pass that are written with it."""


class RallyKeys:
    """The keys of a rally, as they stand in the actions.

    Attributes:
        note: which of the user's edits the last writing has replaced, a line; "" for none.
    """

    def __init__(self) -> None:
        self._players: dict[str, channels.WrittenKeys] = {}
        self._ball: channels.WrittenKeys | None = None
        self.note = ""

    def mark_edits(self) -> None:
        """Let the keys be compared before they are replaced: they may have been edited."""
        for keys in (*self._players.values(), *([self._ball] if self._ball else ())):
            keys.is_current = False

    def finish_pass(self, scene: bpy.types.Scene) -> bool:
        """Write the keys of the last pass that `replace_pass` has left out.

        Returns:
            Whether that was possible; otherwise `write_all` is needed, since the keys have been changed by others.
        """
        rows, ball = scene.beyond_mocap_passes.players, scene.beyond_mocap_passes.rally
        pairs = [(keys, rows[name].body) for name, keys in self._players.items() if name in rows]
        return all([keys.write_others(target) for keys, target in (*pairs, (self._ball, ball)) if keys and target])

    def note_edits(self, scene: bpy.types.Scene) -> None:
        """Compare the keys of one player if they are marked: it takes some milliseconds, for which a strike would have
        to wait.
        """
        rows = scene.beyond_mocap_passes.players
        for name, keys in self._players.items():
            if not keys.is_current and name in rows and rows[name].body is not None:
                keys.note_edits(rows[name].body)
                return

    def write_all(self, scene: bpy.types.Scene, rally: Rally, names: Iterable[str]) -> None:
        """Write the whole motions of the named players and the ball's path as new actions. Values of players that the
        user has edited are kept, unless keys were added, removed or moved.
        """
        from ...beyond_mocap.passes.passes import build_ball

        self.finish_pass(scene)
        rows, start = _find_rows(scene, names), float(scene.beyond_mocap_passes.start_frame)
        replaced = []
        for name, row in rows.items():
            played, old = rally.players[name], self._players.get(name)
            keeps = old is not None and row.body is not None and old.note_edits(row.body)
            make.apply_motion(scene, row, SimpleNamespace(motion=played.motion, start_time=played.start), start)
            self._players[name] = channels.WrittenKeys(row.body)
            if keeps:
                self._players[name].copy_edits(row.body, old)
            elif old is not None:
                replaced.append(name)
        if replaced:
            self.note = f"Keys were added, removed or moved, and have been written again: {', '.join(replaced)}"
        ball, old = scene.beyond_mocap_passes.rally, self._ball
        keeps = old is not None and ball is not None and old.note_edits(ball)
        make.apply_ball(scene, SimpleNamespace(ball=rally.ball, kind=build_ball(rally.scene)), start)
        ball = scene.beyond_mocap_passes.rally
        self._ball = None if ball.beyond_mocap_ball.before.kept else channels.WrittenKeys(ball)
        if keeps and self._ball is not None:
            self._ball.copy_edits(ball, old)
        frame_range.extend_range(scene, start + float(rally.ball.times[-1]) * frames_per_second(scene))

    def replace_pass(self, scene: bpy.types.Scene, rally: Rally, names: Iterable[str], begin: float,
                     shown: float | None = None) -> bool:
        """Replace the keys of the named players and the ball by the pass that has just been added to a rally.

        Args:
            scene: the scene.
            rally: the rally with the pass.
            names: of the players.
            begin: s from which on they are replaced, until the players have stood for a while.
            shown: the scene's frame that is drawn next, as in `WrittenKeys.replace`; None: all keys are written.
        Returns:
            Whether it was possible; otherwise `write_all` is needed, since the keys have been changed by others or end
            before that.
        """
        self.finish_pass(scene)
        until, fps = rally.ready_time + AT_ONCE, frames_per_second(scene)
        first, ball = scene.beyond_mocap_passes.start_frame + begin * fps, scene.beyond_mocap_passes.rally
        rows = _find_rows(scene, names)
        if self._ball is None or ball is None or rally.rate != fps or any(row.body is None for row in rows.values()):
            return False
        changes = [(self._players[name], row.body, first, _build_curves(scene, rally, row, (begin, until)))
                   for name, row in rows.items()]
        changes.append((self._ball, ball, first, balls.build_keys(ball, _cut_path(rally.ball, begin, until), scene,
                                                                  first)[1]))
        if not all(keys.can_replace(*change) for keys, *change in changes):  # of all or of none
            return False
        edited = [name for name in rows if self._players[name].count_edits(first)]
        if edited:
            self.note = f"The pass has replaced keys that were edited after its beginning: {', '.join(edited)}"
        for keys, *change in changes:
            keys.replace(*change, shown)
        return True


def _find_rows(scene, names: Iterable[str]) -> dict:
    """Find the named players in the list: they may have been renamed or removed since the rally started."""
    rows = {row.name: row for row in scene.beyond_mocap_passes.players}
    if missing := [name for name in names if name not in rows]:
        raise InputError("players", f"{missing[0]} is not in the list now", "the same players", "press Play Live again")
    channels.check_local(*(rows[name].body for name in names), scene.beyond_mocap_passes.rally)
    return {name: rows[name] for name in names}


def _build_curves(scene, rally: Rally, row, span: tuple[float, float]) -> dict:
    """Build the curves of a player's motion over a span in s, where the armature stands now."""
    played = rally.players[row.name]
    first, end = (round((seconds - played.start) * rally.rate) for seconds in span)
    rest = RestPose.from_body(row.body, played.motion.skeleton.names, armature.find_current_placement(row.body, scene))
    return rest.build_curves(played.motion.root_positions[first:end], played.motion.rotations[first:end])


def _cut_path(path: BallPath, begin: float, until: float) -> BallPath:
    """Cut the ball's path to what is from `begin` s on and before `until` s."""
    part = slice(*np.searchsorted(path.times, (begin - 1e-6, until)))
    return replace(path, times=path.times[part], positions=path.positions[part], measured=path.measured[part],
                   rotations=path.rotations[part])
