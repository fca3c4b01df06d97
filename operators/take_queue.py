"""The queue of players: the operators that generate takes share a queue, a thread and one modal operator.

Called from a script, all takes are generated at once. Pressed as a button, players are queued: the first operator
processes the queue, later ones only add to it. Each player's result is stored as it arrives, with its own undo step,
and only if the player's request is still the same.
"""

import json
from time import perf_counter

import bpy
from bpy.props import StringProperty

from ..beyond_mocap import annotation
from ..beyond_mocap.base.errors import BeyondMocapError, InputError, format_count
from ..scene.core import background, notices, session
from ..scene.core.settings import describe_missed_moments
from ..scene.core.window import show_status, start_timer, stop_timer
from ..scene.player import dots
from ..scene.result import ball_tracks, freshness, plans, preview, quality, queue
from ..scene.result import synthesis_request as orders
from ..scene.timeline import strips
from .library.library import describe_gaps, describe_library
from .operator_base import NEEDS_LIBRARY, BaseOperator, describe_error


def show_library(scene, order) -> None:
    """Show what the library of an order holds, if it was built."""
    library = session.find_library(order.folder, order.unit)
    if library is not None:
        scene.beyond_mocap.library_holds = describe_library(library)
        scene.beyond_mocap.library_gaps = describe_gaps(library)


def store_result(context, player, order, result) -> None:
    """Store the takes of a result in the session, show the first of them, and update what depends on it."""
    session.store_library(result.library, order.unit)
    show_library(context.scene, order)
    stored = []
    for one in result.takes:
        lines = {"quality": quality.describe_quality(one.report),
                 "moments": quality.describe_moments(one.report),
                 "warnings": quality.describe_warnings(one.report, order.warnings, result.library.notes),
                 "recipe": json.dumps(one.recipe),
                 "made_of": json.dumps(result.made_of)}
        stored.append((session.store_take(one.plan, one.take, one.report), lines))
    preview.show_preview(context, player, *stored[0])
    if player.drawn_track is not None:
        dots.update_dot_track(context, player)
    preview.store_variants(player, [(name, lines, one.report) for (name, lines), one in zip(stored, result.takes)])
    freshness.mark_dirty()
    update_automatic_strips(context, player)


def update_automatic_strips(context, player) -> None:
    """Update the player's automatic strips from its take.

    A player without strips, whose labels are in a text or a file, gets none, since strips would override them.
    """
    stored = session.find_take(player.take)
    if strips.read_player_timeline(player, context.scene) is not None and (stored is not None or not player.take):
        timeline = stored.take.timeline if stored is not None else annotation.Timeline()
        strips.show_automatic_spans(context, player, timeline)


KIND = "synthesis"
REDRAW_INTERVAL = 0.2  # seconds between two redraws of the progress
MAX_TRIES = 3  # how often a player whose settings keep changing is started again
DRAG_OPERATORS = ("TRANSFORM_OT", "PAINT_OT", "SCULPT_OT", "POSE_OT", "VIEW3D_OT_select", "MESH_OT", "ARMATURE_OT")


