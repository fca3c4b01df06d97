"""Show a section of a match in the scene: pitch, players in kits, ball and cameras. Showing it again replaces it.

Characters have poses on every frame of their stretches, and are hidden outside them.
"""

from __future__ import annotations

from contextlib import contextmanager
from time import perf_counter

import bpy
import numpy as np

from ...beyond_mocap.motion.track.ball_path import BallPath
from ..characters import copies
from ..characters.team_characters import TeamCharacters
from ..core import action, channels, frame_range, session
from ..core.measure import frames_per_second, units_per_metre
from ..stage import ball, cameras, stage
from . import match_objects as ours
from .characters import CharacterBuilder, build_label
from .kits import choose_kit, dress_in_kit
from .load import Character, MatchSection

VISIBILITY_GROUP = "Shown"  # group of curves


def show_match(context: bpy.types.Context, section: MatchSection, first: int) -> dict[str, float]:
    """Show a section of a match; what was displayed before is removed.

    Args:
        context: Blender's context.
        section: what to show.
        first: scene frame of its start.
    Returns:
        Seconds that pitch, bodies, keys and cameras took.
    """
    scene, durations = context.scene, {}
    scene.beyond_mocap_match.shown_section = session.store_section(section, first)
    ours.clear_match(scene)
    ours.include_collections(context.view_layer)
    last = int(np.floor(compute_frame(scene, section.start, first, section.end) + 1e-4))
    with _measure_seconds(durations, "pitch"):
        if stage.find_stage(scene) is None:
            scene.beyond_mocap_stage.stands = True
        if scene.beyond_mocap_stage.sport != section.sport:
            scene.beyond_mocap_stage.sport = section.sport
        stage.create_stage(scene, (section.length, section.width))
    with _measure_seconds(durations, "bodies"):
        own = TeamCharacters(context, scene.beyond_mocap_match.list_characters())
        characters = _create_characters(context, section, own)
    with _measure_seconds(durations, "keys"):
        for person, worn in characters:
            keys = own.build_keys if copies.find_original(worn[0]) is not None else None
            bake_character(scene, person, worn, start=section.start, first=first, last=last, build_keys=keys)
        own.update_originals()
        scene.beyond_mocap_match.character_note = "\n".join(own.messages)
        if section.ball is not None:
            bake_ball(context, section.ball, section.start, first)
    with _measure_seconds(durations, "cameras"):
        camera = cameras.get_camera(scene, "BROADCAST")
    if scene.camera is None or cameras.is_own(scene, scene.camera):
        scene.camera = camera
    frame_range.extend_range(scene, last)
    return durations


def show_again(context: bpy.types.Context) -> bool:
    """Show what this session showed last in the scene, with other bodies; False where there is nothing."""
    known = session.find_section(context.scene.beyond_mocap_match.shown_section)
    if known is None or ours.find_root(context.scene) is None:
        return False
    show_match(context, *known)
    return True


def find_ball(scene: bpy.types.Scene) -> bpy.types.Object | None:
    """Find the ball of the displayed match; None if there is none."""
    return next(iter(ours.find_meshes(scene, "ball")), None)


def compute_frame(scene: bpy.types.Scene, start: float, first: int, seconds: float) -> float:
    """Compute the scene frame (fractional) of a second on the match's clock, where `start` s is frame `first`."""
    return first + (seconds - start) * frames_per_second(scene)


