"""The command line: what its verbs share, and verbs with a file of their own.

- `outputs`      where results may be written, and who writes them
- `progress_reporter` progress, notes, Ctrl-C
- `ride_path`    the verb `path`; `keep_apart`: a rider that goes round others
- `study`        the verb `study`: orders, forms and the analysis of what raters say
"""
