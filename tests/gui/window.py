"""A hand and an eye for Blender's window: move, click, type, find buttons, read what was printed.

Blender answers events only between two steps of a timer, so everything that takes part in the
conversation is a generator: each `yield` gives the seconds to wait before it goes on.
"""

import ctypes
import os
import subprocess
import sys
import tempfile
import time
import traceback

import bpy


class Output:
    """All that Blender and its libraries print, on both streams, kept for reading and passed on at the end.

    Errors in drawing do not stop anything: a Python one is printed as a traceback, a property that does not exist
    as a bare `file.py:29` from C code. So the streams themselves are read, below Python's.
    """

    def __init__(self):
        self.kept = tempfile.TemporaryFile()
        self.terminal = os.dup(1)
        sys.stdout.flush()
        sys.stderr.flush()
        os.dup2(self.kept.fileno(), 1)
        os.dup2(self.kept.fileno(), 2)

    def text(self):
        """Everything printed so far, what C code still holds back included."""
        sys.stdout.flush()
        sys.stderr.flush()
        ctypes.CDLL(None).fflush(None)
        return os.pread(self.kept.fileno(), os.fstat(self.kept.fileno()).st_size, 0).decode("utf-8", "replace")

    def write_line(self, line):
        """Write a line to the terminal at once, past the keeping."""
        os.write(self.terminal, (line + "\n").encode())


class ScanTask:
    """What a scout has to do and what it reports. look(): the text of what is under the pointer; is_wanted(text):
    whether to click it. `found`: text -> place, of all that was seen on the way; `clicked`: the text of what was;
    `back`: whether it has come to the end."""

    def __init__(self, window, look, is_wanted):
        self.window, self.look, self.is_wanted = window, look, is_wanted
        self.found, self.text, self.place, self.clicked, self.back = {}, None, None, "", False

    def report_position(self, place):
        """The pointer is moved here. Of two texts that differ the second was met right here; one that stays, as the
        first does, may be that of a button that the pointer has left: Blender goes on to name it."""
        if place == self.place and (text := self.look()) != self.text:
            if text and self.text is not None:
                self.found.setdefault(text, place)
            self.text = text
        self.place = place

    def finish_scan(self):
        """All places have been seen: click the first thing that is wanted, before anything is drawn and may move."""
        self.back = True
        self.clicked = next((text for text in self.found if self.is_wanted(text)), "")
        if self.clicked:
            self.window.move_pointer_and_wait(*self.found[self.clicked])
            self.window.send_event("LEFTMOUSE", "PRESS")
            self.window.send_event("LEFTMOUSE", "RELEASE")


class PointerScanner(bpy.types.Operator):
    """Reads what is under the pointer while many moves are handled at once. Looking after each of them, as the next one
    comes, takes a hundredth of the time that it takes to wait until each has been drawn, and nothing moves
    meanwhile."""

    bl_idname, bl_label = "window_test.scout", "Scout"
    sent = None

    def invoke(self, context, event):
        """Ride along with all events from now on."""
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        """Look at each move; end at F24."""
        if event.type == "F24":
            PointerScanner.sent.finish_scan()
            return {"FINISHED"}
        if event.type == "MOUSEMOVE":
            PointerScanner.sent.report_position((event.mouse_x, event.mouse_y))
        return {"PASS_THROUGH"}


bpy.utils.register_class(PointerScanner)


