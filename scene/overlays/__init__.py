"""Overlays of the 3D view: where a take leaves the track, where feet were in contact, where it is cut and why.

- `settings`       which overlays are drawn, per scene
- `colours`        one colour table for every kind of colour vision
- `shapes`         vertex arrays of soles, rails, bars, figures
- `prepare`        a take as vertex arrays and lines of text; independent of bpy and gpu
- `store`          prepares takes in a thread, once each, and drops them when no player shows them; their place
- `path_overlays`  paths, trackers, residuals and the original motion of edited bodies
- `ball_paths`     trajectories of aimed balls and passing scenes, with strikes and bounces
- `momentum_traces` which armatures show their momentum, and its trace, once for each change of the motion
- `momentum`       centre of mass, flights, support polygon and ground force at the current frame
- `draw`           the handlers of the view, which only look up; the legend
"""

REGISTERED = ("draw", "momentum_traces", "player_names", "settings", "store")
