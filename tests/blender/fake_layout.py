"""A layout that only writes down what is drawn into it, with the width that Blender's sidebar would give to each thing.

Widths are pixels at an interface scale of 1; the sidebar is as wide as Blender makes it at first.
"""

import importlib
import inspect
from types import SimpleNamespace

import blf
import bpy
from conftest import EXTENSION

SIDEBAR = 280.0  # a sidebar as Blender first opens it
TABS, EDGE = 20.0, 16.0  # of its width: the tabs; a panel's two margins
INDENT, ICON, PAD, FIELD = 8.0, 20.0, 8.0, 50.0  # a box's margins; an icon; around a text; a field without a name
TEXT = 200.0  # what each thing with a text asks for, so that those of a row become equally wide
SPLIT = 0.4  # of the width, that names of values take


def measure_text(text):
    """Width of a text in Blender's interface font."""
    blf.size(0, 11.0)
    return blf.dimensions(0, text)[0]


class FakeLayout:
    """Stands in for a UILayout; `drawn`: (kind, text) in the order of drawing, of this and all within."""

    def __init__(self, kind="column", parent=None, share=1.0, text_shown=True):
        own = parent.use_property_split if parent is not None else False
        vars(self).update(kind=kind, parent=parent, share=share, children=[], natural=0.0, text="",
                          use_property_split=own, alignment="EXPAND", ui_units_x=0.0,
                          drawn=parent.drawn if parent is not None else [])

    def _add(self, kind, text="", width=0.0):
        """Write down a thing."""
        one = SimpleNamespace(kind=kind, text=text, natural=width, children=[], ui_units_x=0.0)
        self.children.append(one)
        self.drawn.append((kind, text))
        return one

    def _nest(self, kind, **more):
        one = FakeLayout(kind, self, **more)
        self.children.append(one)
        return one

    def row(self, **_):
        return self._nest("row")

    def column(self, heading="", **_):
        return self._nest("column")

    def box(self):
        return self._nest("box")

    def split(self, factor=0.5, **_):
        return self._nest("split", share=factor)

    def grid_flow(self, columns=2, **_):
        return self._nest("grid", share=1.0 / columns)

    def panel(self, _name, default_closed=False):
        header = self._nest("header")
        return header, self._nest("section")

    def label(self, text="", icon="NONE"):
        self._add("label", text, measure_text(text) + ICON * (icon != "NONE") + PAD)

    def separator(self, **_):
        self._add("separator")

    def _prop(self, owner, name, text=None, icon="NONE", toggle=False, icon_only=False, expand=False, **more):
        row = owner.bl_rna.properties[name]
        text = row.name if text is None else text
        shown = "" if icon_only else text
        is_button = toggle or row.type == "BOOLEAN"
        if self.use_property_split and shown and not is_button:
            self._add("name", shown, measure_text(shown) + PAD / 2)
            return
        field = 0.0 if is_button or icon_only or row.type == "ENUM" else FIELD
        extra = ICON * (icon != "NONE" or (row.type == "BOOLEAN" and not toggle))
        self._add("prop", shown or name, measure_text(shown) + extra + PAD * bool(shown) + field)

    def prop(self, owner, name, **more):
        self._prop(owner, name, **more)

    def prop_search(self, owner, name, *_, text=None, **more):
        self._prop(owner, name, text=text)

    def prop_enum(self, owner, name, value, text=None):
        title = next(one.name for one in owner.bl_rna.properties[name].enum_items if one.identifier == value)
        self._add("enum", title, measure_text(title) + ICON + PAD / 2)

    def operator(self, idname, text=None, icon="NONE", **_):
        group, name = idname.split(".")
        title = getattr(getattr(bpy.ops, group), name).get_rna_type().name if text is None else text
        width = measure_text(title) + ICON * (icon != "NONE") + PAD * bool(title)
        return self._add("operator", f"{idname}:{title}", width)

    def operator_menu_enum(self, idname, _property, text=None, icon="NONE", **_):
        return self.operator(idname, text=text, icon=icon)

    def menu(self, _name, text="", icon="NONE"):
        self._add("menu", text, measure_text(text) + ICON + PAD)

    def popover(self, _name, text="", icon="NONE"):
        self._add("popover", text, measure_text(text) + ICON + PAD)

    def progress(self, factor=0.0, text=""):
        self._add("progress", text, measure_text(text) + PAD)

    def template_list(self, name, *_, **__):
        self._add("list", name)

    def template_icon(self, *_, **__):
        self._add("picture")

    def context_pointer_set(self, *_):
        pass


