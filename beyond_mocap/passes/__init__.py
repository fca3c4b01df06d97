"""Players who keep a ball going; motion streamed live (Ball handling)."""
