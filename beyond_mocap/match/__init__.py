"""Synthesis of a whole match in pieces, by any number of processes.

- `request`      what is requested; `folder` where the results are, one run at a time; `state` the content of match.json
- `synthesize_match`  all stages in order
- `roles`        who is present when and where; `labels` what each player does with the ball, with `event_clock` from
  events too; `moments` its records and text form, `duels` who reaches and misses, `goalkeeping` saves and places
- `player_plans` each player's plans; `player_edit` everything stored about a player; `player_file` its file
- `player_motion` the motion of any span of a player; `displayed_motion` the same as it is displayed; `match_ball` the
  ball
- `pieces`       the stages, the work in pieces and the processes that do it
- `crowd`        collision avoidance
- `report`       the page over a match
"""
