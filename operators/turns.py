"""The queue of players: the operators that generate takes share a queue, a thread and one modal operator.

Called from a script, all takes are generated at once. Pressed as a button, players are queued: the first operator
processes the queue, later ones only add to it. Each player's result is stored as it arrives, with its own undo step,
and only if the player's request is still the same.
"""

from __future__ import annotations

import json
from time import perf_counter

import bpy
from bpy.props import StringProperty

from ..beyond_mocap.annotation import Timeline
from ..beyond_mocap.base.errors import BeyondMocapError, InputError
from ..scene.core import background, session
from ..scene.core.window import start_clock, stop_clock
from ..scene.player import dots
from ..scene.result import freshness, orders, plans, preview, quality, queue
from ..scene.timeline import strips
from .library import summary
from .verb import NEEDS_LIBRARY, Verb


def written(context, player, order, result) -> None:
    """Store the takes of a result in the session, show the first of them, and update what depends on it."""
    session.keep_library(result.library, order.unit)
    context.scene.beyond_mocap.library_holds = summary(result.library)
    shown = []
    for one in result.takes:
        lines = {"quality": quality.quality_lines(one.report),
                 "moments": quality.moment_lines(one.report),
                 "warnings": quality.warning_lines(one.report, order.warnings, result.library.notes),
                 "recipe": json.dumps(one.recipe),
                 "made_of": json.dumps(result.made_of)}
        shown.append((session.keep_take(one.plan, one.take, one.report), lines))
    preview.show(context, player, *shown[0])
    if player.drawn_track is not None:
        dots.renew(context, player)
    preview.keep_variants(player, [(name, lines, one.report) for (name, lines), one in zip(shown, result.takes)])
    freshness.dirty()
    show_automatic(context, player)


def show_automatic(context, player) -> None:
    """Update the player's automatic strips from its take.

    A player without strips, whose labels are in a text or a file, gets none, since strips would override them.
    """
    made = session.made(player.take)
    if strips.read(player, context.scene) is not None and (made is not None or not player.take):
        strips.set_automatic(context, player, made.take.timeline if made is not None else Timeline())


KIND = "synthesis"
BETWEEN = 0.2  # seconds between two redraws of the progress
TRIES = 3  # how often a player whose settings keep changing is started again
HOLDING = ("TRANSFORM_OT", "PAINT_OT", "SCULPT_OT", "POSE_OT", "VIEW3D_OT_select", "MESH_OT", "ARMATURE_OT")


