"""Making takes with the window alive: players queue, each arrives as it is made, and nothing stale is ever written."""

import threading
import time

import bpy
import numpy as np
from tab import (
    EXTENSION,
    PICTURES,
    TAB,
    copy_sample,
    get_settings,
    import_module,
    output,
    report_time,
    run_operator,
    wait_until,
    wait_until_settled,
    window,
)

SHORT_MATCH = (PICTURES / "short match" / "short.blend").resolve()


def get_work():
    """What runs just now."""
    return bpy.context.window_manager.beyond_mocap_work


def list_states():
    """How far each player's result is."""
    return [player.result.state for player in get_settings().players]


def is_idle():
    """Nothing is being made."""
    return not get_work().kind and not window.window.modal_operators


class WorkHolder:
    """Holds back all work until it is let go, one after the other or all, and notices a cancel meanwhile."""

    def __enter__(self):
        self.orders, self.started, self.released = import_module("scene.result.synthesis_request"), 0, 0
        self.before = self.orders.process_request

        def wait_for_release(order, library, progress, cancelled, hurry):
            number, self.started = self.started, self.started + 1
            while number >= self.released and not cancelled() and not hurry():
                progress(0.1, "waiting on purpose")
                time.sleep(0.01)
            return self.before(order, library, progress, cancelled, lambda: False)

        self.orders.process_request = wait_for_release
        return self

    def release_work(self, count=1000):
        """Let so many of the works go on."""
        self.released = count

    def __exit__(self, *error):
        self.release_work()
        self.orders.process_request = self.before


def wait_for_threads():
    """Wait until no thread of ours works any more, whoever wanted to hear of it."""
    yield from wait_until(lambda: not any(one.name.startswith("beyond-mocap synth") for one in threading.enumerate()))
    yield 0.5


def write_short_match():
    """Write a file of two players who move for eight seconds, and one of whom kicks; takes of the sample itself last
    four times as long."""
    folder = SHORT_MATCH.parent
    folder.mkdir()
    for number, speed in enumerate((2.6, 1.3), 1):
        rows = [f"{t / 10:.1f},{speed * t / 10:.3f},{0.5 * number * np.sin(t / 10):.3f}" for t in range(81)]
        (folder / f"player{number}.csv").write_text("\n".join(["time_s,x_m,y_m", *rows]) + "\n")
    (folder / "player1.txt").write_text("5.2 kick right running low inside\n")
    bpy.ops.wm.read_homefile(use_empty=True, load_ui=True)
    yield 1.0
    get_settings().library_folder = str(copy_sample() / "library")
    files = [{"name": "player1.csv"}, {"name": "player2.csv"}]
    run_operator("beyond_mocap.import_tracking", "EXEC_DEFAULT", directory=f"{folder}/", files=files)
    bpy.ops.wm.save_as_mainfile(filepath=str(SHORT_MATCH))


def open_match(path=SHORT_MATCH):
    """The short match or the sample, freshly opened, its library built, with the tab in front."""
    if not SHORT_MATCH.exists():
        yield from write_short_match()
    bpy.ops.wm.open_mainfile(filepath=str(path))
    yield 1.0
    area = window.find_area("VIEW_3D")
    yield from window.open_tab(area, TAB)
    if import_module("scene.core.session").find_library(bpy.path.abspath(get_settings().library_folder), None) is None:
        run_operator("beyond_mocap.build_library")
        yield from wait_until_settled()
    run_operator("ed.undo_push", "EXEC_DEFAULT", message="opened")


def check_players_queue_and_each_has_its_own_step():
    yield from open_match()
    get_settings().players[1].use = False
    with WorkHolder() as hold:
        run_operator("beyond_mocap.synthesize")
        yield 0.2
        get_settings().players[0].use, get_settings().players[1].use = False, True
        run_operator("beyond_mocap.synthesize")
        yield from wait_until(lambda: get_work().waiting)
        assert get_work().waiting == get_settings().players[1].name and len(window.window.modal_operators) == 1
        window.save_picture(PICTURES / "result-queue.png")
        hold.release_work(1)
        yield from wait_until(lambda: list_states() == ["PREVIEW", "NONE"])
        assert get_work().kind, "the second is not being made any more"
        hold.release_work()
        yield from wait_until_settled()
    assert list_states() == ["PREVIEW", "PREVIEW"]
    yield 0.5
    window.save_picture(PICTURES / "result-preview.png")
    run_operator("ed.undo")
    assert list_states() == ["PREVIEW", "NONE"], list_states()
    run_operator("ed.undo")
    assert list_states() == ["NONE", "NONE"], list_states()
    run_operator("ed.redo")
    run_operator("ed.redo")
    assert list_states() == ["PREVIEW", "PREVIEW"], list_states()
    get_settings().players[0].use = True
    run_operator("beyond_mocap.accept", "EXEC_DEFAULT", form="STRIPS")
    yield 0.5
    window.save_picture(PICTURES / "result-accepted.png")
    assert list_states() == ["ACCEPTED", "ACCEPTED"]


