"""How characters look: build, hair, skin and gloves of the selected ones."""

import bpy
from bpy.props import BoolProperty, EnumProperty

from ..scene.stage import body
from .operator_base import NEEDS_NO_EDITING, BaseOperator

BUILD_ITEMS = (("slim", "Slim", "Smaller girths"), ("normal", "Normal", "An athlete's girths"),
               ("strong", "Strong", "Larger girths"), ("woman", "Woman", "A woman's girths"))
HAIR_ITEMS = (("short", "Short", "Short hair, longer on top"), ("crop", "Crop", "Very short hair"),
              ("curly", "Curly", "Thick curls"), ("tied", "Tied", "Long hair, tied to a tail"),
              ("bald", "Bald", "No hair"))
SKIN_ITEMS = tuple((str(i), name, f"{name} skin") for i, name in enumerate(
    ("Fair", "Light", "Medium", "Brown", "Dark", "Deep")))
COLOUR_ITEMS = tuple((str(i), name, f"{name} hair") for i, name in enumerate(
    ("Black", "Dark Brown", "Brown", "Dark Blond", "Blond")))


class BEYOND_MOCAP_OT_change_look(BaseOperator, bpy.types.Operator):
    """Change build, hair, skin and gloves of the selected characters; kits stay, edits of the mesh are replaced"""

    bl_idname = "beyond_mocap.change_look"
    bl_label = "Change Look"
    needs = (*NEEDS_NO_EDITING, "Select a character that was made here",
             lambda context: bool(body.list_characters(context)))
    build: EnumProperty(name="Build", items=BUILD_ITEMS, default="normal", description="Girths of the body")
    hair: EnumProperty(name="Hair", items=HAIR_ITEMS, default="short", description="Shape of the hair")
    skin: EnumProperty(name="Skin", items=SKIN_ITEMS, default="1", description="Tone of the skin")
    colour: EnumProperty(name="Hair Color", items=COLOUR_ITEMS, default="1", description="Colour of the hair")
    gloves: BoolProperty(name="Gloves", default=False, description="Wear a goalkeeper's gloves")
    light: BoolProperty(name="Few Faces", default=False, description="Use the light body for many players at once")

    def invoke(self, context, event):
        """Show the choices first."""
        return context.window_manager.invoke_props_dialog(self)

    def do(self, context):
        """Make the bodies with this look."""
        from ..beyond_mocap.appearance.look import Look  # the core loads when it is first used

        look = Look(build=self.build, hair=self.hair, skin=int(self.skin), colour=int(self.colour),
                    gloves=self.gloves)
        for character in body.list_characters(context):
            body.change_look(character, context.scene, look, self.light)
