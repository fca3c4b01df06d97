"""What every room of the scene stands on: channels, clock, jobs, the live watcher, registration, settings."""
