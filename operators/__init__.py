"""The extension's operators, one module per feature: each takes settings, calls the core and changes the scene."""

from ..scene.core import registration


def register():
    """Register the operators, the command line and the keys."""
    registration.register_package(__name__)


def unregister():
    """Unregister them in reverse order."""
    registration.unregister_package(__name__)
