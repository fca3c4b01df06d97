"""Making takes with the window alive: players queue, each arrives as it is made, and nothing stale is ever written."""

import threading
import time

import bpy
import numpy as np
from tab import EXTENSION, PICTURES, TAB, output, room, run, sample, settings, settled, until, window, within


def work():
    """What runs just now."""
    return bpy.context.window_manager.beyond_mocap_work


def states():
    """How far each player's result is."""
    return [player.result.state for player in settings().players]


def idle():
    """Nothing is being made."""
    return not work().kind and not window.window.modal_operators


class held:
    """Holds back all work until it is let go, one after the other or all, and notices a cancel meanwhile."""

    def __enter__(self):
        self.orders, self.begun, self.free = room("scene.result.orders"), 0, 0
        self.before = self.orders.work

        def waits(order, library, progress, cancelled, hurry):
            number, self.begun = self.begun, self.begun + 1
            while number >= self.free and not cancelled() and not hurry():
                progress(0.1, "waiting on purpose")
                time.sleep(0.01)
            return self.before(order, library, progress, cancelled, lambda: False)

        self.orders.work = waits
        return self

    def go(self, count=1000):
        """Let so many of the works go on."""
        self.free = count

    def __exit__(self, *error):
        self.go()
        self.orders.work = self.before


def worked_off():
    """Wait until no thread of ours works any more, whoever wanted to hear of it."""
    yield from until(lambda: not any(one.name.startswith("beyond-mocap synth") for one in threading.enumerate()))
    yield 0.5


def opened():
    """The sample, freshly opened, its library built, with the tab in front."""
    bpy.ops.wm.open_mainfile(filepath=str(sample() / "quickstart.blend"))
    yield 1.0
    area = window.area("VIEW_3D")
    yield from window.open_tab(area, TAB)
    if room("scene.core.session").library(bpy.path.abspath(settings().library_folder), None) is None:
        run("beyond_mocap.build_library")
        yield from settled()
    run("ed.undo_push", "EXEC_DEFAULT", message="opened")


def check_players_queue_and_each_has_its_own_step():
    yield from opened()
    settings().players[1].use = False
    with held() as hold:
        run("beyond_mocap.synthesize")
        yield 0.2
        settings().players[0].use, settings().players[1].use = False, True
        run("beyond_mocap.synthesize")
        yield from until(lambda: work().waiting)
        assert work().waiting == settings().players[1].name and len(window.window.modal_operators) == 1
        window.picture(PICTURES / "result-queue.png")
        hold.go(1)
        yield from until(lambda: states() == ["PREVIEW", "NONE"])
        assert work().kind, "the second is not being made any more"
        hold.go()
        yield from settled()
    assert states() == ["PREVIEW", "PREVIEW"]
    yield 0.5
    window.picture(PICTURES / "result-preview.png")
    run("ed.undo")
    assert states() == ["PREVIEW", "NONE"], states()
    run("ed.undo")
    assert states() == ["NONE", "NONE"], states()
    run("ed.redo")
    run("ed.redo")
    assert states() == ["PREVIEW", "PREVIEW"], states()
    settings().players[0].use = True
    run("beyond_mocap.accept", "EXEC_DEFAULT", form="STRIPS")
    yield 0.5
    window.picture(PICTURES / "result-accepted.png")
    assert states() == ["ACCEPTED", "ACCEPTED"]


def check_the_window_is_alive_while_takes_are_made():
    yield from opened()

    def ticks(seconds):
        start, count, longest, last = time.monotonic(), 0, 0.0, time.monotonic()
        while time.monotonic() - start < seconds and (seconds < 2.5 or not idle()):
            yield 0.01
            now = time.monotonic()
            count, longest, last = count + 1, max(longest, now - last), now
        return count / (time.monotonic() - start), longest

    yield 1.0
    quiet, _ = yield from ticks(2.0)
    run("beyond_mocap.synthesize")
    yield 0.05
    begun = time.monotonic()
    busy, longest = yield from ticks(600.0)
    output.say(f"     ticks a second: {quiet:.0f} idle, {busy:.0f} while making ({busy / quiet:.0%}) for "
               f"{time.monotonic() - begun:.1f} s; longest wait {longest:.2f} s")
    assert states() == ["PREVIEW", "PREVIEW"]
    within("seconds from tick to tick while making", 1.0 / busy, 1.0 / 8.0)


