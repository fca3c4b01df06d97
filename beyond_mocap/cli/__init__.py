"""The command line: `main` has the parser, `outputs` what all verbs share; each other file has one verb or a few."""
