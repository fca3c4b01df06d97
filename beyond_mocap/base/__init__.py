"""The base: errors, small numerics and the settings table that every room uses."""
