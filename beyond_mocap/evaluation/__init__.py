"""Figures of a take beside the recordings' own; the report page.

- `root`       on the track: root and pelvis error, sway, surge, speeds, what the library can play
- `feet`       on the ground: skate on contacts, slide per stance, GMD's ratio, support, the lock's corrections
- `pieces`     read off the provenance: seams, warp rate, replayed loops
- `jerk`       seams against uncut recordings of the same speed
- `words`      annotation similarity (Faustino §3.2.2 eq. 18)
- `realism`    distance to the nearest recorded pose; the smoothness curve (Faustino App. D)
- `moments`    what became of each key moment, and how near the striking surface was to the ball
- `give_way`   what gave way, and at which seconds
- `played`     what was played, from a take in memory or from files
- `reference`  a library's own scores, once per library and rate
- `per_frame`  figures of every frame, footprints, key moments in space: what overlays and curves show
- `view`, `figures`, `report`  the Report JSON, and reports side by side as a table
- `targets`    what each figure aims for, and `judged` whether it is met; `html` and `plots` the report as a page

    report = evaluate(take, track, library)
    print(table({"path": report, "blocks": other}))

Functions in the upper half take plain arrays. Speed classes are 0-1, 1-2, 2-3, 3-4.5 m/s and above; an *own score* is
the same figure on the uncut source clips, at the output's rate, over the frames that were used.
"""
