"""Players take turns in a thread: whatever happens meanwhile, only what a player still asks for is written."""

import importlib
import time
from types import SimpleNamespace

import bpy
import pytest
from test_players import match, ready, session  # noqa: F401  (fixtures)

TIMER, ESC, MOVE = (SimpleNamespace(type=t, value="PRESS") for t in ("TIMER", "ESC", "MOUSEMOVE"))


class Windows:
    """Stands in for the window manager of a Blender with one window."""

    def __init__(self):
        self.holding = []
        self.scene = None

    @property
    def beyond_mocap_work(self):
        """Asked for each time: what Blender gave before the extension was switched off is freed memory after it."""
        return bpy.context.window_manager.beyond_mocap_work

    @property
    def windows(self):
        operators = [SimpleNamespace(bl_idname=name) for name in self.holding]
        screen = SimpleNamespace(areas=())
        return [SimpleNamespace(scene=self.scene or bpy.context.scene, modal_operators=operators, screen=screen)]

    def event_timer_add(self, *_, **__):
        return "timer"

    event_timer_remove = progress_begin = progress_update = progress_end = modal_handler_add = event_timer_add


class Context:
    """Blender's context with that window."""

    window = workspace = None

    def __init__(self):
        self.window_manager = Windows()

    def __getattr__(self, name):
        return getattr(bpy.context, name)

    def temp_override(self, **_):
        return bpy.context.temp_override()


@pytest.fixture
def hand(extension, ready, session, monkeypatch):  # noqa: F811
    """Presses the button and lets time pass, as a window does; `hand.pause` holds the work up."""
    rooms = {name: importlib.import_module(f"{extension.__name__}.{name}") for name in ("operators.take_queue",
            "scene.result.synthesis_request", "scene.result.queue", "scene.core.background")}
    turns, orders, queue, background = rooms.values()
    bpy.ops.beyond_mocap.build_library()
    real, hand = orders.process_request, SimpleNamespace(
        pause=0.0, made=[], told=[], context=Context(), queue=queue, orders=orders
    )

    def work(order, library, progress, cancelled, hurry):
        progress(0.5, "half")
        end = time.monotonic() + hand.pause
        while time.monotonic() < end and not cancelled() and not hurry():
            time.sleep(0.005)
        hand.made.append(order)
        return real(order, library, progress, cancelled, lambda: False)

    monkeypatch.setattr(orders, "process_request", work)

    class Button(turns.TakeOperator):
        bl_idname, bl_label, player = "beyond_mocap.synthesize", "Synthesize", ""

        def report(self, kind, text):
            hand.told.append(text)

    def press(how=None):
        button = Button()
        if how:
            button.list_requests = lambda context: how
        for entry in button.build_entries(hand.context):
            queue.add_entry(entry)
        button.entry, button.job, button.messages, button.failed, button.stored_count = None, None, [], [], 0
        button.seen, button.drawn, button.clock = None, 0.0, "timer"
        return button

    def run(button, event=TIMER, limit=120.0, until=lambda: False):
        end = time.monotonic() + limit
        while time.monotonic() < end and not until():
            status = button.modal(hand.context, event)
            event = TIMER
            if status != {"RUNNING_MODAL"}:
                return status
            time.sleep(0.005)
        assert until(), f"did not end: {hand.told}"

    hand.press, hand.run, hand.background = press, run, background
    yield hand
    queue.clear_queue()
    background.cancel_jobs()


def states():
    return [player.result.state for player in bpy.context.scene.beyond_mocap.players]


def test_each_result_is_written_as_it_arrives(hand, ready):  # noqa: F811
    button = hand.press()
    assert hand.queue.list_players() == ["player1", "player2"]
    hand.run(button, until=lambda: states()[0] == "PREVIEW")
    assert states() == ["PREVIEW", "NONE"]
    assert hand.run(button) == {"FINISHED"}
    assert states() == ["PREVIEW", "PREVIEW"] and not hand.context.window_manager.beyond_mocap_work.kind
    assert button.modal(hand.context, MOVE) == {"PASS_THROUGH"}


def test_escape_cancels_all(hand):
    hand.pause = 5.0
    button = hand.press()
    hand.run(button, until=lambda: button.job is not None)
    assert hand.run(button, ESC, limit=2.0) == {"CANCELLED"}
    assert states() == ["NONE", "NONE"] and "cancelled" in hand.told[-1]


