"""What a user can do: a module per feature, each operator from settings to the core to the scene."""

from ..scene.core import registration


def register():
    """Register the operators, the command line and the keys."""
    registration.register_package(__name__)


def unregister():
    """Undo it, the last step first."""
    registration.unregister_package(__name__)