class TakeOperator(BaseOperator):
    """Base of operators that generate takes. `list_requests(context)`: pairs of a player and the mode of its request.
    """

    player: StringProperty(name="Player", options={"SKIP_SAVE"}, description="Name of a player; empty for all selected")
    kind = "whole"
    stored_count = 0

    @property
    def presents(self):
        """The first body of a queue is framed; those that arrive later move no view."""
        return not self.stored_count

    needs = (*NEEDS_LIBRARY, "Import tracking and select a player in step 2 first",
             lambda context: any(player.use for player in context.scene.beyond_mocap.players))

    def list_requests(self, context):
        """List the named player, or every selected one."""
        settings = context.scene.beyond_mocap
        if self.player and self.player not in settings.players:
            raise InputError("player", self.player, "a name in the list", "see step 2")
        players = [settings.players[self.player]] if self.player else plans.list_selected_players(settings)
        return [(player, orders.SynthesisMode(self.kind)) for player in players]

    def build_entries(self, context) -> "list[queue.QueueEntry]":
        """Build the requests as queue entries."""
        settings = context.scene.beyond_mocap
        found = []
        for player, how in self.list_requests(context):
            self.current = player.name
            order = orders.build_request(settings, player, how)
            found.append(queue.QueueEntry(context.scene.session_uid, player.name, how, order, order.fingerprint))
        return found

    def do(self, context):
        """Process all players at once: generate everything first, then store everything."""
        entries = self.build_entries(context)
        try:
            results = self.process_entries(context.window_manager, entries)
        except BeyondMocapError:
            show_library(context.scene, entries[0].request)
            raise
        players = [context.scene.beyond_mocap.players[entry.player] for entry in entries]
        what = "Nothing has changed" if all(map(_is_unchanged, players, entries, results)) else "Generated"
        for player, entry, result in zip(players, entries, results):
            store_result(context, player, entry.request, result)
        self.clear_failures(context.scene, *(entry.player for entry in entries))
        if difference := ball_tracks.describe_difference(context.scene):
            self.report({"WARNING"}, str(difference))
        names = ", ".join(player.name for player in players)
        self.report({_rate(players)}, f"{what}: {names}{_describe_takes(players)}; press Apply or Revert")

    def process_entries(self, window, entries) -> "list[orders.RequestResult]":
        """Generate the takes of all entries, with the progress at the pointer."""
        results: list[orders.RequestResult] = []
        window.progress_begin(0, 100)
        try:
            for number, entry in enumerate(entries):
                self.current = entry.player

                def on_progress(done, text, number=number):
                    window.progress_update(int(100 * (number + done) / len(entries)))

                library = results[0].library if results else _find_library(entry)
                results.append(orders.process_request(entry.request, library, on_progress, lambda: False,
                                                      lambda: False))
        finally:
            window.progress_end()
        return results

    def invoke(self, context, event):
        """Queue the players, and process the queue if no other operator does."""
        if bpy.app.background:
            return self.execute(context)
        try:
            entries = self.build_entries(context)
        except (BeyondMocapError, OSError) as error:
            return self.report_failure(error)
        self.clear_failures(context.scene, *(entry.player for entry in entries))
        for entry in entries:
            queue.add_entry(entry)
        running = context.window_manager.beyond_mocap_work
        if queue.is_busy():
            running.waiting = "\n".join(queue.list_players())
            self.report({"INFO"}, f"Waiting: {', '.join(queue.list_players())}")
            return {"CANCELLED"}  # nothing has changed yet, so no undo step
        queue.set_busy(True)
        self.entry, self.job, self.stored_count = None, None, 0
        self.messages, self.failed = [], []
        self.seen, self.drawn = None, 0.0
        self.clock = start_timer(context)
        context.window_manager.modal_handler_add(self)
        self.show(context, "Starting")
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Poll; after any error the queue is free again for the next operator."""
        try:
            return self.handle_event(context, event)
        except Exception:
            self.cancel(context)
            raise

    def handle_event(self, context, event):
        """Poll, pass on all other events, store what has arrived and start the next."""
        if event.type == "ESC" and event.value == "PRESS":
            queue.clear_queue()
            if self.job is not None:
                self.job.cancel()
        elif event.type != "TIMER":
            return {"PASS_THROUGH"}
        if self.job is not None and not self.job.poll() and not self.job.is_ended and not self.job.is_stale:
            self.show(context, self.job.describe_progress())
            return {"RUNNING_MODAL"}
        if self.job is not None and not self.store_arrived(context):
            return {"RUNNING_MODAL"}
        self.start_next(context)
        if self.job is not None:
            return {"RUNNING_MODAL"}
        return self.finish(context)

    def start_next(self, context):
        """Start the next waiting request that is still valid."""
        self.job = None
        while self.job is None and (entry := queue.pop_entry()) is not None:
            self.last = False
            scene = _find_scene(entry)
            player = _find_player(scene, entry) if scene is not None else None
            if player is None:
                self.add_message(f"{entry.player} is no longer in the list and was skipped")
                continue
            try:
                entry.request = orders.build_request(scene.beyond_mocap, player, entry.mode)
            except (BeyondMocapError, OSError) as error:
                self.add_failure(entry, error)
                continue
            entry.player, entry.fingerprint = player.name, entry.request.fingerprint
            self.entry, order, library = entry, entry.request, _find_library(entry)
            self.job = background.Job(KIND, lambda *asking: orders.process_request(order, library, *asking),
                                      can_end_early=True)
            self.show(context, "Starting")

    def store_arrived(self, context) -> bool:
        """Store the thread's result; False if that has to wait."""
        job, entry, self.last = self.job, self.entry, False
        if background.is_cancelled(job):
            self.add_message(f"{entry.player}: cancelled, nothing has changed")
            return True
        if job.error is not None:
            if not isinstance(job.error, (BeyondMocapError, OSError)):
                raise job.error
            self.add_failure(entry, job.error)
            if (scene := _find_scene(entry)) is not None:
                show_library(scene, entry.request)
            return True
        scene = _find_scene(entry)
        if scene is None:
            self.add_message(f"{entry.player}: the scene was removed, the take is discarded")
            return True
        window = next((window for window in context.window_manager.windows if window.scene == scene), None)
        if window is None or _is_user_dragging(context):
            self.show(context, f"Ready; waits for scene {scene.name}" if window is None else "Finish the transform")
            return False
        player = _find_matching_player(scene, entry)
        if player is None:
            self.requeue(scene)
            return True
        if job.is_ending:
            queue.clear_queue()
        what = "nothing has changed" if _is_unchanged(player, entry, job.result) else "generated"
        with context.temp_override(window=window):
            ok = self.attempt(lambda: store_result(bpy.context, player, entry.request, job.result)) == {"FINISHED"}
            if ok and queue.list_players():  # the last one's undo step is the operator's own
                bpy.ops.ed.undo_push(message=f"{self.bl_label} {player.name}")
        self.stored_count, self.last = self.stored_count + ok, ok
        if ok:
            text = f"{player.name}: {what}{_describe_takes([player])}; press Apply or Revert"
            self.add_message(text, _rate([player]))
        return True

    current = ""  # the player whose request is built or processed
    last = False  # whether the newest result was stored and has no undo step yet

    def requeue(self, scene):
        """Queue a player again whose request has changed, or discard the take."""
        entry = self.entry
        player = _find_player(scene, entry)
        if player is None:
            self.add_message(f"{entry.player} is no longer in the list; the take is discarded")
        elif entry.tries >= MAX_TRIES:
            self.add_message(f"{entry.player} keeps changing; the take is discarded, press {self.bl_label} again",
                             "WARNING")
        else:
            self.add_message(f"{entry.player} has changed and is generated again")
            queue.add_entry(queue.QueueEntry(entry.scene, player.name, entry.mode, request=None, fingerprint="",
                                             tries=entry.tries + 1))

    def finish(self, context):
        """Finish when the queue is empty."""
        self.close_progress(context)
        for kind, text in self.messages:
            self.report({kind}, text)
        if self.failed and self.pops_up:
            notices.show_notices(min(self.failed))
        if self.stored_count and (difference := ball_tracks.describe_difference(context.scene)):
            self.report({"WARNING"}, str(difference))
        if self.stored_count > 1:
            self.report({"INFO"}, f"Players generated: {self.stored_count}; press Apply or Revert")
        return {"FINISHED"} if self.last else {"CANCELLED"}

    @classmethod
    def find_room(cls) -> str:
        """Return the feature whose panel shows these operators' notices."""
        return "synthesis"

    def post_failure(self, error, topic: str = "", player: str = "") -> int:
        """Post a notice about the player whose take failed, which the player's next take replaces."""
        player = player or self.current
        return super().post_failure(error, topic or (_name_topic(player) if player else ""), player)

    def add_failure(self, entry: "queue.QueueEntry", error):
        """Post a notice of a failed entry, and store its line for the end."""
        self.failed.append(self.post_failure(error, player=entry.player))
        line = str(describe_error(error))
        self.add_message(line if entry.player in line else f"{entry.player}: {line}", "WARNING")

    def clear_failures(self, scene, *players: str):
        """Clear the notices about earlier failures of these players."""
        notices.clear_notices(scene, type(self).bl_idname, *map(_name_topic, players))

    def add_message(self, text, kind="INFO"):
        """Store a message for the end: Blender shows a modal operator's reports only then."""
        self.messages.append((kind, text))

    def cancel(self, context):
        """Stop when Blender ends the operator (a file is loaded, the window closes); the running job is discarded."""
        queue.clear_queue()
        if self.job is not None:
            self.job.cancel()
        self.close_progress(context)

    def show(self, context, text):
        """Show progress in the status bar, at the pointer and in the panel."""
        running, fraction = context.window_manager.beyond_mocap_work, self.job.fraction if self.job else 0.0
        name = self.entry.player if self.entry else ""
        running.kind, running.fraction, running.text = KIND, fraction, f"{name}: {text}" if name else text
        running.waiting = "\n".join(queue.list_players())
        running.ending = self.job is not None and self.job.is_ending
        seen = (running.text, int(100 * fraction), running.waiting, running.ending)
        if seen == self.seen or perf_counter() < self.drawn + REDRAW_INTERVAL:
            return
        self.seen, self.drawn = seen, perf_counter()
        context.window_manager.progress_update(int(100 * fraction))
        waiting = f"   then {', '.join(queue.list_players())}" if queue.list_players() else ""
        show_status(f"{running.text}{waiting}   ESC: cancel")
        _redraw_sidebars(context)

    def close_progress(self, context):
        """Remove progress display and timer."""
        running = context.window_manager.beyond_mocap_work
        queue.set_busy(False)
        running.kind = running.waiting = ""
        stop_timer(context, self.clock)
        _redraw_sidebars(context)


