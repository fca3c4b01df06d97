"""What is drawn over the 3D view: where a take is off, where feet stood, where it is cut and why.

- `settings`  which of it is drawn, per scene
- `colours`   one table of colours that all eyes tell apart
- `shapes`    vertex arrays of soles, rails, bars, figures
- `prepare`   a take as vertex arrays and lines of text; knows neither bpy nor gpu
- `store`     which takes are prepared: in a thread, once per take, forgotten when no player shows them; where they lie
- `rides`     paths, trackers, residuals and the original motion of what rides a path
- `ball_paths` the trajectories of aimed balls and passing scenes, where they are struck and where they bounce
- `draw`      the handlers of the view: they only look up; the legend
"""
