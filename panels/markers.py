"""The panel Optical Markers: a recording, its labels, and the reconstructed body."""

from __future__ import annotations

import bpy

from ..scene.markers.settings import active_label, cloud_meant
from .tab import Step, paragraph, section, split, table

MOST = 6  # messages that are shown
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
        right.label(text=carrier, icon="ERROR" if free else ROLE_ICONS.get(item.role, "BLANK1"))
        share = right.row()
        share.alignment, share.active = "RIGHT", item.seen < 99.95
        share.label(text=f"{item.seen:.0f} %")


class BEYOND_MOCAP_PT_markers(Step, bpy.types.Panel):
    """Recordings of optical markers, and their reconstruction."""

    bl_label = "Optical Markers"
    bl_order = 11
    bl_options = {"DEFAULT_CLOSED"}

    def draw(self, context):
        """Draw the active cloud, section by section."""
        layout, cloud = self.layout, cloud_meant(context)
        layout.operator("beyond_mocap.import_markers", icon="IMPORT")
        settings = context.scene.beyond_mocap_markers
        if cloud is None or settings.unit:
            split(layout).prop(settings, "unit")
        if cloud is None:
            return
        kept = cloud.beyond_mocap_cloud
        row = layout.row(align=True)
        row.label(text=cloud.name, icon="POINTCLOUD_DATA")
        row.prop(settings, "names", text="", icon="FONT_DATA")
        row.prop(kept, "lines", text="", icon="MOD_WIREFRAME")
        row.prop(kept, "size", text="")
        section(layout, "markers_labels", "Labels & Segments", lambda opened: labels(opened, kept), closed=False)
        section(layout, "markers_clean", "Clean Up", lambda opened: clean(self, opened, context, kept))
        section(layout, "markers_model", "Static Trial & Model", lambda opened: model(opened, kept))
        section(layout, "markers_pose", "Reconstruct", lambda opened: pose(self, opened, context, kept), closed=False)
        section(layout, "markers_release", "Ball & Release", lambda opened: release(self, opened, context, kept))


def labels(layout, kept) -> None:
    """Draw the list and the properties of the active marker."""
    row = layout.row(align=True)
    row.operator_menu_enum("beyond_mocap.use_marker_set", "which", text=kept.set_name or "Marker Set", icon="PRESET")
    row.operator("beyond_mocap.load_marker_set", text="", icon="FILE_FOLDER")
    row.operator("beyond_mocap.save_marker_set", text="", icon="FILE_TICK")
    layout.template_list("BEYOND_MOCAP_UL_markers", "", kept, "labels", kept, active_propname="active_label", rows=5)
    layout.operator_menu_enum("beyond_mocap.assign_markers", "segment", text="Assign to Segment", icon="BONE_DATA")
    label = active_label(kept.id_data)
    if label is not None:
        column = split(layout)
        for name in ("segment", "landmark", "role"):
            column.prop(label, name)


def lines(layout, text: str, icon: str) -> None:
    """Draw the first lines of a text, and how many more there are."""
    told = text.splitlines()
    for line in told[:MOST]:
        paragraph(layout, line, icon)
    if len(told) > MOST:
        layout.label(text=f"and {len(told) - MOST} more, in the Info editor", icon="BLANK1")


def clean(panel, layout, context, kept) -> None:
    """Draw the clean-up button and its report."""
    layout.operator("beyond_mocap.clean_markers", icon="BRUSH_DATA")
    panel.progress(context, "clean markers")
    lines(layout, kept.cleaned, "DOT")


def model(layout, kept) -> None:
    """Draw static trial and model."""
    column = split(layout)
    column.prop(kept, "static")
    layout.operator("beyond_mocap.set_static", icon="ARMATURE_DATA")
    column = split(layout)
    column.prop(kept, "model")
    column.prop(kept, "use_model")
    row = layout.row(align=True)
    row.operator("beyond_mocap.load_marker_model", text="Load Model", icon="FILE_FOLDER")
    row.operator("beyond_mocap.save_marker_model", text="Save Model", icon="FILE_TICK")


def pose(panel, layout, context, kept) -> None:
    """Draw the settings of the reconstruction, its button and its figures."""
    settings = context.scene.beyond_mocap_markers
    column = split(layout)
    column.prop(settings, "filter")
    if settings.filter != "none":
        column.prop(settings, "cutoff")
    for name in ("plant", "floor", "weights", "limits", "smoothness", "dressed", "add"):
        column.prop(settings, name)
    if settings.add:
        column.prop(settings, "words")
    row = layout.row()
    row.scale_y = 1.3
    row.operator("beyond_mocap.reconstruct_markers", icon="PLAY")
    panel.progress(context, "reconstruct markers")
    table(layout, kept.figures.splitlines())
    lines(layout, kept.told, "INFO")


def release(panel, layout, context, kept) -> None:
    """Draw settings, button and figures of the release."""
    settings = context.scene.beyond_mocap_markers
    column = split(layout)
    for name in ("hand", "thrown", "radius"):
        column.prop(settings, name)
    layout.operator("beyond_mocap.find_release", icon="FORCE_FORCE")
    panel.progress(context, "find release")
    table(layout, kept.release.splitlines())
    if kept.ball is not None:
        split(layout).prop(kept, "ball")
