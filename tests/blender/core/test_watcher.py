"""The one watcher: what raises does not end it, undo between two looks leaves nothing of what was undone, and nothing
is left of it when the extension is switched off in the middle of anything."""

import contextlib
import importlib
import pathlib
import threading
import time
from types import SimpleNamespace

import bpy
import pytest
from conftest import EXTENSION, find_free_port
from test_players import match, ready, session  # noqa: F401  (fixtures)
from test_turns import Context, Windows, hand  # noqa: F401
from undo import collect_state

SAMPLE = pathlib.Path(__file__).resolve().parents[3] / "sample_blend" / "library"


@pytest.fixture(autouse=True)
def clocks(monkeypatch):
    """Blender's own timers of windows, with the stand-in for all else."""
    def add(_self, *_, **__):
        return bpy.context.window_manager.event_timer_add(0.05, window=bpy.context.window)

    monkeypatch.setattr(Windows, "event_timer_add", add)


@pytest.fixture
def room():
    return lambda name: importlib.import_module(f"{EXTENSION}.{name}")


@pytest.fixture
def live(room):
    return room("scene.core.live")


class StandInContext:
    """Blender's context, but for its windows."""

    def __init__(self):
        self.window_manager = StandInManager()

    def __getattr__(self, name):
        return getattr(bpy.context, name)

    def temp_override(self, **_):
        return contextlib.nullcontext()


class StandInManager:
    """Blender's window manager, but for its windows."""

    def __getattr__(self, name):
        return getattr(bpy.context.window_manager, name)


class Windowed:
    """Blender's `bpy`, but for the window that it has and what the status bar says."""

    def __init__(self):
        self.app = SimpleNamespace(background=False, timers=bpy.app.timers, handlers=bpy.app.handlers,
                                   is_job_running=bpy.app.is_job_running)
        self.said, self.context = [], StandInContext()
        self.context.window_manager.windows = [SimpleNamespace(
            workspace=SimpleNamespace(status_text_set=self.said.append), screen=SimpleNamespace(areas=[]),
            cursor_modal_restore=lambda: None)]

    def __getattr__(self, name):
        return getattr(bpy, name)


@pytest.fixture
def windowed(extension, room, live, monkeypatch):
    """The extension as it is registered where there is a window; as it was before, in the end."""
    extension.unregister()
    stand_in = Windowed()
    monkeypatch.setattr(live, "bpy", stand_in)
    monkeypatch.setattr(room("scene.core.window"), "bpy", stand_in)
    extension.register()
    yield stand_in
    extension.unregister()
    monkeypatch.undo()
    extension.register()


def planted(live, **does):
    watcher = live.Watcher(name="Planted", **does)
    live._watchers.remove(watcher)
    return watcher


def test_what_raises_is_reported_once_and_the_next_look_comes(live, capsys):
    looks = []

    def look():
        looks.append(1)
        raise ValueError("planted trouble")

    watcher = planted(live, look=look, restored=look)
    assert [watcher.run_tick() for _ in range(3)] == [live.IDLE] * 3
    watcher.handle_event("restored")
    assert len(looks) == 4 and watcher.dirty
    assert capsys.readouterr().err.count("ValueError: planted trouble") == 1
    work = bpy.context.window_manager.beyond_mocap_work
    assert work.trouble == "Planted has failed; see the system console"
    bpy.ops.wm.read_homefile(use_empty=True)
    assert bpy.context.window_manager.beyond_mocap_work.trouble == ""


@pytest.mark.parametrize("does", [
    {"look": "act"}, {"settle": "act"}, {"follow": "act"}, {"saving": "act"},
])
def test_what_has_failed_is_said_until_it_succeeds(live, does):
    fails, work = [True, False], bpy.context.window_manager.beyond_mocap_work

    def act(*_):
        if fails.pop(0):
            raise ValueError("planted trouble")
        return 1.0

    what, = does
    watcher = planted(live, changed=lambda *_: None, **{what: act})

    def again():
        if what == "saving":
            watcher.handle_event(what)
            return
        watcher.mark_dirty()
        watcher.changed_at -= live.IDLE_SECONDS
        watcher.run_tick()

    again()
    assert work.trouble == "Planted has failed; see the system console"
    live.call_guarded("Another", lambda: None)
    if what in ("settle", "follow"):
        watcher.run_tick()  # there is nothing to do
        watcher.handle_event("changed", None, None)
    assert work.trouble == "Planted has failed; see the system console" and len(fails) == 1
    again()
    assert work.trouble == "" and not fails


