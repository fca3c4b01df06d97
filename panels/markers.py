"""The panel Optical Markers: a recording, its labels, and the reconstructed body."""

from __future__ import annotations

import bpy

from ..scene.markers.settings import find_active_label, find_target_cloud, show_name
from .tab import (
    TabPanel,
    create_value_column,
    draw_automatic,
    draw_paragraph,
    draw_section,
    draw_table,
    draw_values,
    with_progress,
)

MAX_MESSAGES = 6  # messages that are shown
ROLE_ICONS = {"OPTIONAL": "CHECKBOX_DEHLT", "STATIC": "ARMATURE_DATA", "BALL": "MESH_UVSPHERE", "OTHER": "CANCEL"}


class BEYOND_MOCAP_UL_markers(bpy.types.UIList):
    """The markers of a cloud."""

    def draw_item(self, _context, layout, _data, item, _icon, _active_data, _active_property):
        """Draw a marker: label, segment or role, and how often it is visible."""
        row = layout.split(factor=0.38)
        row.prop(item, "name", text="", emboss=False)
        right = row.split(factor=0.64)
        free = not item.segment and item.role not in ("BALL", "OTHER")
        carrier = item.segment or ("Ball" if item.role == "BALL" else "")
        right.label(text=show_name(carrier), icon="ERROR" if free else ROLE_ICONS.get(item.role, "BLANK1"))
        share = right.row()
        share.alignment, share.active = "RIGHT", item.seen < 99.95
        share.label(text=f"{item.seen:.0f} %")


class BEYOND_MOCAP_PT_markers(TabPanel, bpy.types.Panel):
    """Recordings of optical markers, and their reconstruction."""

    bl_label = "Optical Markers"
    task = "MARKERS"
    bl_order = 11

    def draw(self, context):
        """Draw the active cloud, section by section."""
        layout, cloud = self.layout, find_target_cloud(context)
        layout.operator("beyond_mocap.import_markers", icon="IMPORT")
        settings = context.scene.beyond_mocap_markers
        if cloud is None or settings.unit:
            draw_automatic(create_value_column(layout), settings, "unit", 0.001)
        if cloud is None:
            return
        properties = cloud.beyond_mocap_cloud
        layout.label(text=cloud.name, icon="POINTCLOUD_DATA")
        draw_section(layout, "markers_display", "Display", lambda opened: draw_display(opened, settings, properties))
        draw_section(layout, "markers_labels", "Labels & Segments", lambda opened: draw_labels(opened, properties),
                     closed=False)
        draw_section(layout, "markers_clean", "Clean Up", lambda opened: draw_clean_up(opened, context, properties))
        draw_section(layout, "markers_model", "Static Trial & Model", lambda opened: draw_model(opened, properties))
        draw_section(layout, "markers_pose", "Reconstruct", lambda opened: draw_pose(opened, context, properties),
                     closed=False)
        draw_section(layout, "markers_release", "Ball & Release", lambda opened: draw_release(opened, context,
                     properties))


def draw_display(layout, settings, properties) -> None:
    """Draw how the cloud is displayed."""
    column = create_value_column(layout)
    column.prop(settings, "names")
    column.prop(properties, "lines")
    column.prop(properties, "size")


def draw_labels(layout, properties) -> None:
    """Draw the list and the properties of the active marker."""
    chosen = f"Marker Set: {show_name(properties.set_name)}" if properties.set_name else "Marker Set"
    layout.operator_menu_enum("beyond_mocap.use_marker_set", "which", text=chosen, icon="PRESET")
    row = layout.row(align=True)
    row.operator("beyond_mocap.load_marker_set", text="Load Set", icon="FILE_FOLDER")
    row.operator("beyond_mocap.save_marker_set", text="Save Set", icon="FILE_TICK")
    layout.template_list("BEYOND_MOCAP_UL_markers", "", properties, "labels", properties,
                         active_propname="active_label", rows=5)
    layout.operator_menu_enum("beyond_mocap.assign_markers", "segment", text="Assign to Segment", icon="BONE_DATA")
    label = find_active_label(properties.id_data)
    if label is not None:
        column = create_value_column(layout)
        for name in ("segment", "landmark_words", "role"):
            column.prop(label, name)


def draw_lines(layout, text: str, icon: str) -> None:
    """Draw the first lines of a text, and how many more there are."""
    messages = text.splitlines()
    for line in messages[:MAX_MESSAGES]:
        draw_paragraph(layout, line, icon)
    if len(messages) > MAX_MESSAGES:
        layout.label(text=f"and {len(messages) - MAX_MESSAGES} more, in the Info editor", icon="BLANK1")


def draw_clean_up(layout, context, properties) -> None:
    """Draw the clean-up button and its report."""
    with_progress(layout, context, ("clean markers",), lambda row: row.operator("beyond_mocap.clean_markers",
                  icon="BRUSH_DATA"))
    draw_lines(layout, properties.cleaned, "DOT")


def draw_model(layout, properties) -> None:
    """Draw static trial and model."""
    column = create_value_column(layout)
    column.prop(properties, "static")
    layout.operator("beyond_mocap.set_static", icon="ARMATURE_DATA")
    column = create_value_column(layout)
    column.prop(properties, "model")
    column.prop(properties, "use_model")
    row = layout.row(align=True)
    row.operator("beyond_mocap.load_marker_model", text="Load Model", icon="FILE_FOLDER")
    row.operator("beyond_mocap.save_marker_model", text="Save Model", icon="FILE_TICK")


def draw_pose(layout, context, properties) -> None:
    """Draw the settings of the reconstruction, its button and its figures."""
    settings = context.scene.beyond_mocap_markers
    with_progress(layout, context, ("reconstruct markers",), lambda row: row.operator(
        "beyond_mocap.reconstruct_markers", icon="PLAY"))
    draw_section(layout, "markers_pose_settings", "Settings", lambda opened: draw_pose_settings(opened, settings))
    draw_table(layout, properties.figures.splitlines())
    draw_lines(layout, properties.messages, "INFO")


def draw_pose_settings(layout, settings) -> None:
    """Draw the settings of the reconstruction."""
    column = create_value_column(layout)
    column.prop(settings, "filter")
    if settings.filter != "none":
        column.prop(settings, "cutoff")
    for name in ("plant", "floor", "weights", "limits", "smoothness", "dressed", "add"):
        column.prop(settings, name)
    if settings.add:
        column.prop(settings, "words")


def draw_release(layout, context, properties) -> None:
    """Draw settings, button and figures of the release."""
    settings = context.scene.beyond_mocap_markers
    column = create_value_column(layout)
    draw_values(column, settings, ("hand", "thrown", "radius"), {"radius": 0.037})
    with_progress(layout, context, ("find release",), lambda row: row.operator("beyond_mocap.find_release",
                  icon="FORCE_FORCE"))
    draw_table(layout, properties.release.splitlines())
    if properties.ball is not None:
        create_value_column(layout).prop(properties, "ball")
