"""Settings of the stage."""

import bpy
from bpy.props import BoolProperty, EnumProperty

from ..core.properties import with_settings
from . import ball, stage

LIGHTS = (("DAYLIGHT", "Daylight", "Afternoon sun and a blue sky", "LIGHT_SUN", 0),
          ("FLOODLIGHT", "Floodlight", "Night, with four masts of floodlights", "LIGHT_AREA", 1))
VIEWS = (("FOLLOW", "Following", "From near the ground, moving with the players", "CON_FOLLOWTRACK", 0),
         ("BROADCAST", "Broadcast", "From the stand, panning and zooming with the play", "VIEW_CAMERA", 1),
         ("TACTICAL", "Tactical", "From high in the stand, with all players in the picture", "VIEW_ORTHO", 2),
         ("GOAL", "Behind Goal", "From behind the goal that the play is nearer to", "MOD_LATTICE", 3),
         ("EYES", "Player's Eye", "Through the eyes of the selected player", "HIDE_OFF", 4))


def _update_stage(settings, _context) -> None:
    """Rebuild the stage in the new light; nothing happens where there is none."""
    if stage.find_stage(settings.id_data) is not None:
        stage.create_stage(settings.id_data)


def _update_sport(settings, _context) -> None:
    """Rebuild the stage for another sport, in its regular size; its balls become that sport's."""
    ball.update_sport_balls(settings.id_data)
    if stage.find_stage(settings.id_data) is not None:
        stage.create_stage(settings.id_data, stage.find_sport(settings.id_data).size)


@with_settings("pitch", update=_update_sport)
class BeyondMocapStage(bpy.types.PropertyGroup):
    """How a scene's stage looks."""

    attached_to = ("Scene.beyond_mocap_stage",)

    light: EnumProperty(name="Light", items=LIGHTS, update=_update_stage, description="Light and sky of the stage")
    stands: BoolProperty(name="Stands", default=False, update=_update_stage,
                         description="Surround the pitch with stands and spectators")