class Window:
    """Blender's first window, with one pointer."""

    pointer = (0, 0)

    @property
    def window(self):
        """Looked up each time, because loading a file replaces it."""
        return bpy.context.window_manager.windows[0]

    def find_area(self, kind):
        """The first editor of this type."""
        return next(area for area in self.window.screen.areas if area.type == kind)

    def find_sidebar(self, area):
        """The editor's right-hand region, where the tabs are."""
        return next(region for region in area.regions if region.type == "UI")

    def send_event(self, kind, value, **held):
        """One event at the pointer; held: ctrl=True and the like."""
        x, y = self.pointer
        self.window.event_simulate(type=kind, value=value, x=x, y=y, **held)

    def move_pointer(self, x, y):
        """Put the pointer there."""
        self.pointer = (int(x), int(y))
        self.send_event("MOUSEMOVE", "NOTHING")
        yield 0.015

    def move_pointer_and_wait(self, x, y):
        """Put the pointer there, and be there: the first event leaves the button before, the second enters this one, at
        the third a scout reads what the second has done."""
        self.pointer = (int(x), int(y))
        for _ in range(3):
            self.send_event("MOUSEMOVE", "NOTHING")

    def press_key(self, key, **held):
        """A key or mouse button, down and up; held: ctrl=True and the like."""
        self.send_event(key, "PRESS", **held)
        yield 0.05
        self.send_event(key, "RELEASE", **held)
        yield 0.15

    def type_text(self, text):
        """Type into the field that is being edited, and end with Enter; what stood there is replaced."""
        yield from self.press_key("A", ctrl=True)
        for letter in text:
            self.send_event("A", "PRESS", unicode=letter)
            yield 0.01
            self.send_event("A", "RELEASE")
            yield 0.01
        yield from self.press_key("RET")

    def escape_from(self, window):
        """Press Escape with the pointer in the middle of one of Blender's windows, which may be gone after that."""
        middle = {"x": window.width // 2, "y": window.height // 2}
        window.event_simulate(type="MOUSEMOVE", value="NOTHING", **middle)
        yield 0.2
        window.event_simulate(type="ESC", value="PRESS", **middle)
        yield 0.2
        if window in bpy.context.window_manager.windows.values():
            window.event_simulate(type="ESC", value="RELEASE", **middle)
            yield 0.1

    def click_at(self, x, y):
        """Click there with the left button."""
        yield from self.move_pointer(x, y)
        yield from self.press_key("LEFTMOUSE")

    def open_tab(self, area, category, limit=60.0):
        """Show the editor's sidebar with this tab in front."""
        area.spaces.active.show_region_ui = True
        start, region = time.monotonic(), self.find_sidebar(area)
        while self.get_category(region) != category or region.width <= 1:
            assert time.monotonic() - start < limit, f"no tab {category} in the {area.type}"
            area.tag_redraw()
            yield 0.1
            try:  # a sidebar has no tabs to choose from before it has been drawn
                region.active_panel_category = category
            except (AttributeError, TypeError):
                pass
        area.tag_redraw()
        yield 0.2

    def get_category(self, region):
        """The tab in front; "" before there are any."""
        try:
            return region.active_panel_category
        except AttributeError:
            return ""

    def command_under_pointer(self, area, region):
        """The Python call of the button under the pointer, as Blender itself writes it; "" where there is none."""
        manager = bpy.context.window_manager
        manager.clipboard = ""
        with bpy.context.temp_override(window=self.window, area=area, region=region):
            if bpy.ops.ui.copy_python_command_button.poll():
                bpy.ops.ui.copy_python_command_button()
        return manager.clipboard

    def field_under_pointer(self, area, region):
        """The full data path of the property under the pointer; "" where there is none."""
        manager = bpy.context.window_manager
        manager.clipboard = ""
        with bpy.context.temp_override(window=self.window, area=area, region=region):
            if bpy.ops.ui.copy_data_path_button.poll():
                bpy.ops.ui.copy_data_path_button(full_path=True)
        return manager.clipboard

    def click_first(self, area, region, is_wanted, what, limit=60.0):
        """Click the first thing that `is_wanted(text)` is true of, looked for from the top of the region, page by page,
        again and again: what shows it may not be drawn yet. what(area, region): the text of what is under the
        pointer."""
        start = time.monotonic()
        while time.monotonic() - start < limit:
            area.tag_redraw()
            yield from self.scroll_to_top(area, region)
            more = True
            while more:
                _, clicked = yield from self.scan_region(area, region, what, is_wanted)
                if clicked:
                    return
                more = yield from self.scroll_region(area, region)
        raise AssertionError("not found in the sidebar")

    def scan_region(self, area, region, what, is_wanted=lambda text: False):
        """Move over all that the region shows, and click the first thing there that `is_wanted(text)` is true of.
        Return what is there, its text -> where it is, and what was clicked: its text, or ""."""
        rows = range(region.y + region.height - 8, region.y + 4, -9)
        columns = [region.x + int(region.width * share) for share in (0.2, 0.3, 0.5, 0.6, 0.83)]
        yield 0.05
        with bpy.context.temp_override(window=self.window, area=area, region=region):
            bpy.ops.window_test.scout("INVOKE_DEFAULT")
        scout, start = ScanTask(self, lambda: what(area, region), is_wanted), time.monotonic()
        PointerScanner.sent = scout
        for place in [(x, y) for y in rows for x in columns]:
            self.move_pointer_and_wait(*place)
        self.send_event("F24", "PRESS")
        while not scout.back:
            assert time.monotonic() - start < 60.0, "the scout has not come back"
            yield 0.01
        self.send_event("F24", "RELEASE")
        yield 0.05
        return scout.found, scout.clicked

    def scroll_to_top(self, area, region):
        """Scroll up as far as it goes."""
        for _ in range(20):
            if not (yield from self.scroll_region(area, region, -2.0)):
                return

    def scroll_region(self, area, region, pages=0.5):
        """Scroll down by so many of what the region shows, or up; return whether it moved."""
        before = region.view2d.view_to_region(0, 0, clip=False)
        with bpy.context.temp_override(window=self.window, area=area, region=region):
            bpy.ops.view2d.pan("EXEC_DEFAULT", deltax=0, deltay=-int(pages * region.height))
        region.tag_redraw()
        yield 0.1  # laid out anew, what went beyond an end comes back
        return region.view2d.view_to_region(0, 0, clip=False) != before

    def save_picture(self, path):
        """Save the whole screen; by X itself, because Blender's own screenshot is black on a software renderer."""
        subprocess.run(["import", "-window", "root", path], check=True)

    def save_part(self, path, x, y, width, height, *changes):
        """Save a part of the screen, its corner given as Blender counts (from below), in 200 colours; changes:
        ImageMagick's words for what is done to it besides."""
        top = self.window.height - y - height
        cut = ["-crop", f"{width}x{height}+{x}+{top}", "+repage", *changes, "-strip", "+dither", "-colors", "200"]
        subprocess.run(["import", "-window", "root", "png:" + str(path) + ".whole"], check=True)
        subprocess.run(["convert", "png:" + str(path) + ".whole", *cut, f"png8:{path}"], check=True)
        os.unlink(str(path) + ".whole")


class ObjectProxy:
    """Stands in for an object; what it does not define itself is the object's own."""

    def __init__(self, object, **own):
        vars(self).update(own, _object=object)

    def __getattr__(self, name):
        return getattr(self._object, name)

    def __setattr__(self, name, value):
        setattr(self._object, name, value)


def draw_unfolded(panel):
    """Draw a panel class with all its collapsible sections open, those within sections too; return what undoes it."""
    folded = panel.draw

    def opened(layout):
        def section(name, **_):
            header, body = layout.panel(name + "_unfolded")
            return header, opened(body)

        return ObjectProxy(layout, panel=section)

    def draw(self, context):
        folded(ObjectProxy(self, layout=opened(self.layout)), context)

    panel.draw = draw
    return lambda: setattr(panel, "draw", folded)


def run_script(script, output, limit):
    """Run a generator between Blender's events, then end Blender: 0 finished, 4 too slow, 5 an error."""
    steps, start = script(), time.monotonic()

    def tick():
        try:
            wait = next(steps)
            if time.monotonic() - start < limit:
                return wait
            output.write_line(f"the window tests did not finish in {limit} s")
            status = 4
        except StopIteration as end:
            status = end.value or 0
        except BaseException:
            output.write_line(traceback.format_exc())
            status = 5
        os._exit(status)  # quitting the usual way always ends with 0

    bpy.app.timers.register(tick, first_interval=1.5, persistent=True)
