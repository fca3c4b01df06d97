"""The command line: `main` has the parser, `outputs` what all verbs share, each other file a verb or some alike."""
