"""Shared parts of the Blender side: channels, clock, jobs, the live watcher, registration, settings."""

REGISTERED = ("migrate", "notices", "settings")