def check_the_window_is_alive_while_takes_are_made():
    yield from open_match(copy_sample() / "quickstart.blend")  # for as long as a user waits

    def ticks(seconds):
        start, count, longest, last = time.monotonic(), 0, 0.0, time.monotonic()
        while time.monotonic() - start < seconds and (seconds < 2.5 or not is_idle()):
            yield 0.01
            now = time.monotonic()
            count, longest, last = count + 1, max(longest, now - last), now
        return count / (time.monotonic() - start), longest

    yield 1.0
    quiet, _ = yield from ticks(2.0)
    run_operator("beyond_mocap.synthesize")
    yield 0.05
    begun = time.monotonic()
    busy, longest = yield from ticks(600.0)
    output.write_line(f"     ticks a second: {quiet:.0f} idle, {busy:.0f} while making ({busy / quiet:.0%}) for "
                      f"{time.monotonic() - begun:.1f} s; longest wait {longest:.2f} s")
    assert list_states() == ["PREVIEW", "PREVIEW"]
    report_time("seconds from tick to tick while making", 1.0 / busy, 1.0 / 8.0)


def check_escape_cancels_and_finish_early_keeps():
    yield from open_match()
    with WorkHolder():
        run_operator("beyond_mocap.synthesize")
        yield 0.5
        window.save_picture(PICTURES / "result-running.png")
        yield from window.move_pointer(900, 500)
        yield from window.press_key("ESC")
        yield from wait_until_settled()
        assert list_states() == ["NONE", "NONE"]
        run_operator("beyond_mocap.synthesize")
        yield 0.3
        run_operator("beyond_mocap.cancel", "EXEC_DEFAULT", keep=True)
        yield from wait_until_settled()
        assert list_states() == ["PREVIEW", "NONE"], list_states()
        run_operator("beyond_mocap.synthesize")
        yield 0.3
        run_operator("beyond_mocap.cancel", "EXEC_DEFAULT")
        yield from wait_until_settled()
        assert list_states() == ["PREVIEW", "NONE"], list_states()


def check_undo_in_the_middle():
    """The words are changed, a take is begun, the change is undone: what is written was made of the words that are
    there."""
    yield from open_match()
    get_settings().players[1].use = False
    get_settings().alpha = 0.6
    run_operator("ed.undo_push", "EXEC_DEFAULT", message="changed")
    with WorkHolder() as hold:
        run_operator("beyond_mocap.synthesize")
        yield 0.4
        run_operator("ed.undo")
        assert get_settings().alpha < 0.5
        hold.release_work()
        yield from wait_until(lambda: list_states()[0] == "PREVIEW")
        yield from wait_until_settled()
    plan = import_module("scene.core.session").find_take(get_settings().players[0].take).plan
    assert abs(plan.alpha - get_settings().alpha) < 1e-6, plan.alpha


def read_messages():
    """What the box about player 1 says."""
    name = get_settings().players[0].name
    return next((f"{entry.lines}\n{entry.notes}" for entry in bpy.context.window_manager.beyond_mocap_stale
                 if entry.name == name), "")


