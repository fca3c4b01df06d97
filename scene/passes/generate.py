"""Generation of a passing scene: ordered on the main thread, computed in any thread, applied to characters and a ball.

The overlays draw its flights: those of the scene that is shown, and those of the current places while one is dragged.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import bmesh
import bpy
import numpy as np

from ...beyond_mocap.ball.contact import Tool
from ...beyond_mocap.base.digest import byte_digest
from ...beyond_mocap.base.errors import InputError
from ...beyond_mocap.base.fixes import Fix
from ...beyond_mocap.passes.pass_scene import Net, PassScene
from ..core import action, channels, frame_range, preferences, session
from ..core.measure import frames_per_second, units_per_metre
from ..core.saved_state import discard_saved_state, restore_playback, save_playback
from ..core.settings import to_absolute_path
from ..path_editing import edited_bodies
from ..path_editing.armature_adapter import check_editable_override
from ..result import bake
from ..rigs import armature
from ..stage import ball, body
from . import characters as shown
from . import possession
from . import scene_lists as lists
from .settings import KEPT, BeyondMocapPasser

if TYPE_CHECKING:
    from ...beyond_mocap.ball.physics import Ball
    from ...beyond_mocap.library.library import Library
    from ...beyond_mocap.passes.pass_plan import PassPlan
    from ...beyond_mocap.passes.passes import PlayedScene

BALL, NET = "Passing Ball", "Net"
MESH = 0.1  # m between two threads of the net
MOST_LINES = 12  # of messages in the panel
TRAJECTORY_STEP = 0.03  # s between two points of a trajectory
MOST_CANDIDATES, MOST_RALLIES = 40, 20  # candidates of a strike, and scenes, that are stored

_stored: dict[str, "Trajectories"] = {}  # by the digest of their order
_dragged: list["Trajectories"] = []


@dataclass(frozen=True, eq=False)
class Order:
    """Order for a passing scene.

    Attributes:
        scene: the passing scene.
        start: scene frame of its second 0.
        folder: folder of the library.
        unit: metres per unit of the library's clips; None: guessed.
        library: the library if it is loaded.
        digest: of all that.
        build: further arguments of `build`.
    """

    scene: PassScene
    start: float
    folder: str
    unit: float | None
    library: "Library | None"
    digest: str
    build: dict = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Trajectories:
    """Trajectories to draw, metres in the world frame.

    Attributes:
        start: scene frame of second 0.
        starts: (K,) s of the flights.
        flight_paths: (n, 3) m for each flight.
        strike_times: (S,) s.
        strikes: (S, 3) m.
        bounces: (B, 3) m.
        candidates: (M, T, 3) m for each strike, trajectories from which its own was chosen; empty for the last one.
    """

    start: float
    starts: np.ndarray
    flight_paths: tuple[np.ndarray, ...]
    strike_times: np.ndarray
    strikes: np.ndarray
    bounces: np.ndarray
    candidates: tuple[np.ndarray, ...]

    def flight_at(self, seconds: float) -> int:
        """Find the index of the flight in which the ball is."""
        return int(np.clip(np.searchsorted(self.starts, seconds + 1e-9, side="right") - 1, 0, len(self.flight_paths)
                           - 1))


@dataclass(frozen=True, eq=False)
class Result:
    """Result of an order; `trajectories` is what is drawn of it."""

    order: Order
    library: "Library"
    passes: "PlayedScene"
    trajectories: Trajectories


def build_order(scene: bpy.types.Scene) -> Order:
    """Build the order from the settings.

    Raises:
        InputError: if the settings are invalid or a character cannot be animated.
    """
    settings, common = scene.beyond_mocap_passes, scene.beyond_mocap
    requested = lists.build_scene(scene)
    folder_set = settings.library_folder or common.library_folder
    folder = to_absolute_path(folder_set)
    if not folder:
        raise InputError("library", "no folder chosen",
                         "a folder of clips with strikes, such as sample_blend/passes/library",
                         "choose one under Options, or in step 1", fixes=(Fix("choose_library"),))
    for row in settings.players:
        if row.body is not None:
            channels.check_local(row.body)
            channels.check_editable(row.body)
            check_editable_override(row.body, "body")
    shown.check_characters(*settings.players)
    channels.check_local(settings.rally)
    if settings.rally is not None:
        channels.check_editable(settings.rally)
        possession.check_unaimed(settings.rally)
    unit = (common.library_unit or None) if not settings.library_folder else None
    # the folder as set: a file may be moved with its library
    digest = byte_digest(repr((requested, folder_set, unit, settings.start_frame))).hex()
    return Order(requested, float(settings.start_frame), folder, unit=unit, library=session.find_library(folder, unit),
                 digest=digest, build=preferences.build_library_options(folder))


def run_order(order: Order, progress, cancelled, _hurry) -> Result:
    """Build the library if it is not loaded, and synthesize the scene. Does not use bpy."""
    from ...beyond_mocap.passes.passes import synthesize_passes

    library = session.open_library(order, progress, cancelled)
    played_scene = synthesize_passes(library, order.scene, progress, cancelled)
    return Result(order, library, played_scene, build_trajectories(played_scene.plan, played_scene.kind, order.start))


def plan_flights(order: Order, cancelled) -> Trajectories:
    """Plan the flights of a scene alone, while it is dragged. Does not use bpy."""
    from ...beyond_mocap.passes.passes import build_ball, plan_scene

    plan = plan_scene(order.library, order.scene, None, cancelled)
    return build_trajectories(plan, build_ball(order.scene), order.start)


def apply_result(scene: bpy.types.Scene, result: Result) -> None:
    """Apply the scene to its characters and its ball, which are created if there are none."""
    settings, played_scene = scene.beyond_mocap_passes, result.passes
    session.store_library(result.library, result.order.unit)
    rows = {row.name: row for row in settings.players}
    messages = [line for one in played_scene.players for line in edited_bodies.revert_path_edits(rows[one.name].body)]
    start = result.order.start
    for one in played_scene.players:
        apply_motion(scene, rows[one.name], one.take, start)
        _update_tool(scene, rows[one.name].body, played_scene.plan.list_orders(one.name))
    apply_ball(scene, played_scene, start)
    _update_net(scene, result.order.scene.net)
    frame_range.extend_range(scene, start + played_scene.plan.seconds * frames_per_second(scene))
    settings.made_of = result.order.digest
    store_trajectories(result.order.digest, result.trajectories)
    settings.strikes = "\n".join(describe_strikes(scene, played_scene, start))
    settings.figures = "\n".join(list_figures(played_scene))
    settings.messages = "\n".join(list(dict.fromkeys([*messages, *played_scene.warnings]))[:MOST_LINES])


def clear_scene(scene: bpy.types.Scene) -> None:
    """Remove what was created for the scene; the user's own characters play their own motion again. The lists stay."""
    settings = scene.beyond_mocap_passes
    shown.check_characters(*settings.players)
    if settings.rally is not None:
        possession.check_unaimed(settings.rally)
        possession.remove_holds(scene, settings.rally)
    for row in settings.players:
        shown.release_character(row)
    if settings.rally is not None and settings.rally.get(KEPT):
        shown.remove_object(settings.rally)
    elif settings.rally is not None and settings.ball_before.kept:
        restore_playback(settings.ball_before, settings.rally, KEPT)
    discard_saved_state(settings.ball_before, KEPT)
    if (net := _find_net(scene)) is not None:
        shown.remove_object(net)
    for name in ("made_of", "strikes", "figures", "messages"):
        settings.property_unset(name)


