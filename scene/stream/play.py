"""Play Live: while the scene plays, the holder of the ball repeats the user's strikes and passes to the chosen player.

`follow` detects the user's strikes. The pass is computed in a thread, from where all players stand, and inserted into
the running scene when it is ready. The characters and the ball are those of the passing scene.
"""

from __future__ import annotations

from dataclasses import dataclass
from types import SimpleNamespace
from typing import TYPE_CHECKING

import bpy

from ...beyond_mocap.base.errors import BeyondMocapError, InputError
from ...beyond_mocap.passes.hits import HitMotion
from ..core import action, background, channels
from ..core.live import Watcher
from ..core.measure import frames_per_second
from ..passes import make
from ..passes.settings import PLAYED
from ..result import bake
from . import follow

if TYPE_CHECKING:
    from ...beyond_mocap.library.library import Library
    from ...beyond_mocap.passes.live_passes import Piece, Rally

_held: dict[str, object] = {}


@dataclass(frozen=True, eq=False)
class Begun:
    """A rally that is ready to start.

    Attributes:
        order: as `generate.build_order` builds it.
        library: the library.
        rally: the rally.
    """

    order: make.Order
    library: Library
    rally: Rally


def begin(order: make.Order, holder: str, start: float, progress, cancelled) -> Begun:
    """Build the library if it is not loaded, and start a rally with all players standing. Does not use bpy."""
    from ...beyond_mocap.library.build import build
    from ...beyond_mocap.passes import live_passes

    library = order.library
    if library is None:
        library = build(order.folder, unit=order.unit, **order.build, progress=progress, cancelled=cancelled)
    return Begun(order, library, live_passes.begin(library, order.scene, holder, start=start, progress=progress,
                                                   cancelled=cancelled))


def show(scene: bpy.types.Scene, begun: Begun) -> None:
    """Apply a rally to characters and ball, and answer the user's strikes from now on."""
    stop()
    make.session.keep_library(begun.library, begun.order.unit)
    _held.update(scene=scene.session_uid, library=begun.library, rally=begun.rally, seen=None, took=0.0)
    for name in ("strikes", "figures", "told"):
        scene.beyond_mocap_passes.property_unset(name)
    scene.beyond_mocap_passes.made_of = PLAYED
    _lay(scene, begun.rally, [player.name for player in begun.rally.scene.players])
    follow.on_hit(struck)
    follow.on_look(look)
    _tell(scene)


def stop() -> None:
    """Stop answering; what was played stays."""
    background.stop("live")
    follow.forget(struck)
    follow.forget(look)
    _held.clear()


def rally() -> Rally | None:
    """The rally that is being played, or None."""
    return _held.get("rally")


def seconds(scene: bpy.types.Scene) -> float:
    """Compute the scene's time on the rally's clock."""
    return (scene.frame_current_final - scene.beyond_mocap_passes.start_frame) / frames_per_second(scene)


def target(scene: bpy.types.Scene) -> str:
    """Find the receiver of the next pass: the chosen player, otherwise the next one in the list."""
    names = [row.name for row in scene.beyond_mocap_passes.players]
    chosen, holder = scene.beyond_mocap_stream.target, rally().holder
    if chosen in names and chosen != holder:
        return chosen
    if not names:
        raise InputError("players", "the list is empty", "two or more", "choose a sample, and press Play Live again")
    return names[(names.index(holder) + 1) % len(names)] if holder in names else names[0]


def struck(_scene: bpy.types.Scene, hit: HitMotion, _seconds: float) -> None:
    """Store the user's strike; only the latest one counts."""
    _held["pending"] = hit


def shown_by(scene: bpy.types.Scene, body: bpy.types.Object) -> HitMotion:
    """Find the strike of an armature's own motion that is nearest to the current frame.

    Raises:
        InputError: if it has none.
    """
    from ...beyond_mocap.passes.hits import analyse

    settings, motion = scene.beyond_mocap_stream, action.read(body, scene)
    sided = settings.part in ("foot", "hand", "tool")
    sides = (("left", "right") if settings.side == "either" else (settings.side,)) if sided else ("",)
    hits = [hit for side in sides for hit in analyse(motion, settings.part, side, settings.threshold or None).motions]
    if not hits:
        raise InputError(f"armature {body.name}", f"no strike with the {settings.part}", "at least one",
                         "choose the part under Live Stream")
    now = scene.frame_current - (action.first_frame(body) or 0)
    return min(hits, key=lambda hit: (abs(hit.key - now), -hit.max_speed))