def test_finish_early_keeps_the_one_and_leaves_the_others(hand):
    hand.pause = 5.0
    button = hand.press()
    hand.run(button, until=lambda: button.job is not None)
    hand.background.end_jobs()
    assert hand.run(button, limit=20.0) == {"FINISHED"}
    assert states() == ["PREVIEW", "NONE"]


def test_changed_meanwhile_is_made_again(hand, ready, session):  # noqa: F811
    ready.players[1].use = False
    hand.pause = 0.3
    button = hand.press()
    hand.run(button, until=lambda: button.job is not None)
    ready.alpha = 0.4
    assert hand.run(button) == {"FINISHED"}
    assert [round(order.plan.alpha, 3) for order in hand.made] == [0.2, 0.4]
    assert "generated again" in " ".join(hand.told)
    assert session.find_take(ready.players[0].take).plan.alpha == pytest.approx(0.4)


def test_who_keeps_changing_is_dropped(hand, ready):  # noqa: F811
    ready.players[1].use = False
    hand.pause = 0.15
    button = hand.press()

    def fidget():
        ready.alpha = 0.9 * ((7 * len(hand.made) + 3) % 10) / 10 + 0.01 * (time.monotonic() % 1)
        return False

    assert hand.run(button, until=fidget) == {"CANCELLED"}
    assert states()[0] == "NONE" and "keeps changing" in " ".join(hand.told) and len(hand.made) == 3


def test_renamed_removed_and_deleted(hand, ready):  # noqa: F811
    hand.pause = 0.2
    button = hand.press()
    hand.run(button, until=lambda: button.job is not None)
    ready.players[0].name = "Anna"
    ready.players.remove(1)
    assert hand.run(button) in ({"FINISHED"}, {"CANCELLED"})
    assert states() == ["PREVIEW"] and "skipped" in " ".join(hand.told)
    button = hand.press()
    hand.run(button, until=lambda: button.job is not None)
    bpy.data.objects.remove(ready.players[0].body)
    assert hand.run(button) == {"FINISHED"}
    assert ready.players[0].body is not None
    button = hand.press()
    hand.run(button, until=lambda: button.job is not None)
    ready.players.remove(0)
    assert hand.run(button) == {"CANCELLED"}
    assert "the take is discarded" in " ".join(hand.told)


def test_a_hand_in_the_middle_of_something_is_waited_for(hand, ready):  # noqa: F811
    ready.players[1].use = False
    button = hand.press()
    hand.context.window_manager.holding = ["TRANSFORM_OT_translate"]
    hand.run(button, until=lambda: "Finish the transform" in hand.context.window_manager.beyond_mocap_work.text)
    assert states()[0] == "NONE"
    hand.context.window_manager.holding = []
    assert hand.run(button) == {"FINISHED"} and states()[0] == "PREVIEW"


def test_another_scene_is_waited_for_and_a_removed_one_dropped(hand, ready):  # noqa: F811
    first = bpy.context.scene
    button = hand.press()
    hand.context.window_manager.scene = bpy.data.scenes.new("Elsewhere")
    hand.run(button, until=lambda: "waits for scene" in hand.context.window_manager.beyond_mocap_work.text)
    assert states() == ["NONE", "NONE"]
    hand.context.window_manager.scene = first
    assert hand.run(button) == {"FINISHED"} and states() == ["PREVIEW", "PREVIEW"]


def test_a_file_is_loaded(hand, ready):  # noqa: F811
    hand.pause = 5.0
    button = hand.press()
    hand.run(button, until=lambda: button.job is not None)
    button.cancel(hand.context)
    assert hand.queue.list_players() == [] and button.job.is_stale


def test_trouble_of_one_is_reported_and_the_next_goes_on(hand, ready, match):  # noqa: F811
    (match / "player1.txt").write_text("6.0 header\n")
    ready.players[0].annotation_file = str(match / "player1.txt")
    button = hand.press()
    hand.run(button)
    assert states()[1] == "PREVIEW"


def test_waiting_twice_is_waiting_once(hand, ready):  # noqa: F811
    hand.press()
    hand.press()
    assert hand.queue.list_players() == ["player1", "player2"]
    assert hand.queue.remove_player("player1") and not hand.queue.remove_player("player1")


def test_the_fingerprint_is_of_what_is_asked(hand, ready):  # noqa: F811
    how = hand.orders.SynthesisMode()
    player = ready.players[0]
    one = hand.orders.build_request(ready, player, how).fingerprint
    player.name = "Anna"
    assert hand.orders.build_request(ready, player, how).fingerprint == one
    ready.seam_window = 0.5
    assert hand.orders.build_request(ready, player, how).fingerprint != one
