"""Every synthetic action: to add one, add a row to one of these tables.

Of several rows that answer to the requested labels one that suits the player's speed and the ball's height is taken,
then the first (`library.missing_actions.find_action`): the usual way to do it stands above the special ones.
"""

from __future__ import annotations

from .field_table import FIELD_ACTIONS
from .kick_table import KICK_ACTIONS
from .on_the_way import ON_THE_WAY_ACTIONS
from .pose_table import POSE_ACTIONS
from .receptions import LET_RUN_ACTIONS, RECEPTION_ACTIONS

ACTIONS = (*KICK_ACTIONS, *LET_RUN_ACTIONS, *FIELD_ACTIONS, *ON_THE_WAY_ACTIONS, *RECEPTION_ACTIONS,
           *POSE_ACTIONS)