class TurnsVerb(Verb):
    """Base of operators that generate takes. `list_requests(context)`: pairs of a player and the mode of its request.
    """

    player: StringProperty(name="Player", options={"SKIP_SAVE"}, description="Name of a player; empty for all selected")
    kind = "whole"
    needs = (*NEEDS_LIBRARY, "Import tracking and select a player in step 2 first",
             lambda context: any(player.use for player in context.scene.beyond_mocap.players))

    def wanted(self, context):
        """List the named player, or every selected one."""
        settings = context.scene.beyond_mocap
        if self.player and self.player not in settings.players:
            raise InputError("player", self.player, "a name in the list", "see step 2")
        players = [settings.players[self.player]] if self.player else plans.chosen(settings)
        return [(player, orders.How(self.kind)) for player in players]

    def entries(self, context) -> list[queue.Entry]:
        """Build the requests as queue entries."""
        settings = context.scene.beyond_mocap
        found = []
        for player, how in self.wanted(context):
            order = orders.order_of(settings, player, how)
            found.append(queue.Entry(context.scene.session_uid, player.name, how, order, order.fingerprint))
        return found

    def do(self, context):
        """Process all players at once: generate everything first, then store everything."""
        window = context.window_manager
        window.progress_begin(0, 100)
        try:
            entries = self.entries(context)
            made = []
            for number, entry in enumerate(entries):
                def tell(done, text, number=number):
                    window.progress_update(int(100 * (number + done) / len(entries)))

                library = made[0].library if made else _library(entry)
                made.append(orders.work(entry.order, library, tell, lambda: False, lambda: False))
        finally:
            window.progress_end()
        for entry, result in zip(entries, made):
            written(context, context.scene.beyond_mocap.players[entry.player], entry.order, result)
        players = [context.scene.beyond_mocap.players[entry.player] for entry in entries]
        names = ", ".join(player.name for player in players)
        self.report({"INFO"}, f"Generated: {names}{_kept(players)}; press Apply or Revert")

    def invoke(self, context, event):
        """Queue the players, and process the queue if no other operator does."""
        if bpy.app.background:
            return self.execute(context)
        try:
            entries = self.entries(context)
        except (BeyondMocapError, OSError) as error:
            return self.failed(str(error))
        for entry in entries:
            queue.add(entry)
        running = context.window_manager.beyond_mocap_work
        if queue.worked():
            running.waiting = "\n".join(queue.names())
            self.report({"INFO"}, f"Waiting: {', '.join(queue.names())}")
            return {"CANCELLED"}  # nothing has changed yet, so no undo step
        queue.work(True)
        self.entry, self.job, self.told, self.wrote = None, None, [], 0
        self.seen, self.drawn = None, 0.0
        self.clock = start_clock(context)
        context.window_manager.modal_handler_add(self)
        self.show(context, "Starting")
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Poll; after any error the queue is free again for the next operator."""
        try:
            return self.turn(context, event)
        except Exception:
            self.cancel(context)
            raise

    def turn(self, context, event):
        """Poll, pass on all other events, store what has arrived and start the next."""
        if event.type == "ESC" and event.value == "PRESS":
            queue.clear()
            if self.job is not None:
                self.job.cancel()
        elif event.type != "TIMER":
            return {"PASS_THROUGH"}
        if self.job is not None and not self.job.poll() and not self.job.ended and not self.job.stale:
            self.show(context, self.job.text)
            return {"RUNNING_MODAL"}
        if self.job is not None and not self.arrived(context):
            return {"RUNNING_MODAL"}
        self.next(context)
        if self.job is not None:
            return {"RUNNING_MODAL"}
        return self.over(context)

    def next(self, context):
        """Start the next waiting request that is still valid."""
        self.job = None
        while self.job is None and (entry := queue.take()) is not None:
            self.last = False
            scene = _scene(entry)
            player = _found(scene, entry) if scene is not None else None
            if player is None:
                self.tell(f"{entry.player} is no longer in the list and was skipped")
                continue
            try:
                entry.order = orders.order_of(scene.beyond_mocap, player, entry.how)
            except (BeyondMocapError, OSError) as error:
                self.tell(f"{entry.player}: {error}", "ERROR")
                continue
            entry.player, entry.fingerprint = player.name, entry.order.fingerprint
            self.entry, order, library = entry, entry.order, _library(entry)
            self.job = background.Job(KIND, lambda *asking: orders.work(order, library, *asking), keeps=True)
            self.show(context, "Starting")

    def arrived(self, context) -> bool:
        """Store the thread's result; False if that has to wait."""
        job, entry, self.last = self.job, self.entry, False
        if background.cancelled(job):
            self.tell(f"{entry.player}: cancelled, nothing has changed")
            return True
        if job.error is not None:
            if not isinstance(job.error, (BeyondMocapError, OSError)):
                raise job.error
            self.tell(str(job.error), "ERROR")
            return True
        scene = _scene(entry)
        if scene is None:
            self.tell(f"{entry.player}: the scene was removed, the take is discarded")
            return True
        window = next((window for window in context.window_manager.windows if window.scene == scene), None)
        if window is None or _holds(context):
            self.show(context, f"Ready; waits for scene {scene.name}" if window is None else "Finish the transform")
            return False
        player = _asking(scene, entry)
        if player is None:
            self.again(scene)
            return True
        if job.ending:
            queue.clear()
        with context.temp_override(window=window):
            ok = self.attempt(lambda: written(bpy.context, player, entry.order, job.result)) == {"FINISHED"}
            if ok and queue.names():  # the last one's undo step is the operator's own
                bpy.ops.ed.undo_push(message=f"{self.bl_label} {player.name}")
        self.wrote += ok
        self.last = ok
        if ok:
            self.tell(f"{player.name}: generated{_kept([player])}; press Apply or Revert")
        return True

    last = False  # whether the newest result was stored and has no undo step yet

    def again(self, scene):
        """Queue a player again whose request has changed, or discard the take."""
        entry = self.entry
        player = _found(scene, entry)
        if player is None:
            self.tell(f"{entry.player} is no longer in the list; the take is discarded")
        elif entry.tries >= TRIES:
            self.tell(f"{entry.player} keeps changing; the take is discarded, press {self.bl_label} again", "WARNING")
        else:
            self.tell(f"{entry.player} has changed and is generated again")
            queue.add(queue.Entry(entry.scene, player.name, entry.how, order=None, fingerprint="",
                                  tries=entry.tries + 1))

    def over(self, context):
        """Finish when the queue is empty."""
        self.close(context)
        for kind, text in self.told:
            self.report({kind}, text)
        if self.wrote > 1:
            self.report({"INFO"}, f"Players generated: {self.wrote}; press Apply or Revert")
        return {"FINISHED"} if self.last else {"CANCELLED"}

    def tell(self, text, kind="INFO"):
        """Store a message for the end: Blender shows a modal operator's reports only then."""
        self.told.append((kind, text))

    def cancel(self, context):
        """Stop when Blender ends the operator (a file is loaded, the window closes); the running job is discarded."""
        queue.clear()
        if self.job is not None:
            self.job.cancel()
        self.close(context)

    def show(self, context, text):
        """Show progress in the status bar, at the pointer and in the panel."""
        running, fraction = context.window_manager.beyond_mocap_work, self.job.fraction if self.job else 0.0
        name = self.entry.player if self.entry else ""
        running.kind, running.fraction, running.text = KIND, fraction, f"{name}: {text}" if name else text
        running.waiting = "\n".join(queue.names())
        running.ending = self.job is not None and self.job.ending
        seen = (running.text, int(100 * fraction), running.waiting, running.ending)
        if seen == self.seen or perf_counter() < self.drawn + BETWEEN:
            return
        self.seen, self.drawn = seen, perf_counter()
        context.window_manager.progress_update(int(100 * fraction))
        waiting = f"   then {', '.join(queue.names())}" if queue.names() else ""
        if context.workspace is not None:
            context.workspace.status_text_set(f"{running.text}   {fraction:.0%}{waiting}   ESC: cancel")
        _redraw(context)

    def close(self, context):
        """Remove progress display and timer."""
        running = context.window_manager.beyond_mocap_work
        queue.work(False)
        running.kind = running.waiting = ""
        stop_clock(context, self.clock)
        _redraw(context)


