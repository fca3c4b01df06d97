"""The work of a match in pieces that any number of processes do.

- `stages`      what is spread over workers; `pool` the processes or the cluster, `work` the kinds of pieces
- `units`       a player's plan cut into windows of work; `windows` what the search finds for each, joined
- `named_edit`  an edit list that names its clips by path
"""