def describe_strikes(scene: bpy.types.Scene, played_scene: "PlayedScene", start: float) -> list[str]:
    """Describe each strike in a line: its scene frame, a tab, and what happens."""
    found = []
    for number, one in enumerate(played_scene.plan.strikes):
        frame = round(start + one.order.time * frames_per_second(scene))
        gap, speed = played_scene.find_gap(number), np.linalg.norm(one.velocity_out)
        near = "" if np.isnan(gap) else f", {1000 * gap:.0f} mm"
        side = f"{one.order.side} " if one.order.side else ""
        result = f"{speed:.1f} m/s" if one.outcome == "struck" else one.outcome
        found.append(f"{frame}\t{one.player}: {side}{one.order.part}, {result}{near}")
    return found


def list_figures(played_scene: "PlayedScene") -> list[str]:
    """List lines "name: value" about the scene."""
    gaps = [gap for one in played_scene.players for gap in one.gaps if not np.isnan(gap)]
    speeds = [float(np.linalg.norm(one.velocity_out)) for one in played_scene.plan.strikes]
    return [f"Strikes: {len(played_scene.plan.strikes)}", f"Length: {played_scene.plan.seconds:.1f} s",
            f"Contact gap: {1000 * max(gaps, default=0.0):.1f} mm",
            f"Fastest ball: {max(speeds, default=0.0):.1f} m/s",
            f"Flights: {sum(one.travel for one in played_scene.plan.strikes):.1f} s"]


