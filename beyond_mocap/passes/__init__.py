"""Players who keep a ball going: hits, pass planning, bodies, live scenes (Ball handling)."""