def look(scene: bpy.types.Scene) -> None:
    """Start a requested pass, or insert one that is ready."""
    if rally() is None or scene.session_uid != _held["scene"]:
        return
    if scene.beyond_mocap_passes.made_of != PLAYED:
        _over("The scene has been updated or cleared: press Play Live to continue")
        return
    _chosen(scene)
    job = _held.get("job")
    if job is not None:
        if job.poll():
            _held.pop("job")
            _ended(scene, job)
    elif _held.get("pending") is not None and seconds(scene) >= rally().free:
        try:
            order = _order(scene, _held.pop("pending"))
        except InputError as error:
            return _over(str(error))
        _held["job"] = background.Job("live", lambda progress, cancelled, _hurry: _answer(*order, progress, cancelled))


def answer_now(scene: bpy.types.Scene, hit: HitMotion) -> Piece:
    """Answer a strike at once, for scripts: the pass is computed and inserted before this returns."""
    if rally() is None:
        raise InputError("play live", "no rally is being played", "a rally", "press Play Live")
    piece = _answer(*_order(scene, hit), None, None)
    _apply(scene, piece)
    return piece


def _order(scene, hit: HitMotion) -> tuple:
    """Collect what a pass needs: library, rally, time, hit, receiver, bounces."""
    # not before the holder can act
    now = max(seconds(scene), rally().free)
    return _held["library"], rally(), now, hit, target(scene), scene.beyond_mocap_stream.bounces


def _answer(library, one, now: float, hit: HitMotion, to: str, bounces: int, progress, cancelled) -> Piece:
    from ...beyond_mocap.passes.live_passes import answer

    return answer(library, one, now, hit=hit, target=to, bounces=bounces, progress=progress, cancelled=cancelled)


def _ended(scene, job) -> None:
    """Insert a pass that is ready, or show its error."""
    try:
        if job.error is not None:
            raise job.error
        _apply(scene, job.result)
    except BeyondMocapError as error:
        bpy.context.window_manager.beyond_mocap_streaming.played = str(error)
        return
    if not bpy.app.background:
        bpy.ops.ed.undo_push(message="Live Pass")


def _apply(scene, piece: Piece) -> None:
    """Insert a pass into the scene from now on."""
    after = rally().after(piece, max(seconds(scene), rally().free))
    _lay(scene, after, list(piece.motions))
    _held["rally"] = after
    scene.beyond_mocap_stream.target = ""
    _tell(scene, piece)


def _lay(scene, one: Rally, names: list[str]) -> None:
    """Apply a rally's motions and ball to the named players."""
    from ...beyond_mocap.passes.passes import ball_of

    # players may have been renamed or removed since the rally started
    rows = {row.name: row for row in scene.beyond_mocap_passes.players}
    if missing := [name for name in names if name not in rows]:
        raise InputError("players", f"{missing[0]} is not in the list now", "the same players", "press Play Live again")
    channels.check_local(*(rows[name].body for name in names), scene.beyond_mocap_passes.rally)
    start = float(scene.beyond_mocap_passes.start_frame)
    for name in names:
        played = one.players[name]
        make.lay_body(scene, rows[name], SimpleNamespace(motion=played.motion, start_time=played.start), start)
    make.lay_ball(scene, SimpleNamespace(ball=one.ball, kind=ball_of(one.scene)), start)
    bake.lengthen(scene, start + float(one.ball.times[-1]) * frames_per_second(scene))


def _chosen(scene) -> None:
    """Make a player that has just been clicked the target."""
    active = bpy.context.view_layer.objects.active
    name = active.name if active is not None else None
    if name == _held.get("seen"):
        return
    _held["seen"] = name
    for row in scene.beyond_mocap_passes.players:
        # a player is clicked by character, mesh or place
        known = {row.body, row.place, *(row.body.children if row.body else ())}
        if active is not None and active in known and row.name != rally().holder:
            scene.beyond_mocap_stream.target = row.name


def _over(why: str) -> None:
    """End the rally with a message."""
    stop()
    told = bpy.context.window_manager.beyond_mocap_streaming
    told.playing, told.played = False, why


def _tell(scene, piece: Piece | None = None) -> None:
    """Write the state of the rally for the panel."""
    told, one = bpy.context.window_manager.beyond_mocap_streaming, rally()
    told.playing = True
    lines = [f"{one.holder} has the ball, passes so far: {one.passes}"]
    if piece is not None:
        lines.append(f"{piece.giver} played {piece.clip} to {piece.receiver}")
        lines += piece.warnings[:2]
    told.played = "\n".join(lines)


def _after_undo() -> None:
    """End the rally after an undo, which changes the scene that the rally knows."""
    if rally() is not None:
        _over("Undo has ended Play Live: press it to start again")


WATCHER = Watcher(name="Play Live", restored=_after_undo, closing=stop, ends=stop)