def apply_motion(scene: bpy.types.Scene, row: BeyondMocapPasser, take, start: float) -> None:
    """Apply one player's motion to their character, which is created or replaced if it does not fit.

    Args:
        scene: the scene.
        row: the player.
        take: anything with a `motion` and a `start_time` (s).
        start: scene frame of second 0.
    """
    room = bake.find_or_create_collection(scene)
    if row.shown is not None and row.shown != row.body:
        shown.release_character(row)
    if row.body is not None and not bake.is_matching(row.body, take, scene):
        shown.release_character(row)
        row.body = None
    target = row.body
    if target is None:
        target = armature.create_armature(bpy.context, take.motion.skeleton, row.name, room)
        target[KEPT] = True
        mesh = body.create_character(target, row.name, tuple(row.shirt), collection=room, scene=scene,
                                     example=take.motion)
        mesh[KEPT] = True
        row.body = target
    elif not target.get(KEPT) and not row.before.kept:
        save_playback(row.before, target)
    row.shown = target
    channels.remove_marked_action(target, KEPT)
    first = start + take.start_time * frames_per_second(scene)
    action.write_motion(target, take.motion, scene, first, f"{row.name} passes", generated=True)[KEPT] = True


def apply_ball(scene: bpy.types.Scene, played_scene: "PlayedScene", start: float) -> None:
    """Apply the ball's path to the ball, which is created if there is none.

    Args:
        scene: the scene.
        played_scene: anything with a `ball` and its `kind`.
        start: scene frame of second 0.
    """
    settings, path = scene.beyond_mocap_passes, played_scene.ball
    target = settings.rally
    if target is None or target.name not in scene.objects:
        collection = bake.find_or_create_collection(scene)  # not the sport's ball: it is as large as the passes say
        target = settings.rally = ball.create_ball(bpy.context, BALL, collection, ball.RADIUS)
        target[KEPT] = True
    if target.get(KEPT):
        target.scale = 3 * (played_scene.kind.radius / ball.RADIUS,)
    elif not settings.ball_before.kept:
        save_playback(settings.ball_before, target)

    def write_path() -> None:
        """Write the path to the ball's action."""
        channels.remove_marked_action(target, KEPT)
        first = start + float(path.times[0]) * frames_per_second(scene)
        ball.write_trajectory(target, path, scene, first)[KEPT] = True

    possession.replace_own_action(scene, target, write_path)


def _update_tool(scene, target: bpy.types.Object, orders) -> None:
    """Put the tool of a player's strikes in their hand, or remove it."""
    striking = next((order for order in orders if order.part == "tool"), None)
    if striking is None:
        shown.remove_tool(target)
    else:
        shown.create_tool(scene, target, striking.tool or Tool(), striking.side, bake.find_or_create_collection(scene))


