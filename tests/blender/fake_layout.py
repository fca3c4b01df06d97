"""A layout that only writes down what is drawn into it, with the width that Blender's sidebar would give to each thing.

Widths are pixels at an interface scale of 1; the sidebar is as wide as Blender makes it at first.
"""

from types import SimpleNamespace

import blf

SIDEBAR = 280.0  # a sidebar as Blender first opens it
TABS, EDGE = 20.0, 16.0  # of its width: the tabs; a panel's two margins
INDENT, ICON, PAD, FIELD = 8.0, 20.0, 8.0, 50.0  # a box's margins; an icon; around a text; a field without a name
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
            self._add("name", shown, measure_text(shown) + PAD / 4)
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
        import bpy

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


def compute_natural(layout):
    """Compute the width that a thing asks for."""
    if layout.ui_units_x:
        return 20.0 * layout.ui_units_x
    if not isinstance(layout, FakeLayout):
        return layout.natural
    widths = [compute_natural(child) for child in layout.children] or [0.0]
    return sum(widths) if layout.kind == "row" else max(widths)


def _list_cut_row(layout, width):
    """A row shrinks all that is in it alike where there is too little room."""
    if any(isinstance(child, FakeLayout) and child.children for child in layout.children):
        natural = [compute_natural(child) for child in layout.children]
        shares = [width * one / max(sum(natural), 1e-9) for one in natural]
        return [cut for child, share in zip(layout.children, shares) for cut in list_cut(child, share)]
    if any(child.kind == "name" for child in layout.children):
        return [cut for child in layout.children for cut in list_cut(child, width)]
    needed = sum(compute_natural(child) for child in layout.children)
    texts = " | ".join(child.text for child in layout.children if child.text)
    return [(texts, width, needed)] if needed > width + 0.5 else []