def check_escape_cancels_and_finish_early_keeps():
    yield from opened()
    with held():
        run("beyond_mocap.synthesize")
        yield 0.5
        window.picture(PICTURES / "result-running.png")
        yield from window.move(900, 500)
        yield from window.press("ESC")
        yield from settled()
        assert states() == ["NONE", "NONE"]
        run("beyond_mocap.synthesize")
        yield 0.3
        run("beyond_mocap.cancel", "EXEC_DEFAULT", keep=True)
        yield from settled()
        assert states() == ["PREVIEW", "NONE"], states()
        run("beyond_mocap.synthesize")
        yield 0.3
        run("beyond_mocap.cancel", "EXEC_DEFAULT")
        yield from settled()
        assert states() == ["PREVIEW", "NONE"], states()


def check_undo_in_the_middle():
    """The words are changed, a take is begun, the change is undone: what is written was made of the words that are
    there."""
    yield from opened()
    settings().players[1].use = False
    settings().alpha = 0.6
    run("ed.undo_push", "EXEC_DEFAULT", message="changed")
    with held() as hold:
        run("beyond_mocap.synthesize")
        yield 0.4
        run("ed.undo")
        assert settings().alpha < 0.5
        hold.go()
        yield from until(lambda: states()[0] == "PREVIEW")
        yield from settled()
    plan = room("scene.core.session").made(settings().players[0].take).plan
    assert abs(plan.alpha - settings().alpha) < 1e-6, plan.alpha


def told():
    """What the box about player 1 says."""
    name = settings().players[0].name
    return next((f"{entry.lines}\n{entry.notes}" for entry in bpy.context.window_manager.beyond_mocap_stale
                 if entry.name == name), "")


