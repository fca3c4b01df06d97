"""What all rooms of `scene` stand on. `properties`: the settings as properties of Blender's classes."""
