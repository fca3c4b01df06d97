"""A body's appearance: a mesh for any humanoid skeleton, kit, and a small picture without Blender."""