def check_keys_by_hand_and_what_is_out_of_date():
    """A pose keyed by I is told of within seconds, and is still there when the take was made anew."""
    yield from opened()
    settings().players[1].use = False
    run("beyond_mocap.synthesize")
    yield from settled()
    run("beyond_mocap.accept", "EXEC_DEFAULT", form="ACTION")
    body = settings().players[0].body
    bpy.context.view_layer.objects.active = body
    body.select_set(True)
    run("object.mode_set", "EXEC_DEFAULT", mode="POSE")
    for bone in body.pose.bones:
        (bone if bpy.app.version >= (5, 0) else bone.bone).select = bone.name == "LeftArm"
    body.data.bones.active = body.data.bones["LeftArm"]
    window.window.scene.frame_set(77)
    body.pose.bones["LeftArm"].rotation_quaternion = (0.5, 0.5, 0.5, 0.5)
    area = window.area("VIEW_3D")
    yield from window.move(area.x + area.width // 3, area.y + area.height // 2)
    yield from window.press("I")
    yield 0.5
    run("object.mode_set", "EXEC_DEFAULT", mode="OBJECT")
    yield from until(lambda: "manual" in told())
    output.say(f"     told: {told().strip()}")
    settings().alpha = 0.35
    yield from until(lambda: "settings" in told())
    yield 0.6
    window.picture(PICTURES / "result-out-of-date.png")
    run("beyond_mocap.update", player=settings().players[0].name)
    yield from settled()
    yield from until(lambda: "choices" not in told())
    assert settings().players[0].result.hand_keys, told()
    window.window.scene.frame_set(77)
    turned = settings().players[0].body.pose.bones["LeftArm"].rotation_quaternion
    assert max(abs(value - 0.5) for value in turned) < 1e-5, turned


def check_variants_and_a_stretch():
    yield from opened()
    settings().players[1].use = False
    run("beyond_mocap.variants", count=3)
    yield from settled()
    yield 0.6
    window.picture(PICTURES / "result-variants.png")
    takes = [variant.name for variant in settings().players[0].result.variants]
    assert len(takes) == 3 and settings().players[0].take == takes[0]
    run("beyond_mocap.preview", "EXEC_DEFAULT", number=2)
    assert settings().players[0].take == takes[1]
    run("beyond_mocap.accept", "EXEC_DEFAULT", form="STRIPS")
    body = settings().players[0].body
    body.select_set(True)
    strips = body.animation_data.nla_tracks["Beyond Mocap"].strips
    for number, strip in enumerate(strips):
        strip.select = number == len(strips) // 2
    run("beyond_mocap.resynthesize_stretch")
    yield from settled()
    assert settings().players[0].result.state == "PREVIEW" and settings().players[0].take not in takes
    run("beyond_mocap.discard", "EXEC_DEFAULT")
    assert settings().players[0].take == takes[1] and states()[0] == "ACCEPTED"


def check_whatever_happens_in_the_middle():
    """The player renamed or removed, its rig deleted, another scene shown, another file opened."""
    yield from opened()
    with held() as hold:
        run("beyond_mocap.synthesize")
        yield 0.2
        settings().players[0].name = "Another name"
        settings().players.remove(1)
        hold.go()
        yield from settled()
    assert states() == ["PREVIEW"] and settings().players[0].take
    with held() as hold:
        run("beyond_mocap.synthesize")
        yield 0.2
        bpy.data.objects.remove(settings().players[0].body)
        hold.go()
        yield from settled()
    assert states() == ["PREVIEW"] and settings().players[0].body is not None
    first = window.window.scene.name
    with held() as hold:
        take = settings().players[0].take
        run("beyond_mocap.synthesize")
        yield 0.2
        window.window.scene = bpy.data.scenes.new("Elsewhere")
        hold.go()
        yield from worked_off()
        assert bpy.data.scenes[first].beyond_mocap.players[0].take == take and "Elsewhere" in bpy.data.scenes
        window.window.scene = bpy.data.scenes[first]
        yield from settled()
        assert settings().players[0].take != take
    with held() as hold:
        run("beyond_mocap.synthesize")
        yield 0.2
        bpy.ops.wm.open_mainfile(filepath=str(sample() / "quickstart.blend"))
        yield 0.5
        assert idle() and states() == ["NONE", "NONE"]
        hold.go()
        yield from worked_off()
        assert states() == ["NONE", "NONE"] and not room("scene.result.queue").names()


def status_bar(name):
    """The lowest rows of the window, as pixels."""
    window.picture(PICTURES / f"result-{name}.png")
    image = bpy.data.images.load(str((PICTURES / f"result-{name}.png").resolve()))
    pixels = np.array(image.pixels).reshape(*image.size[::-1], image.channels)[2:18, :1000, :3]
    bpy.data.images.remove(image)
    return pixels


def check_switched_off_while_takes_are_made_nothing_is_left_in_the_window():
    yield from opened()
    yield from window.move(900, 500)
    yield 1.0
    before = status_bar("before")
    with held():
        run("beyond_mocap.synthesize")
        yield 1.5
        assert not np.array_equal(status_bar("working"), before), "the status bar says nothing"
        run("preferences.addon_disable", "EXEC_DEFAULT", module=EXTENSION)
        yield 1.5
    assert np.array_equal(status_bar("switched-off"), before), "the status bar still says something"
    yield from window.move(905, 505)  # Blender drops the operators of a class that is gone with its next event
    yield 0.5
    left = [operator.bl_idname for operator in window.window.modal_operators]
    assert not left, left
    yield from worked_off()
    run("preferences.addon_enable", "EXEC_DEFAULT", module=EXTENSION)
    yield from opened()
    assert not work().kind and not work().waiting
    run("beyond_mocap.synthesize")
    yield from settled()
    assert "PREVIEW" in states()