def list_cut(layout, width=SIDEBAR - TABS - EDGE):
    """List what is cut: (text, pixels that it has, pixels that it needs)."""
    if not isinstance(layout, FakeLayout):
        room = SPLIT * width if layout.kind == "name" else width
        needed = layout.natural
        return [(layout.text, room, needed)] if needed > room + 0.5 and layout.text else []
    if layout.kind == "box":
        width -= INDENT
    if layout.kind in ("row", "header"):
        return _list_cut_row(layout, width - (ICON if layout.kind == "header" else 0.0))
    found = []
    for number, child in enumerate(layout.children):
        part = 1.0
        if layout.kind == "split":
            part = layout.share if number == 0 else (1.0 - layout.share) / max(len(layout.children) - 1, 1)
        elif layout.kind == "grid":
            part = layout.share
        found += list_cut(child, part * width)
    return found


def compute_natural(layout, fits_text=False):
    """Compute the width that a thing asks for: of a text the same whatever its length, unless the row is aligned."""
    if layout.ui_units_x:
        return ICON * layout.ui_units_x
    if not isinstance(layout, FakeLayout):
        return layout.natural if fits_text else min(layout.natural, ICON) if is_bare(layout) else TEXT
    fits_text = fits_text or layout.alignment != "EXPAND"
    widths = [compute_natural(child, fits_text) for child in layout.children] or [0.0]
    return sum(widths) if layout.kind in ("row", "header") else max(widths)


def is_bare(thing):
    """Whether a thing has no text that could be cut."""
    return not thing.text.partition(":")[2] if thing.kind == "operator" else thing.natural <= ICON + PAD / 2


def _list_cut_row(layout, width):
    """A row gives what has a fixed width that, and the others shares of what is left by the widths they ask for."""
    if any(child.kind == "name" for child in layout.children):
        return [cut for child in layout.children for cut in list_cut(child, width)]
    natural = [compute_natural(child, layout.alignment != "EXPAND") for child in layout.children]
    is_fixed = [bool(child.ui_units_x) or (not isinstance(child, FakeLayout) and is_bare(child))
                for child in layout.children]
    taken = sum(one for one, fixed in zip(natural, is_fixed) if fixed)
    wanted = sum(one for one, fixed in zip(natural, is_fixed) if not fixed)
    share = (width - taken) / max(wanted, 1e-9)
    return [cut for child, one, fixed in zip(layout.children, natural, is_fixed) if not fixed
            for cut in list_cut(child, one * (min(share, 1.0) if layout.alignment != "EXPAND" else share))]


class FakePanel:
    """Stands in for a panel that is drawn into a layout."""

    def __init__(self, cls, layout):
        vars(self).update(_cls=cls, layout=layout)

    def __getattr__(self, name):
        found = inspect.getattr_static(self._cls, name)
        return found.__get__(self) if inspect.isfunction(found) else getattr(self._cls, name)


def create_context(monkeypatch):
    """Blender's context with a sidebar at a scale of 1."""
    scale = SimpleNamespace(system=SimpleNamespace(ui_scale=1.0))
    own = SimpleNamespace(region=SimpleNamespace(width=SIDEBAR), preferences=scale, object=bpy.context.object,
                          scene=bpy.context.scene, window_manager=bpy.context.window_manager, mode="OBJECT",
                          view_layer=bpy.context.view_layer, selected_objects=[], space_data=None,
                          window=SimpleNamespace(modal_operators=[]))
    monkeypatch.setattr(importlib.import_module(f"{EXTENSION}.panels.wrapping"), "bpy", SimpleNamespace(context=own))
    return own


def list_panels():
    """The panels of the 3D view's tab."""
    return [cls for cls in bpy.types.Panel.__subclasses__() if cls.__module__.startswith(EXTENSION)
            and cls.bl_space_type == "VIEW_3D" and cls.is_registered and hasattr(cls, "task")]


def draw(cls, context):
    """Draw a panel; return its layout."""
    layout = FakeLayout()
    cls.draw(FakePanel(cls, layout), context)
    return layout


def list_cut_panels(context):
    """List what is cut in the tab, a line each; a panel with a header of its own is in a box."""
    found = []
    for cls in list_panels():
        is_boxed = "HIDE_HEADER" not in getattr(cls, "bl_options", ()) and not getattr(cls, "bl_parent_id", "")
        cut = list_cut(draw(cls, context), SIDEBAR - TABS - EDGE - INDENT * is_boxed)
        found += [f"{cls.__name__}: {text!r} has {room:.0f}, needs {needed:.0f}" for text, room, needed in cut]
    return found
