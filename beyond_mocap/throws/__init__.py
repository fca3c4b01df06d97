"""Generated throws and kicks at a target."""
