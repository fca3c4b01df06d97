"""The ball, the second actor: how it flies, bounces and rolls, and how it must leave to arrive where it is wanted."""
