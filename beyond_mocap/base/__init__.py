"""What every feature stands on. `settings`: the table of all settings."""