def check_keys_by_hand_and_what_is_out_of_date():
    """A pose keyed by I is told of within seconds, and is still there when the take was made anew."""
    yield from open_match()
    get_settings().players[1].use = False
    run_operator("beyond_mocap.synthesize")
    yield from wait_until_settled()
    run_operator("beyond_mocap.accept", "EXEC_DEFAULT", form="ACTION")
    body = get_settings().players[0].body
    bpy.context.view_layer.objects.active = body
    body.select_set(True)
    run_operator("object.mode_set", "EXEC_DEFAULT", mode="POSE")
    for bone in body.pose.bones:
        (bone if bpy.app.version >= (5, 0) else bone.bone).select = bone.name == "LeftArm"
    body.data.bones.active = body.data.bones["LeftArm"]
    window.window.scene.frame_set(77)
    body.pose.bones["LeftArm"].rotation_quaternion = (0.5, 0.5, 0.5, 0.5)
    area = window.find_area("VIEW_3D")
    yield from window.move_pointer(area.x + area.width // 3, area.y + area.height // 2)
    yield from window.press_key("I")
    yield 0.5
    run_operator("object.mode_set", "EXEC_DEFAULT", mode="OBJECT")
    yield from wait_until(lambda: "manual" in read_messages())
    output.write_line(f"     told: {read_messages().strip()}")
    get_settings().alpha = 0.35
    yield from wait_until(lambda: "settings" in read_messages())
    yield 0.6
    window.save_picture(PICTURES / "result-out-of-date.png")
    run_operator("beyond_mocap.update", player=get_settings().players[0].name)
    yield from wait_until_settled()
    yield from wait_until(lambda: "choices" not in read_messages())
    assert get_settings().players[0].result.hand_keys, read_messages()
    window.window.scene.frame_set(77)
    turned = get_settings().players[0].body.pose.bones["LeftArm"].rotation_quaternion
    assert max(abs(value - 0.5) for value in turned) < 1e-5, turned


def check_variants_and_a_stretch():
    yield from open_match()
    get_settings().players[1].use = False
    run_operator("beyond_mocap.variants", count=3)
    yield from wait_until_settled()
    yield 0.6
    window.save_picture(PICTURES / "result-variants.png")
    takes = [variant.name for variant in get_settings().players[0].result.variants]
    assert len(takes) == 3 and get_settings().players[0].take == takes[0]
    run_operator("beyond_mocap.preview", "EXEC_DEFAULT", number=2)
    assert get_settings().players[0].take == takes[1]
    run_operator("beyond_mocap.accept", "EXEC_DEFAULT", form="STRIPS")
    body = get_settings().players[0].body
    body.select_set(True)
    strips = body.animation_data.nla_tracks["Beyond Mocap"].strips
    for number, strip in enumerate(strips):
        strip.select = number == len(strips) // 2
    run_operator("beyond_mocap.resynthesize_stretch")
    yield from wait_until_settled()
    assert get_settings().players[0].result.state == "PREVIEW" and get_settings().players[0].take not in takes
    run_operator("beyond_mocap.discard", "EXEC_DEFAULT")
    assert get_settings().players[0].take == takes[1] and list_states()[0] == "ACCEPTED"


def check_whatever_happens_in_the_middle():
    """The player renamed or removed, its rig deleted, another scene shown, another file opened."""
    yield from open_match()
    with WorkHolder() as hold:
        run_operator("beyond_mocap.synthesize")
        yield 0.2
        get_settings().players[0].name = "Another name"
        get_settings().players.remove(1)
        hold.release_work()
        yield from wait_until_settled()
    assert list_states() == ["PREVIEW"] and get_settings().players[0].take
    with WorkHolder() as hold:
        run_operator("beyond_mocap.synthesize")
        yield 0.2
        bpy.data.objects.remove(get_settings().players[0].body)
        hold.release_work()
        yield from wait_until_settled()
    assert list_states() == ["PREVIEW"] and get_settings().players[0].body is not None
    first = window.window.scene.name
    with WorkHolder() as hold:
        take = get_settings().players[0].take
        run_operator("beyond_mocap.synthesize")
        yield 0.2
        window.window.scene = bpy.data.scenes.new("Elsewhere")
        hold.release_work()
        yield from wait_for_threads()
        assert bpy.data.scenes[first].beyond_mocap.players[0].take == take and "Elsewhere" in bpy.data.scenes
        window.window.scene = bpy.data.scenes[first]
        yield from wait_until_settled()
        assert get_settings().players[0].take != take
    with WorkHolder() as hold:
        run_operator("beyond_mocap.synthesize")
        yield 0.2
        bpy.ops.wm.open_mainfile(filepath=str(SHORT_MATCH))
        yield 0.5
        assert is_idle() and list_states() == ["NONE", "NONE"]
        hold.release_work()
        yield from wait_for_threads()
        assert list_states() == ["NONE", "NONE"] and not import_module("scene.result.queue").list_players()


def read_status_bar(name):
    """The lowest rows of the window, as pixels."""
    window.save_picture(PICTURES / f"result-{name}.png")
    image = bpy.data.images.load(str((PICTURES / f"result-{name}.png").resolve()))
    pixels = np.array(image.pixels).reshape(*image.size[::-1], image.channels)[2:18, :1000, :3]
    bpy.data.images.remove(image)
    return pixels


def check_disabling_during_synthesis_leaves_nothing():
    yield from open_match()
    yield from window.move_pointer(900, 500)
    yield 1.0
    before = read_status_bar("before")
    with WorkHolder():
        run_operator("beyond_mocap.synthesize")
        yield 1.5
        assert not np.array_equal(read_status_bar("working"), before), "the status bar says nothing"
        run_operator("preferences.addon_disable", "EXEC_DEFAULT", module=EXTENSION)
        yield 1.5
    assert np.array_equal(read_status_bar("switched-off"), before), "the status bar still says something"
    yield from window.move_pointer(905, 505)  # Blender drops the operators of a class that is gone with its next event
    yield 0.5
    left = [operator.bl_idname for operator in window.window.modal_operators]
    assert not left, left
    yield from wait_for_threads()
    run_operator("preferences.addon_enable", "EXEC_DEFAULT", module=EXTENSION)
    yield from open_match()
    assert not get_work().kind and not get_work().waiting
    run_operator("beyond_mocap.synthesize")
    yield from wait_until_settled()
    assert "PREVIEW" in list_states()