def _is_unchanged(player, entry: "queue.QueueEntry", result) -> bool:
    """Return whether an update had the inputs of the take that the player has and a body shows: a quick one has other
    frames, and no figures.
    """
    is_quick = "\tmet" not in player.quality and "\tmissed" not in player.quality
    if entry.mode.kind != "update" or is_quick or freshness.describe_body_problem(player.id_data, player):
        return False
    return json.loads(player.result.made_of or "{}") == result.made_of


def _name_topic(player: str) -> str:
    """Name the topic of notices about a player's take."""
    return f"take {player}"


def _describe_takes(players) -> str:
    """Describe what to know about these players' takes: missed moments, and manual keys that they have kept."""
    missed, count = describe_missed_moments(players), sum(player.result.hand_keys for player in players)
    return (f", {missed}" if missed else "") + (f", {format_count(count, 'manual key')} kept" if count else "")


def _rate(players) -> str:
    """Return the kind of the report about these players' takes."""
    return "WARNING" if describe_missed_moments(players) else "INFO"


def _find_library(entry: "queue.QueueEntry"):
    return session.find_library(entry.request.folder, entry.request.unit)


def _find_scene(entry: "queue.QueueEntry"):
    return next((scene for scene in bpy.data.scenes if scene.session_uid == entry.scene), None)


