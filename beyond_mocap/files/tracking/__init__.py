"""Read positional tracking data: the project's own CSV and providers' files."""
