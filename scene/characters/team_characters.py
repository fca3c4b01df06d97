"""Characters as the bodies of a match's teams: a copy for each player, analysed once for each character."""

from __future__ import annotations

import bpy
import numpy as np

from ...beyond_mocap.base.errors import BeyondMocapError
from ...beyond_mocap.motion.motion import Motion, sample_frames
from ..core.measure import frames_per_second, whole_frames
from ..rigs.fit import SourceMotion
from . import copies
from .ball_touches import list_ball_touches
from .character_rig import CharacterRig


class TeamCharacters:
    """Creates copies of characters and their keys.

    Attributes:
        messages: about characters that cannot be a body.
    """

    def __init__(self, context: bpy.types.Context, chosen: dict[str, bpy.types.Object | None]):
        """Check the chosen characters.

        Args:
            context: of Blender.
            chosen: "home", "away", "referee" and "keeper" -> armature; None: the built-in body.
        """
        self.context, self.messages = context, []
        self.chosen = {group: one for group, one in chosen.items() if one is not None and self._is_usable(one)}
        self._rigs: dict[bpy.types.Object, CharacterRig] = {}
        self._originals: dict[bpy.types.Object, bpy.types.Object] = {}

    def _is_usable(self, original: bpy.types.Object) -> bool:
        """Whether a character can be a body; if not, a message says why."""
        try:
            copies.check_character(original)
        except BeyondMocapError as error:
            self._add_message(str(error))
            return False
        for line in copies.describe_differences(original):
            self._add_message(line)
        return True

    def _add_message(self, text: str) -> None:
        if text not in self.messages:
            self.messages.append(text)

    def create_body(self, team: str, is_keeper: bool, name: str,
                    collection: bpy.types.Collection) -> list[bpy.types.Object] | None:
        """Create a body for a player.

        Args:
            team: "home", "away" or "referee".
            is_keeper: whether the player is a goalkeeper.
            name: of the armature.
            collection: where it goes.
        Returns:
            The armature, then its meshes and what these hang on; None where the player has the built-in body.
        """
        original = (self.chosen.get("keeper") if is_keeper else None) or self.chosen.get(team)
        if original is None:
            return None
        things = copies.create_copy(original, name, collection)
        if original not in self._rigs and not self._analyse(original, things):
            copies.remove_copy(things[0])
            self.chosen = {group: one for group, one in self.chosen.items() if one != original}
            return None
        self._originals[things[0]] = original
        self._rigs[original].set_switches(things[0])
        return things

    def _analyse(self, original: bpy.types.Object, things: list[bpy.types.Object]) -> bool:
        """Analyse the first copy of a character for all others; False where that is not possible."""
        self.context.view_layer.update()
        try:
            self._rigs[original] = CharacterRig(things[0], copies.list_meshes(things[0]), self.context.scene)
        except BeyondMocapError as error:
            self._add_message(str(error))
            return False
        return True

    def build_keys(self, body: bpy.types.Object, motion: Motion, start: float, take=None):
        """Build the keys of a stretch on a body.

        Args:
            body: from `create_body`.
            motion: of the stretch.
            start: scene frame (may be fractional) of its first frame.
            take: it is from, which has foot contacts and the ball; None where that is not known.
        Returns:
            Whole scene frames (F,) and curves as for `channels.create_action`.
        """
        scene = self.context.scene
        fps = frames_per_second(scene)
        frames = whole_frames(start, motion.duration, fps)
        at = (frames - start) * (motion.fps / fps)
        shown = Motion(motion.skeleton, *sample_frames(motion, at), fps)
        nearest = np.clip(np.round(at).astype(int), 0, len(motion) - 1)
        source = SourceMotion(shown, int(frames[0]), body.name, take.contacts[nearest] if take is not None else None)
        touches = list_ball_touches(take, shown, take.start_time + at / motion.fps) if take is not None else ()
        found, curves, _ = self._rigs[self._originals[body]].build_keys(source, touches)
        return found, curves

    @staticmethod
    def update_originals() -> None:
        """Hide the characters that are used, so that they do not stand on the pitch, and show the others again."""
        used = {copies.find_original(thing) for thing in bpy.data.objects} - {None}
        for original in [*used, *(thing for thing in bpy.data.objects if copies.SHOWN in thing and thing not in used)]:
            copies.update_original(original)
