"""What a body looks like: a mesh for any skeleton, kit, a small picture without Blender."""