def _kept(players) -> str:
    """Describe how many hand-made keys these players' results have kept."""
    count = sum(player.result.hand_keys for player in players)
    return f", {count} hand-made {'key' if count == 1 else 'keys'} kept" if count else ""


def _library(entry: queue.Entry):
    return session.library(entry.order.folder, entry.order.unit)


def _scene(entry: queue.Entry):
    return next((scene for scene in bpy.data.scenes if scene.session_uid == entry.scene), None)


def _found(scene, entry: queue.Entry):
    """Find the player of an entry, under its new name if it was renamed; None where it was removed."""
    players = scene.beyond_mocap.players
    return players[entry.player] if entry.player in players else _asking(scene, entry)


def _asking(scene, entry: queue.Entry):
    """Find the player whose request equals the entry's; None where there is none."""
    players, busy = scene.beyond_mocap.players, queue.names()
    named = players.get(entry.player)
    for player in [named] if named is not None else [player for player in players if player.name not in busy]:
        try:
            if orders.order_of(scene.beyond_mocap, player, entry.how, still=True).fingerprint == entry.fingerprint:
                return player
        except (BeyondMocapError, OSError):
            continue
    return None


def _holds(context) -> bool:
    """Whether the user is moving, painting or selecting something."""
    running = [operator.bl_idname for window in context.window_manager.windows for operator in window.modal_operators]
    return any(name.startswith(HOLDING) for name in running)


def _redraw(context) -> None:
    """Redraw the sidebars of all 3D views."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()