def bake_character(scene: bpy.types.Scene, character: Character, objects: list[bpy.types.Object], start: float,
                   first: int, last: int, build_keys=None) -> None:
    """Bake a character's motion to its armature, and hide its objects outside its stretches.

    Args:
        scene: the scene.
        character: who.
        objects: the armature, then its meshes.
        start: s on the match's clock.
        first: scene frame of that time.
        last: last displayed frame.
        build_keys: function (armature, motion, frame, take) -> frames and curves, for an own character; None for the
            built-in body.
    """
    body = objects[0]
    takes = character.takes or (None,) * len(character.motions)
    places = [(motion, compute_frame(scene, start, first, begins), take)
              for (begins, motion), take in zip(character.motions, takes)]
    parts = [build_keys(body, *place) if build_keys is not None else action.build_keys(body, place[0], scene, place[1])
             for place in places]
    frames = np.concatenate([frames for frames, _ in parts])
    is_new = np.concatenate([[True], np.diff(frames) > 0])  # consecutive stretches may share a frame
    curves = {path: (group, np.concatenate([curves[path][1] for _, curves in parts])[is_new]) for path,
              (group, _) in parts[0][1].items()}
    done = channels.create_action(body, f"{body.name} match", frames[is_new], curves)
    done[action.PLACEMENT] = [number for row in body.matrix_world for number in row]
    ours.mark_object(done)
    is_present = np.zeros(last - first + 1, bool)
    is_present[np.clip(frames.astype(int) - first, 0, last - first)] = True
    if not is_present.all():
        hide_outside(objects, is_present, first)


def hide_outside(objects: list[bpy.types.Object], is_present: np.ndarray, first: int) -> None:
    """Hide objects, in views and renders, on the frames from `first` where `is_present` (F,) is False."""
    turns = np.flatnonzero(np.diff(is_present.astype(int)))
    at = np.unique(np.concatenate([[0], turns, turns + 1]))
    hidden = np.where(is_present[at], 0.0, 1.0)[:, None]
    curves = {name: (VISIBILITY_GROUP, hidden) for name in ("hide_viewport", "hide_render")}
    for thing in objects[1:]:  # an armature has its own keys, and no surface
        ours.mark_object(channels.create_action(thing, f"{thing.name} shown", first + at, curves))


def bake_ball(context: bpy.types.Context, path: BallPath, start: float, first: int) -> bpy.types.Object:
    """Bake the ball with its roll, hidden where its trajectory is unknown, and its trajectory as a curve.

    Args:
        context: Blender's context.
        path: the ball path.
        start: s on the match's clock.
        first: scene frame of that time.
    Returns:
        The ball.
    """
    scene, home = context.scene, ours.create_collection(context.scene, "ball")
    thing = ours.mark_object(ball.create_ball(context, "Match ball", home))
    ours.mark_object(ball.write_trajectory(thing, path, scene,
                                           compute_frame(scene, start, first, float(path.times[0]))))
    home.objects.link(ours.mark_object(_create_trajectory_curve(scene, path)))
    return thing


@contextmanager
def _measure_seconds(durations: dict[str, float], name: str):
    """Measure the seconds of a step."""
    began = perf_counter()
    yield
    durations[name] = perf_counter() - began


def _create_characters(context: bpy.types.Context, section: MatchSection, own: TeamCharacters):
    """Create all characters with their objects: copies of the team's own character, or built-in bodies."""
    wardrobe, found = CharacterBuilder(context, section.colours), []
    for person in section.characters:
        home = ours.create_collection(context.scene, person.team)
        worn = own.create_body(person.team, person.keeper, build_label(person), home)
        if worn is not None:
            dress_in_kit(worn[0], choose_kit(person, section.colours))
            worn[0][ours.PLAYER_PROPERTY] = person.id
        found.append((person, [ours.mark_object(one) for one in worn] if worn is not None
                      else wardrobe.create_character(person, home)))
    return found


def _create_trajectory_curve(scene: bpy.types.Scene, path: BallPath) -> bpy.types.Object:
    """Create the ball's trajectory as a thin curve for the views, hidden at first: a minute of it is hard to read."""
    data = bpy.data.curves.new("Match ball course", "CURVE")
    data.dimensions = "3D"
    line = data.splines.new("POLY")
    line.points.add(len(path.positions) - 1)
    placed = np.ones((len(path.positions), 4), np.float32)
    placed[:, :3] = path.positions * units_per_metre(scene)
    line.points.foreach_set("co", placed.ravel())
    thing = bpy.data.objects.new("Match ball course", data)
    thing.hide_render = thing.hide_select = thing.hide_viewport = True
    return thing
