"""The work of a match in pieces that any number of processes can do.

- `stages`      what is distributed over workers; `pool` the processes or the cluster, `tasks` the kinds of pieces
- `units`       a player's plan cut into windows of work; `windows` what the search finds for each, joined
- `named_edit`  an edit list that names its clips by path
"""
