"""Let Rigify generate a control rig and save it: `python rigify_rig.py OUT.blend`.

In a process of its own, because the add-on leaves things behind in 4.5 with which Python cannot end.
"""

import os
import sys

import bpy

# isort: split
import addon_utils  # bpy brings it

bpy.ops.wm.read_homefile(use_empty=True)
addon_utils.enable("rigify", default_set=True)
bpy.ops.object.armature_basic_human_metarig_add()
meta = bpy.context.object
bpy.ops.pose.rigify_generate()
rig = meta.data.rigify_target_rig
bpy.data.objects.remove(meta)
bpy.data.libraries.write(sys.argv[-1], {rig})
os._exit(0)
