"""Settings of live streams."""
# fmt: off

from .setting import EITHER, PARTS, Setting

PROTOCOLS = (
    ("udp", "UDP", "Frames arrive as datagrams"), ("tcp", "TCP", "The sender connects to this port"),
    ("call", "TCP, Call", "The sender waits on this port, as Axis Neuron and Axis Studio do"),
)

TABLES = {
    "stream": (
        Setting(name="protocol", default="udp", choices=PROTOCOLS, tooltip="How frames arrive"),
        Setting(name="port", default=7001, least=1024, most=65535, option="--port", tooltip="Port of this machine; "
                "connections from other machines are refused"),
        Setting(name="unit", default=0.0, least=0.0, most=10.0, unit="metres", tooltip="Metres in one unit of the "
                "stream; 0 guesses it from the body's size", precision=4),
        Setting(name="part", default="foot", choices=PARTS, tooltip="Part of the user's body that strikes"),
        Setting(name="side", default="either", choices=EITHER, tooltip="Side of the part, where there are two"),
        Setting(name="threshold", default=0.0, least=0.0, most=5.0, unit="metres", tooltip="Height in metres that "
                "the part has to exceed in a strike; 0 finds it automatically"),
    ),
    "stream.play": (
        Setting(name="bounces", default=0, least=0, most=5, tooltip="Bounces of the ball in each pass of Play Live"),
    ),
    "stream.way": (
        Setting(name="tcp", default=False, option="--tcp", help="connect to a listener (default: UDP datagrams)"),
        Setting(name="serve", default=False, option="--serve", help="wait until a listener connects, as Axis "
                "Neuron does"),
    ),
    "stream.send": (
        Setting(name="form", default="bvh", choices=("bvh", "neuron"), option="--form", help="form of the text; neuron "
                "has no hierarchy"),
        Setting(name="fps", kind=float, least=1.0, most=1000.0, option="--fps", metavar="RATE", help="frames per "
                "second (default: the file's)"),
        Setting(name="loop", default=False, option="--loop", help="repeat until Ctrl-C"),
    ),
}
