"""What every feature in `scene/` stands on: the one watcher, and what is hung over Blender's windows."""
