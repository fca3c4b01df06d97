"""A whole match in pieces, made by any number of processes.

- `order`        what is asked; `folder` where it is made, by one run at a time; `state` what match.json says
- `make`         the whole way
- `roles`        who is there when and where; `words` what each does with the ball, by `event_clock` from events too
- `parts`        each player's orders; `player_edit` all that is kept of a player, and its file
- `expand`       the motion of any span of it; `shown` the same as it is to be seen; `match_ball` the ball
- `pieces`       the stages, the work in pieces and the processes that do it
- `crowd`        bodies kept apart
- `report`       the page over a match
"""