def test_what_could_not_be_updated_is_said_until_it_can(live):
    told, work = [], bpy.context.window_manager.beyond_mocap_work
    live.call_or_describe(lambda: 1 / 0, told.append, "Ann: could not be updated")
    assert told == [work.trouble] == ["Ann: could not be updated; see the system console"]
    live.call_or_describe(lambda: None, told.append, "Ben: could not be updated")
    assert work.trouble == told[0]
    assert live.call_or_describe(lambda: 7, told.append, "Ann: could not be updated") == 7
    assert work.trouble == "" and len(told) == 1


def test_a_wish_of_meanwhile_is_not_lost(live):
    """What is marked while it settles is looked at again; what rests is not."""
    answers = [True, False]
    watcher = planted(live, settle=lambda scene: answers.pop(0))
    for left in (1, 0, 0):
        watcher.run_tick()
        assert len(answers) == left
    watcher = planted(live, settle=lambda scene: watcher.mark_dirty())
    watcher.run_tick()
    assert watcher.dirty


def test_it_waits_until_the_hand_rests(live, monkeypatch):
    seen, holds = [], [True]
    monkeypatch.setattr(live, "is_running", lambda names: "TRANSFORM_OT" in names and "A_OT_b" in names and holds[0])
    watcher = planted(live, busy_operators=("A_OT_b",), settle=lambda scene: seen.append("settle"),
                      dragged=lambda scene: seen.append("drag"))
    watcher.run_tick()
    holds[0] = False
    watcher.mark_dirty()
    watcher.run_tick()
    assert seen == ["drag"]
    watcher.changed_at -= live.IDLE_SECONDS
    watcher.run_tick()
    assert seen == ["drag", "settle"]


def test_what_is_to_come_soon_comes_once_and_as_often_as_it_asks(live, windowed):
    waits = [0.1, None]

    def action():
        live.call_soon(action, 0.1)  # while it runs
        return waits.pop(0)

    live.call_soon(action, 0.1)
    live.call_soon(action, 0.1)
    call = live._timers[action]
    assert call() is None and live._timers[action] is not call  # the newer one goes on
    newer = live._timers.pop(action)
    bpy.app.timers.unregister(call)
    bpy.app.timers.unregister(newer)
    assert action not in live._timers


def rider(room):
    """A body on a path, looked at; and the file as it is then."""
    bpy.ops.beyond_mocap.import_clips(filepath=str(SAMPLE / "walking_1_2.bvh"))
    body = bpy.context.object
    bpy.ops.beyond_mocap.edit_path()
    look(room)
    bpy.ops.ed.undo_push(message="on a path")
    return body


def look(room):
    """What the timer does once something has changed."""
    watcher = room("scene.path_editing.live").WATCHER
    watcher.mark_dirty()
    watcher.run_tick()
    assert not watcher.dirty


@pytest.mark.parametrize("order", ["edit push", "edit push look", "edit look push", "edit look push look",
                                   "edit look edit push", "edit push look look"])
def test_undo_between_two_looks_brings_everything_back(room, order):
    """Whichever looks come before and after the step that undo takes back, nothing of what they wrote is left after the
    next one; and redo likewise."""
    rider(room)
    before = collect_state()
    for what in order.split():
        if what == "edit":
            bpy.context.object.data.splines[0].bezier_points[1].co.y += 1.0
            bpy.context.view_layer.update()
        elif what == "push":
            bpy.ops.ed.undo_push(message="moved")
        else:
            look(room)
    moved = [*collect_state()["drawn"].values()]
    bpy.ops.ed.undo()
    assert room("scene.path_editing.live").WATCHER.dirty  # it has heard of the undo, which no change has to tell
    room("scene.path_editing.live").WATCHER.run_tick()
    assert collect_state() == before
    bpy.ops.ed.redo()
    room("scene.path_editing.live").WATCHER.run_tick()
    after = collect_state()
    assert [*after["drawn"].values()] == moved and after["keys"] != before["keys"]
    bpy.ops.ed.undo()
    room("scene.path_editing.live").WATCHER.run_tick()
    assert collect_state() == before


