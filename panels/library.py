"""The library of clips: a step of a player's take, and the task in which its clips are seen and worked on."""

from __future__ import annotations

import bpy

from .tab import StepPanel, TabPanel, draw_automatic, draw_header, draw_paragraph, draw_table, with_progress

QUALITY_ICONS = ("STRIP_COLOR_04", "STRIP_COLOR_02", "STRIP_COLOR_01", "BLANK1")  # green, orange, red, not measured
STATE_ICONS = {"OPEN": "RADIOBUT_OFF", "ACCEPTED": "CHECKMARK", "REFUSED": "X"}


class BEYOND_MOCAP_UL_clips(bpy.types.UIList):
    """The clips that match the search: quality, name, label, and a button that imports."""

    def draw_item(self, _context, layout, _data, clip, _icon, _active_data, _active_property):
        row = layout.row(align=True)
        names = row.split(factor=0.66, align=True)
        names.label(text=clip.name, icon=QUALITY_ICONS[clip.mark])
        names.label(text=clip.brief)
        row.operator("beyond_mocap.import_clip", text="", icon="IMPORT", emboss=False).path = clip.path

    def draw_filter(self, _context, _layout):
        """Draw nothing: search and order are above the list, where they work for any number of clips."""


class BEYOND_MOCAP_UL_proposals(bpy.types.UIList):
    """The proposals for a clip: state, labels, confidence, and buttons to review them."""

    def draw_item(self, _context, layout, _data, one, _icon, _active_data, _active_property, index=0):
        row = layout.row(align=True)
        row.active = one.state != "REFUSED"
        names = row.split(factor=0.72, align=True)
        names.label(text=one.name.replace("_", " "), icon=STATE_ICONS[one.state])
        names.label(text=f"{min(one.confidence, 0.99):.0%}")
        for what, icon in (("ACCEPT", "CHECKMARK"), ("REFUSE", "X")):
            button = row.operator("beyond_mocap.judge_proposal", text="", icon=icon, emboss=False)
            button.what, button.index = what, index

    def draw_filter(self, _context, _layout):
        """Draw nothing: the list is short."""


class BEYOND_MOCAP_PT_library_step(StepPanel, bpy.types.Panel):
    """Step 1 of a take: the library's folder, and the button that builds it."""

    bl_label = "1  Library"
    task = "PLAYER"
    rooms = ("library",)
    also = ("MATCH", "BALL")
    bl_order = 1

    def find_state(self, context):
        """Return whether a library is built, and what it holds."""
        settings = context.scene.beyond_mocap
        first = settings.library_holds.partition("\n")[0]
        listing = context.window_manager.beyond_mocap_clips
        is_current = bool(settings.library_folder) and listing.folder in ("", settings.library_folder)
        counted = settings.library_gaps.partition(":")[0]  # a file of an earlier version has no count there
        clips, *more = first.split(", ")[:2]
        summary = ", ".join([clips, *([counted] if "warning" in counted else more)])  # no room for all three
        return ("done", summary) if first and is_current and not listing.missing else ("next", "")

    def draw_step(self, layout, context):
        """Draw folder and button, and what the library lacks."""
        draw_folder(layout, context)
        draw_gaps(layout, context.scene.beyond_mocap)


class BEYOND_MOCAP_PT_library(TabPanel, bpy.types.Panel):
    """The library's folder, its content, its clips, and tools."""

    bl_label = "Library"
    task = "LIBRARY"
    bl_order = 1

    def draw(self, context):
        """Draw folder, button, content and clips."""
        layout, settings = self.layout, context.scene.beyond_mocap
        listing = context.window_manager.beyond_mocap_clips
        draw_folder(layout, context)
        current = listing.folder == settings.library_folder
        if current and listing.news:
            box = layout.box()
            draw_paragraph(box, f"{listing.news}; build the library again to use them", "INFO")
            box.operator("beyond_mocap.build_library", text="Build Again", icon="FILE_REFRESH")
        first, *content = settings.library_holds.splitlines() or ("",)
        if content:
            if body := draw_header(layout, "library_holds", first):
                draw_table(body, content)
        draw_gaps(layout, settings)
        if body := draw_header(layout, "library_clips", f"Clips ({listing.total})" if current and listing.total
                               else "Clips", closed=False):
            draw_clips(body, settings, listing, current)
        if context.object is not None and "beyond_mocap_clip" in context.object:
            draw_open_clip(layout, context, settings)
        if body := draw_header(layout, "library_more", "Tools"):
            draw_tools(body, settings)


def draw_folder(layout, context) -> None:
    """Draw the library's folder, the button that builds it, and below them what is wrong with it."""
    settings = context.scene.beyond_mocap
    column = layout.column()
    column.label(text="Folder of Clips")
    column.prop(settings, "library_folder", text="")
    with_progress(layout, context, ("library",), lambda row: row.operator("beyond_mocap.build_library",
                  icon="ASSET_MANAGER"))
    if not settings.library_folder:
        draw_paragraph(layout, "Choose the folder of your recordings first", "INFO")
    elif context.window_manager.beyond_mocap_clips.missing:
        draw_paragraph(layout, "This folder does not exist", "ERROR")
        layout.operator("beyond_mocap.relink_library", icon="FILE_FOLDER")


