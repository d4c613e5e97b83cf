"""The instruments that the configuration names."""

from daq.channels import Channel, ChannelKind
from jointlab.errors import JointlabError
from jointlab.settings import Settings
from rig.instruments import Instruments


def instruments_of(settings: Settings) -> Instruments:
    """The instruments that the configuration names.

    Raises:
        JointlabError: the channel table is empty.
        ChannelError: a row of it makes no sense.
    """
    if not settings.channels:
        raise JointlabError(
            "the channel table is empty; write [[channels]] into jointlab.toml, or make one for simulated "
            "instruments: jointlab simulate --config jointlab.toml"
        )
    return Instruments(
        daq_address=settings.daq_address,
        tester_url=settings.tester_url,
        thermometer_url=settings.thermometer_url,
        channels=tuple(Channel(**(row.model_dump() | {"kind": ChannelKind(row.kind)})) for row in settings.channels),
        rig=settings.rig,
    )