def test_update_then_a_look_then_undo_is_one_step(room):
    """Live looks between the button and undo, and between undo and redo."""
    rider(room)
    bpy.context.object.data.splines[0].bezier_points[1].co.y += 1.0
    bpy.ops.ed.undo_push(message="moved")
    moved = collect_state()
    assert bpy.ops.beyond_mocap.update_path("EXEC_DEFAULT", True) == {"FINISHED"}
    after = collect_state()
    look(room)
    assert collect_state() == after
    bpy.ops.ed.undo()
    assert collect_state() == moved
    bpy.ops.ed.redo()
    look(room)
    assert collect_state() == after


def test_what_undo_has_taken_back_is_neither_measured_nor_drawn(room, monkeypatch):
    """Figures that a thread works out while undo comes between are those of another motion."""
    riders, measure = room("scene.path_editing.edited_bodies"), room("scene.path_editing.live")
    body, go = rider(room), threading.Event()
    name = body.name
    body.beyond_mocap_ride.live = False
    bpy.ops.ed.undo_push(message="not live")
    figures = body.beyond_mocap_ride.figures
    bpy.context.object.location.y += 1.0
    bpy.context.view_layer.update()
    riders.update_motion(bpy.context.scene, body)
    bpy.ops.ed.undo_push(message="moved")
    monkeypatch.setattr(measure, "REST", 0.0)
    monkeypatch.setattr(measure, "_measure_edit", lambda *_: go.wait(10.0) and {"root_error_m": "of what was undone"})
    while not measure._running:
        measure.FIGURES.run_tick()
    job = measure._running[0][0]
    bpy.ops.ed.undo()
    body = bpy.data.objects[name]
    go.set()
    while not job.poll():
        time.sleep(0.01)
    for _ in range(5):
        measure.FIGURES.run_tick()
    assert body.beyond_mocap_ride.figures == figures and riders.find_computed_edit(body) is None
    bpy.ops.ed.redo()
    assert riders.find_computed_edit(bpy.data.objects[name]) is not None


def left_over(room):
    """What of ours Blender would still call, and what nothing has asked to end."""
    found = [f"{name}: {function}" for name in dir(bpy.app.handlers)
             if isinstance(functions := getattr(bpy.app.handlers, name), list)
             for function in functions if function.__module__.startswith(EXTENSION)]
    found += [f"menu: {function}" for name in dir(bpy.types) for function in drawn_in(getattr(bpy.types, name))
              if function.__module__.startswith(EXTENSION)]
    window, live = room("scene.core.window"), room("scene.core.live")
    found += [*map(str, (*window._draw_handlers, *window._timers, *live._timers,
                         *room("scene.result.queue").list_players()))]
    found += [job.kind for job in room("scene.core.background")._newest.values() if not job.is_stale]
    found += [f"stream {number}" for number in room("scene.stream.follow")._streams]
    found += ["rally"] if room("scene.stream.play").get_current_rally() is not None else []
    return found + ["queue"] * room("scene.result.queue").is_busy()


def drawn_in(menu):
    return getattr(getattr(menu, "draw", None), "_draw_funcs", ())


def endless(progress, cancelled, _hurry=None):
    while not cancelled():
        progress(0.5, "half")
        time.sleep(0.01)


def a_background_job(room, context):
    """A button whose work goes on in a thread, as Build Library or Make Match."""
    button = room("operators.operator_base").BackgroundOperator()
    button.bl_label, button.kind = "Button", "test"
    button.job = room("scene.core.background").Job("test", endless)
    context.workspace = SimpleNamespace(status_text_set=lambda text: None)
    button.start_polling(context)
    while not button.job.fraction:
        button.modal(context, SimpleNamespace(type="TIMER"))


