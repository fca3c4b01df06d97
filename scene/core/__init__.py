"""What every room of the scene stands on: channels, clock, jobs, handlers, registration."""