def _update_net(scene, net: Net | None) -> None:
    """Create, update or remove the net."""
    found = _find_net(scene)
    if net is None:
        if found is not None:
            shown.remove_object(found)
        return
    mesh = bpy.data.meshes.new(NET)
    start, along = np.array(net.start), np.subtract(net.end, net.start)
    length = float(np.linalg.norm(along))
    columns, rows = (max(2, round(extent / MESH) + 1) for extent in (length, net.height))
    shape = bmesh.new()
    bmesh.ops.create_grid(shape, x_segments=columns - 1, y_segments=rows - 1, size=0.5)
    units = units_per_metre(scene)
    for vertex in shape.verts:
        x, y = start + (vertex.co.x + 0.5) * along
        vertex.co = (x * units, y * units, (vertex.co.y + 0.5) * net.height * units)
    bmesh.ops.delete(shape, geom=shape.faces[:], context="FACES_ONLY")
    shape.to_mesh(mesh)
    shape.free()
    if found is None:
        found = bpy.data.objects.new(NET, mesh)
        found[KEPT] = NET
        bake.find_or_create_collection(scene).objects.link(found)
    else:
        before, found.data = found.data, mesh
        bpy.data.meshes.remove(before)


def _find_net(scene) -> bpy.types.Object | None:
    """Find the net that this extension created."""
    return next((thing for thing in bake.find_or_create_collection(scene).objects if thing.get(KEPT) == NET),
                None)  # any name


def build_trajectories(plan: "PassPlan", ball: "Ball", start: float) -> Trajectories:
    """Build the trajectories of a plan."""
    ends = [*(flight.launch.time for flight in plan.flights[1:]), plan.seconds]
    flight_paths, bounces_met = [], []
    for flight, end in zip(plan.flights, ends):
        end = min(end, flight.end)
        bounces = flight.bounces[flight.bounces < end]
        times = np.unique(np.concatenate([np.arange(flight.launch.time, end, TRAJECTORY_STEP), bounces, [end]]))
        flight_paths.append(flight.at(times))
        bounces_met += list(flight.at(bounces) * [1.0, 1.0, 0.0]) if len(bounces) else []
    return Trajectories(start, np.array([flight.launch.time for flight in plan.flights]), tuple(flight_paths),
                        strike_times=np.array([one.order.time for one in plan.strikes]),
                        strikes=np.array([one.order.ball for one in plan.strikes]),
                        bounces=np.array(bounces_met).reshape(-1, 3),
                        candidates=tuple(_compute_candidates(one, ball) for one in plan.strikes))  # fmt: skip


def _compute_candidates(strike, ball: "Ball") -> np.ndarray:
    """Compute the trajectories (M, T, 3) m that the ball could have taken from a strike (Fig. 6, black).

    M is MOST_CANDIDATES at most.
    """
    from ...beyond_mocap.ball.batch import simulate_trajectories

    natural = strike.natural
    if natural is None or not len(natural.starts) or strike.travel <= 0.0:
        return np.zeros((0, 0, 3))
    few = slice(None, None, max(1, -(-len(natural.starts) // MOST_CANDIDATES)))
    times = np.linspace(0.0, strike.travel, max(2, int(strike.travel / (2 * TRAJECTORY_STEP))))
    return simulate_trajectories(natural.starts[few], natural.velocities[few], None, ball, times)[0]


def store_trajectories(digest: str, rally: Trajectories) -> None:
    """Store the trajectories of an order's `digest`, so that undo and redo find them."""
    _dragged.clear()
    _stored.pop(digest, None)
    _stored[digest] = rally
    while len(_stored) > MOST_RALLIES:
        _stored.pop(next(iter(_stored)))


def show_drag(rally: Trajectories | None) -> None:
    """Draw these trajectories while a place is dragged; None: stop."""
    _dragged[:] = [rally] if rally is not None else []


def has_trajectories() -> bool:
    """Whether there is anything to draw; fast, because every redraw asks."""
    return bool(_stored or _dragged)


def find_trajectories(scene: bpy.types.Scene) -> Trajectories | None:
    """Find the trajectories of a scene; None if this session has not generated it."""
    made_of = scene.beyond_mocap_passes.made_of
    if not made_of:
        return None
    return _dragged[0] if _dragged else _stored.get(made_of)


def clear_trajectories() -> None:
    """Clear all trajectories."""
    _stored.clear()
    _dragged.clear()
