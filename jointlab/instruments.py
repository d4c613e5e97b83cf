"""The instruments that the configuration names, those of plug-ins too.

The scheme of an address selects a plug-in, as in `daq_address = "soundcard://hw:1"` or `tester_url =
"text+tcp://host:port"`. What a plug-in offers is in `daq.stream` and in `rig.tester.codec`:

    [project.entry-points."jointlab.daq"]
    soundcard = "our_soundcard:open_source"
    [project.entry-points."jointlab.testers"]
    text = "our_controller:make_codec"
"""

import inspect
from dataclasses import replace
from importlib.metadata import entry_points
from typing import Any

from daq.channels import Bridge, BridgeConfiguration, Channel, ChannelKind
from daq.stream import OpenSource
from jointlab.errors import JointlabError
from jointlab.plug_ins import plug_in
from jointlab.settings import BridgeSettings, ChannelSettings, Settings
from rig.instruments import Instruments
from rig.tester.codec import TesterCodec
from rig.tester.register_map import OURS
from rig.tester.register_map_file import read_tester_map

DAQ, TESTERS = "jointlab.daq", "jointlab.testers"
"""Groups of entry points."""
BUILT_IN = {DAQ: ("grpc",), TESTERS: ("tcp", "rtu")}


def open_source_of(address: str, name: str = "") -> OpenSource | None:
    """The function that opens the acquisition instrument at `address`; None for NI-DAQmx.

    Args:
        address: whose scheme is the name of a plug-in.
        name: of an entry point, `package.module:object` or `file.py:object`, in place of that.

    Raises:
        JointlabError: there is no such plug-in, or it takes no address.
    """
    name = name or _scheme(DAQ, address, address.partition("://")[0] if "://" in address else "")
    return _function(DAQ, name, address) if name else None


def codec_of(url: str, name: str = "") -> TesterCodec | None:
    """The codec of the tester at `url`, `name+tcp://...`; None for Modbus. Arguments and errors as `open_source_of`."""
    scheme = url.partition("://")[0]
    plug = scheme.rpartition("+")[0] or scheme if "://" in url else ""
    name = name or _scheme(TESTERS, url, plug)
    if not name:
        return None
    make = _function(TESTERS, name, url)
    try:
        codec = make(url)
    except Exception as error:  # a plug-in of others may raise anything
        raise JointlabError(
            f"the plug-in {name} could not be made for {url} ({type(error).__name__}: {error})"
        ) from error
    if missing := [each for each in ("encode", "decode") if not callable(getattr(codec, each, None))]:
        raise JointlabError(f"the plug-in {name} made no codec: it lacks {', '.join(missing)}; see docs/plug_ins.md")
    made: TesterCodec = codec
    return made


def _scheme(group: str, address: str, scheme: str) -> str:
    """The plug-in that `scheme` names; empty where it is none of a plug-in. Raises JointlabError for an unknown one."""
    offered = [each.name for each in entry_points(group=group)]
    if not scheme or scheme in BUILT_IN[group]:
        return ""
    if scheme not in offered:
        known = ", ".join(sorted(offered)) or "none"
        raise JointlabError(
            f"{address}: no installed package offers the plug-in {scheme!r} in {group}, there is {known}; install its "
            "package into this environment, or correct the address"
        )
    return scheme


def _function(group: str, name: str, address: str) -> Any:
    found = plug_in(group, name, "plug-in")
    try:
        inspect.signature(found).bind(address)
    except (TypeError, ValueError) as error:
        raise JointlabError(
            f"the plug-in {name} is no function of an address alone ({error}); see docs/plug_ins.md"
        ) from error
    return found


def channels_of(settings: Settings) -> tuple[Channel, ...]:
    """The channel table. Raises ChannelError where a row of it makes no sense."""
    return tuple(map(channel_of, settings.channels))


def channel_of(row: ChannelSettings) -> Channel:
    """The channel of a row. Raises ChannelError where it makes no sense."""
    return Channel(**(row.model_dump() | {"kind": ChannelKind(row.kind), "bridge": _bridge(row.bridge)}))


def _bridge(given: BridgeSettings | None) -> Bridge | None:
    if given is None:
        return None
    return Bridge(given.excitation, BridgeConfiguration(given.configuration), given.resistance)


def instruments_of(settings: Settings) -> Instruments:
    """The instruments that the configuration names.

    Raises:
        JointlabError: the channel table is empty, or a plug-in is missing or does not fit.
        ChannelError: a row of it makes no sense.
        TesterMapError: the tester's map makes no sense.
    """
    if not settings.channels:
        raise JointlabError(
            "the channel table is empty; write [[channels]] into jointlab.toml, or make one for simulated "
            "instruments: jointlab simulate --config jointlab.toml"
        )
    tester_map = OURS if settings.tester_map is None else read_tester_map(settings.tester_map)
    return Instruments(
        daq_address=settings.daq_address,
        tester_url=settings.tester_url,
        thermometer_url=settings.thermometer_url,
        channels=channels_of(settings),
        rig=settings.rig,
        tester_map=replace(tester_map, codec=codec_of(settings.tester_url)) if settings.tester_url else tester_map,
        tester_without=frozenset(settings.tester_without),
        open_source=open_source_of(settings.daq_address),
        external_patience=settings.external_patience,
    )
