"""Settings of live streams."""
# fmt: off

from .setting import EITHER, PARTS, Setting

PROTOCOLS = (
    ("udp", "UDP", "Frames come as datagrams"), ("tcp", "TCP", "Who sends connects to this port"),
    ("call", "TCP, Call", "Who sends waits on this port, as Axis Neuron and Axis Studio do"),
)

TABLES = {
    "stream": (
        Setting(name="protocol", default="udp", choices=PROTOCOLS, tooltip="How frames come"),
        Setting(name="port", default=7001, least=1024, most=65535, option="--port", tooltip="Of this machine; nothing "
            "from outside gets in"),
        Setting(name="unit", default=0.0, least=0.0, most=10.0, unit="metres", tooltip="Metres in one unit of the "
            "stream; 0: guessed from the body's size", precision=4),
        Setting(name="part", default="foot", choices=PARTS, tooltip="What the user strikes with"),
        Setting(name="side", default="either", choices=EITHER, tooltip="Of what there are two"),
        Setting(name="threshold", default=0.0, least=0.0, most=5.0, unit="metres", tooltip="Metres above the ground "
            "that the part has to rise in a strike; 0: automatic"),
        Setting(name="bounces", default=0, least=0, most=5, tooltip="Of the ball on its way in Play Live"),
    ),
    "stream.way": (
        Setting(name="tcp", default=False, option="--tcp", help="connect to who listens (default: UDP datagrams)"),
        Setting(name="serve", default=False, option="--serve", help="wait until somebody connects, as Axis Neuron "
            "does"),
    ),
    "stream.send": (
        Setting(name="form", default="bvh", choices=("bvh", "neuron"), option="--form", help="of the text; neuron has "
            "no hierarchy"),
        Setting(name="fps", kind=float, least=1.0, most=1000.0, option="--fps", metavar="RATE", help="frames a second; "
            "default: the file's"),
        Setting(name="loop", default=False, option="--loop", help="again and again, until Ctrl-C"),
    ),
}
