"""What a body looks like: a mesh for any skeleton, kit with shirt numbers, and a small picture drawn without Blender."""