def a_match_child(room, _context):
    """The process that makes a match. As the command does, it listens to the signal itself: a shell's background job
    would ignore it."""
    child, background = room("scene.match.command_process"), room("scene.core.background")
    script = ("import signal, sys, time; signal.signal(signal.SIGINT, signal.default_int_handler);"
              "print('{\"progress\": 0.5}', file=sys.stderr, flush=True); time.sleep(60)")
    child.subprocess, kept = SimpleNamespace(**vars(child.subprocess)), child.subprocess
    child.subprocess.Popen = lambda command, **options: kept.Popen([command[0], "-c", script], **options)
    try:
        job = background.Job("match", lambda progress, cancelled, _: child.run_command(["match"], progress, cancelled))
        while not job.fraction:
            job.poll()
    finally:
        child.subprocess = kept


def two_streams(room, _context):
    first = bpy.context.scene.beyond_mocap_stream
    bpy.ops.beyond_mocap.stream_list(what="ADD")
    for stream in (first, first.further[0]):
        stream.port = find_free_port()
        room("scene.stream.follow").start_listening(stream)


def a_live_update(room, _context):
    """Throws, flights, overlays and figures are worked out in threads of their own."""
    job = room("scene.core.background").Job
    jobs = [job(room(f"scene.{name}").KIND, endless)
            for name in ("throws.preview", "passes.live", "overlays.store", "path_editing.live")]
    room("scene.throws.preview")._state["job"] = "body", 0, jobs[0]
    room("scene.passes.live")._running.append(jobs[1])
    room("scene.overlays.store")._running.append((jobs[2], "take"))
    room("scene.path_editing.live")._running.append((jobs[3], 0, 0))
    room("scene.core.live").call_soon(room("scene.timeline.strip_events")._run_scheduled, 0.1)


def a_menu_of_words(room, _context):
    """Annotate by Keys draws over every editor of time and space."""
    room("operators.timeline.annotate")._start_drawing()


STARTS = (a_background_job, a_match_child, two_streams, a_live_update, a_menu_of_words)


def assert_nothing_is_left(extension, room, windowed):
    assert room("scene.core.live")._timers and room("scene.core.window")._draw_handlers
    room("scene.core.window").show_status("Searching")
    timers = [*room("scene.core.live")._timers.values()]
    assert all(map(bpy.app.timers.is_registered, timers))
    extension.unregister()
    left = left_over(room) + [str(one) for one in timers if bpy.app.timers.is_registered(one)]
    end = time.monotonic() + 30.0
    while (at_work := still_at_work(room)) and time.monotonic() < end:
        time.sleep(0.02)
    extension.register()
    work = bpy.context.window_manager.beyond_mocap_work
    said = windowed.said[-1], room("scene.core.window")._status
    assert (left, at_work, said, work.kind, work.waiting) == ([], [], (None, []), "", "")


def still_at_work(room):
    """Threads and processes of ours: asked to end, they take a moment."""
    threads = [one.name for one in threading.enumerate() if one.name.startswith("beyond-mocap")]
    return threads + [str(one) for one in room("scene.match.command_process")._running if one.poll() is None]


@pytest.mark.parametrize("start", STARTS, ids=lambda start: start.__name__)
def test_switched_off_in_the_middle_nothing_is_left(start, extension, room, windowed):
    start(room, Context())
    assert_nothing_is_left(extension, room, windowed)


def test_switched_off_while_players_are_made_nothing_is_left(hand, extension, room, windowed):  # noqa: F811
    hand.pause = 20.0
    button = hand.press()
    hand.run(button, until=lambda: button.job is not None and button.job.fraction == 0.5)
    hand.queue.set_busy(True)
    button.clock = room("scene.core.window").start_timer(hand.context)
    assert hand.context.window_manager.beyond_mocap_work.kind and hand.queue.list_players()
    assert_nothing_is_left(extension, room, windowed)
