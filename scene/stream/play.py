"""Play live: while the scene plays, who has the ball does what the user does, and passes to whom the user has chosen.

What the user does is recognised by `follow`; the pass is worked out in a thread, from where all stand, and laid into
the running scene as soon as it is there. The bodies and the ball are those of the passing scene.
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
    """A rally that can begin. order: as `make.order_of` writes it; library; rally."""

    order: make.Order
    library: Library
    rally: Rally


def begin(order: make.Order, holder: str, start: float, progress, cancelled) -> Begun:
    """Build the library where it is not there yet, and let everybody stand. Never touches bpy."""
    from ...beyond_mocap.library.build import build
    from ...beyond_mocap.passes import live_passes

    library = order.library
    if library is None:
        library = build(order.folder, unit=order.unit, **order.build, progress=progress, cancelled=cancelled)
    return Begun(order, library, live_passes.begin(library, order.scene, holder, start=start, progress=progress,
                                                   cancelled=cancelled))


def show(scene: bpy.types.Scene, begun: Begun) -> None:
    """Lay it on bodies and ball, and answer the user's strikes from now on."""
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
    """Answer no more; what was played stays."""
    background.stop("live")
    follow.forget(struck)
    follow.forget(look)
    _held.clear()


def rally() -> Rally | None:
    """The rally that is played."""
    return _held.get("rally")


def seconds(scene: bpy.types.Scene) -> float:
    """Where the scene is, on the rally's clock."""
    return (scene.frame_current_final - scene.beyond_mocap_passes.start_frame) / frames_per_second(scene)


def target(scene: bpy.types.Scene) -> str:
    """To whom the next pass goes: who was chosen, else the next one of the list."""
    names = [row.name for row in scene.beyond_mocap_passes.players]
    chosen, holder = scene.beyond_mocap_stream.target, rally().holder
    if chosen in names and chosen != holder:
        return chosen
    if not names:
        raise InputError("players", "nobody is in the list", "two or more", "take a sample, and press Play Live again")
    return names[(names.index(holder) + 1) % len(names)] if holder in names else names[0]


def struck(_scene: bpy.types.Scene, hit: HitMotion, _seconds: float) -> None:
    """The user has struck: the newest strike counts."""
    _held["pending"] = hit


def shown_by(scene: bpy.types.Scene, body: bpy.types.Object) -> HitMotion:
    """The strike of an armature's own motion that is nearest to the present frame. InputError where there is none."""
    from ...beyond_mocap.passes.hits import analyse

    settings, motion = scene.beyond_mocap_stream, action.read(body, scene)
    sided = settings.part in ("foot", "hand", "tool")
    sides = (("left", "right") if settings.side == "either" else (settings.side,)) if sided else ("",)
    hits = [hit for side in sides for hit in analyse(motion, settings.part, side, settings.threshold or None).motions]
    if not hits:
        raise InputError(f"armature {body.name}", f"no strike of the {settings.part}", "one",
                         "choose the part under Live Stream")
    now = scene.frame_current - (action.first_frame(body) or 0)
    return min(hits, key=lambda hit: (abs(hit.key - now), -hit.max_speed))


def look(scene: bpy.types.Scene) -> None:
    """Begin a pass that is asked for, or lay one that is ready."""
    if rally() is None or scene.session_uid != _held["scene"]:
        return
    if scene.beyond_mocap_passes.made_of != PLAYED:
        _over("The scene has been made anew or cleared: press Play Live to go on")
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
    """The same at once, for scripts: the pass is worked out and laid before this comes back."""
    if rally() is None:
        raise InputError("play live", "nothing is played", "a rally", "press Play Live")
    piece = _answer(*_order(scene, hit), None, None)
    _apply(scene, piece)
    return piece


def _order(scene, hit: HitMotion) -> tuple:
    now = max(seconds(scene), rally().free)
    return _held["library"], rally(), now, hit, target(scene), scene.beyond_mocap_stream.bounces


def _answer(library, one, now: float, hit: HitMotion, to: str, bounces: int, progress, cancelled) -> Piece:
    from ...beyond_mocap.passes.live_passes import answer

    return answer(library, one, now, hit=hit, target=to, bounces=bounces, progress=progress, cancelled=cancelled)


def _ended(scene, job) -> None:
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
    """Lay a pass into the scene, from now on."""
    after = rally().after(piece, max(seconds(scene), rally().free))
    _lay(scene, after, list(piece.motions))
    _held["rally"] = after
    scene.beyond_mocap_stream.target = ""
    _tell(scene, piece)


def _lay(scene, one: Rally, names: list[str]) -> None:
    from ...beyond_mocap.passes.passes import ball_of

    rows = {row.name: row for row in scene.beyond_mocap_passes.players}
    if missing := [name for name in names if name not in rows]:
        raise InputError("players", f"{missing[0]} is gone from the list", "the same players", "press Play Live again")
    channels.check_local(*(rows[name].body for name in names), scene.beyond_mocap_passes.rally)
    start = float(scene.beyond_mocap_passes.start_frame)
    for name in names:
        played = one.players[name]
        make.lay_body(scene, rows[name], SimpleNamespace(motion=played.motion, start_time=played.start), start)
    make.lay_ball(scene, SimpleNamespace(ball=one.ball, kind=ball_of(one.scene)), start)
    bake.lengthen(scene, start + float(one.ball.times[-1]) * frames_per_second(scene))


def _chosen(scene) -> None:
    """A player that has just been clicked is the target."""
    active = bpy.context.view_layer.objects.active
    name = active.name if active is not None else None
    if name == _held.get("seen"):
        return
    _held["seen"] = name
    for row in scene.beyond_mocap_passes.players:
        known = {row.body, row.place, *(row.body.children if row.body else ())}
        if active is not None and active in known and row.name != rally().holder:
            scene.beyond_mocap_stream.target = row.name


def _over(why: str) -> None:
    """The rally ends by itself."""
    stop()
    told = bpy.context.window_manager.beyond_mocap_streaming
    told.playing, told.played = False, why


def _tell(scene, piece: Piece | None = None) -> None:
    told, one = bpy.context.window_manager.beyond_mocap_streaming, rally()
    told.playing = True
    lines = [f"{one.holder} has the ball, passes so far: {one.passes}"]
    if piece is not None:
        lines.append(f"{piece.giver} played {piece.clip} to {piece.receiver}")
        lines += piece.warnings[:2]
    told.played = "\n".join(lines)


def _after_undo() -> None:
    """What is undone is not what the rally knows any more."""
    if rally() is not None:
        _over("Undo has ended Play Live: press it to begin anew")


WATCHER = Watcher(name="Play Live", restored=_after_undo, closing=stop, ends=stop)
