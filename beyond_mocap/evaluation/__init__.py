"""Figures of a take beside the recordings' own; the report page.

- `figures`    the report's groups of figures, the words' similarity among them (Faustino §3.2.2 eq. 18)
- `realism`    distance to the nearest recorded pose; the smoothness curve (Faustino App. D)
- `reference`  a library's own scores, once per library and rate, and a take beside them
- `per_frame`  figures of every frame, footprints, key moments in space: what overlays and curves show
- `report`     the Report JSON, reports side by side as a table, and which targets are met
- `html` and `plots` the report as a page; `html_page` what all reports' pages are built of
- `paired_tests` one way of doing something against another, subject by subject

    report = evaluate(take, track, library)
    print(table({"path": report, "blocks": other}))

What is measured of a take alone is in `synthesis.quality`. Speed classes are 0-1, 1-2, 2-3, 3-4.5 m/s and above; an
*own score* is the same figure on the uncut source clips, at the output's rate, over the frames that were used.
"""
