"""A motion on other bones: anatomy, neutral stance, bone maps."""