def _find_player(scene, entry: "queue.QueueEntry"):
    """Find the player of an entry, under its new name if it was renamed; None where it was removed."""
    players = scene.beyond_mocap.players
    return players[entry.player] if entry.player in players else _find_matching_player(scene, entry)


def _find_matching_player(scene, entry: "queue.QueueEntry"):
    """Find the player whose request equals the entry's; None where there is none."""
    players, busy = scene.beyond_mocap.players, queue.list_players()
    named = players.get(entry.player)
    for player in [named] if named is not None else [player for player in players if player.name not in busy]:
        try:
            if orders.build_request(scene.beyond_mocap, player, entry.mode,
                                    still=True).fingerprint == entry.fingerprint:
                return player
        except (BeyondMocapError, OSError):
            continue
    return None


def _is_user_dragging(context) -> bool:
    """Whether the user is moving, painting or selecting something."""
    running = [operator.bl_idname for window in context.window_manager.windows for operator in window.modal_operators]
    return any(name.startswith(DRAG_OPERATORS) for name in running)


def _redraw_sidebars(context) -> None:
    """Redraw the sidebars of all 3D views."""
    for window in context.window_manager.windows:
        for area in window.screen.areas:
            if area.type == "VIEW_3D":
                for region in area.regions:
                    if region.type == "UI":
                        region.tag_redraw()