def draw_gaps(layout, settings) -> None:
    """Draw what the library that was built last leaves out and lacks."""
    _, *lines = settings.library_gaps.splitlines() or ("",)
    if lines and (body := draw_header(layout, "library_gaps", "Missing and Left Out", icon="INFO")):
        for line in lines:
            draw_paragraph(body, line, "DOT")


def draw_clips(layout, settings, listing, current) -> None:
    """Draw the list and the details of the chosen clip."""
    if not current or not listing.total:
        layout.operator("beyond_mocap.list_clips", icon="PRESET")
        return
    row = layout.row(align=True)
    row.prop(listing, "find", text="", icon="VIEWZOOM")
    row.prop(listing, "order", text="", icon="SORTALPHA", icon_only=True)
    row.operator("beyond_mocap.list_clips", text="", icon="FILE_REFRESH")
    layout.template_list("BEYOND_MOCAP_UL_clips", "", listing, "shown", listing, active_propname="active", rows=6)
    if not 0 <= listing.active < len(listing.shown):
        layout.label(text="No matching clips", icon="INFO")
        return
    clip = listing.shown[listing.active]
    column = layout.column(align=True)
    draw_paragraph(column, clip.path, "FILE")
    draw_paragraph(column, clip.words.replace("_", " ") or "No labels: the library does not use this clip", "BOOKMARKS")
    draw_paragraph(column, clip.figures, "TIME")
    draw_table(column, clip.messages.splitlines())
    row = layout.row(align=True)
    row.operator("beyond_mocap.import_clip", text="Import", icon="IMPORT").path = clip.path
    row.operator("beyond_mocap.annotate_clip", text="Annotate", icon="GREASEPENCIL").path = clip.path
    if body := draw_header(layout, "library_assets", "Assets"):
        draw_assets(body, listing)


def draw_assets(layout, listing) -> None:
    """Draw buttons that make assets of clips."""
    column = layout.column(align=True)
    column.operator("beyond_mocap.make_assets", text="Chosen Clip, This File", icon="ASSET_MANAGER").which = "CHOSEN"
    for apart, text, icon in ((False, "This File", "ASSET_MANAGER"), (True, "New File", "FILE_BLEND")):
        button = column.operator("beyond_mocap.make_assets", text=f"Listed ({len(listing.shown)}), {text}", icon=icon)
        button.which, button.apart = "SHOWN", apart
    column.operator("beyond_mocap.make_assets", text="Selected Armatures", icon="ARMATURE_DATA").which = "SELECTED"


def draw_open_clip(layout, context, settings) -> None:
    """Draw the operators for a clip that is in the scene."""
    thing = context.object
    box = layout.box()
    box.label(text=thing.name, icon="ARMATURE_DATA")
    column = box.column(align=True)
    row = column.row(align=True)
    row.operator("beyond_mocap.propose_words", icon="LIGHT")
    row.operator("beyond_mocap.propose_words", text="Review", icon="VIEWZOOM").review = True
    column.label(text="Learned Labels")
    column.prop(settings, "words_model", text="")
    with_progress(box, context, ("learning",), lambda row: row.operator("beyond_mocap.learn_words",
                  text="Learn from the Library", icon="OUTLINER_OB_LIGHTPROBE"))
    if thing.beyond_mocap_proposals.listed:
        draw_proposals(box, thing.beyond_mocap_proposals)
    column = box.column(align=True)
    column.operator("beyond_mocap.save_words", icon="FILE_TICK")
    column.operator("beyond_mocap.remove_clip", icon="TRASH")


def draw_proposals(layout, group) -> None:
    """Draw the list of proposals and its buttons."""
    layout.template_list("BEYOND_MOCAP_UL_proposals", "", group, "listed", group, active_propname="active", rows=4)
    if 0 <= group.active < len(group.listed):
        one = group.listed[group.active]
        draw_paragraph(layout, one.name.replace("_", " "), "BOOKMARKS")
        draw_paragraph(layout, f"{one.source}: {one.why}" if one.why else one.source, "INFO")
    column = layout.column(align=True)
    column.operator("beyond_mocap.review_proposals", icon="EVENT_A")
    row = column.row(align=True)
    row.operator("beyond_mocap.judge_proposal", text="Accept All", icon="CHECKMARK").what = "ACCEPT_ALL"
    row.operator("beyond_mocap.judge_proposal", text="Reject All", icon="X").what = "REFUSE_ALL"


def draw_tools(body, settings) -> None:
    """Draw rarely needed settings and operators."""
    body.use_property_split, body.use_property_decorate = True, False
    draw_automatic(body, settings, "library_unit", 0.01)
    body.prop(settings, "library_watch")
    body.operator("beyond_mocap.build_library", text="Build from Scratch", icon="FILE_REFRESH").rebuild = True
    body.operator("beyond_mocap.relink_library", icon="FILE_FOLDER")
    body.operator("beyond_mocap.import_clips", icon="IMPORT")
    body.operator("beyond_mocap.mirror", icon="MOD_MIRROR")
    body.operator("beyond_mocap.export_bvh", icon="EXPORT")
