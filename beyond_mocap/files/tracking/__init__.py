"""Positional tracking: the contract's own CSV and providers' files."""
