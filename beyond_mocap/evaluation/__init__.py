"""Measure a take beside the recordings of its library, and report it.

- `figures`    the report's groups of figures; `annotation_similarity` that of labels (Faustino §3.2.2 eq. 18)
- `realism`    distance to the nearest recorded pose; the smoothness curve (Faustino App. D)
- `view`       a take beside its track and the recordings of its library
- `reference`  a library's own scores, once per library and frame rate, kept beside the library's cache
- `naturalness` and `touches` what the eye sees: of the body's course, and at the ball; their groups of figures in
               `naturalness_figures`, `touch_figures`, how pages name them in `titles`
- `physics`, `sprint_form` and `boots` how a body's mass, limbs and soles move; one body in `body_physics`, the group of
               figures in `physics_figures`
- `touch_view` the touches of a take, measured once; `contact_figures` whether they meet the ball, and can
- `per_frame`  figures of every frame, footprints, key moments in space, for overlays and curves
- `report`     the report as JSON, flat, and which targets are met
- `html` and `plots` the report as a page; `html_page` the parts of all reports' pages
- `paired_tests` compare one method with another, subject by subject
- `two_sample_test` whether classifiers can distinguish takes from recordings

    report = evaluate(take, track, library)
    print(flatten_report(report)["root_error_m.mean"])

Figures of a take alone are in `synthesis.quality`. Speed classes are 0-1, 1-2, 2-3, 3-4.5 m/s and above; an *own score*
is the same figure on the uncut source clips, at the output's frame rate, over the frames that were used.
"""
