"""Plug-ins of instruments: an installed package is selected by the scheme of an address, and its faults are named."""

import wave
from pathlib import Path

import pytest

from jointlab.errors import JointlabError
from jointlab.instruments import codec_of, instruments_of, open_source_of
from jointlab.settings import Settings
from jointlab.trials.simulated_laboratory import CHANNELS
from tests.jointlab.structures.test_plug_ins import EXAMPLES, install

PACKAGE = """
class Codec:
    def __init__(self, url): self.url = url
    def encode(self, request): return b"?"
    def decode(self, request, received): return []

def broken(url): raise OSError("no licence")
def other(host, port): return Codec(host)
"""


@pytest.fixture
def packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder with two packages as pip installs them: the example of the documentation, and some codecs."""
    monkeypatch.syspath_prepend(str(tmp_path))
    example = (EXAMPLES / "own_daq.py").read_text(encoding="utf-8")
    install(tmp_path, "wav_of_ours", example, "[jointlab.daq]", "wav = wav_of_ours:open_source", "none = no_such:x")
    entries = ("text = codecs_of_ours:Codec", "broken = codecs_of_ours:broken", "other = codecs_of_ours:other")
    install(tmp_path, "codecs_of_ours", PACKAGE, "[jointlab.testers]", *entries, "no_codec = codecs_of_ours:str")
    return tmp_path


def settings(**addresses: str) -> Settings:
    return Settings.model_construct(None, thermometer_url="/dev/null", channels=CHANNELS, **addresses)


def test_the_scheme_of_an_address_selects_an_installed_plug_in(packages: Path) -> None:
    with wave.open(str(packages / "two.wav"), "wb") as file:
        file.setnchannels(2)
        file.setsampwidth(2)
        file.setframerate(8000)
        file.writeframes(bytes(64))
    url = "text+tcp://127.0.0.1:9"
    found = instruments_of(settings(daq_address=f"wav://{packages / 'two.wav'}", tester_url=url))
    with found.daq() as instrument:
        assert instrument.devices[0].inputs == ("wav/ai0", "wav/ai1")
    assert getattr(found.tester_map.codec, "url", "") == url


def test_addresses_without_a_plug_in_are_those_of_the_built_in_drivers(packages: Path) -> None:
    found = instruments_of(settings(daq_address="grpc://host:1", tester_url="rtu:///dev/ttyS0"))
    assert (found.open_source, found.tester_map.codec) == (None, None)


@pytest.mark.parametrize(
    ("addresses", "says"),
    [
        ({"daq_address": "sound://0"}, r"sound://0: no installed package offers the plug-in 'sound' in jointlab.daq"),
        ({"daq_address": "none://0"}, r"the plug-in none \(no_such:x\) cannot be imported"),
        ({"tester_url": "http://host"}, r"'http' in jointlab.testers, there is broken, no_codec, other, text"),
        ({"tester_url": "broken+tcp://host:1"}, r"the plug-in broken could not be made for .*OSError: no licence"),
        ({"tester_url": "other+tcp://host:1"}, r"the plug-in other is no function of an address alone .missing.*port"),
        ({"tester_url": "no_codec+tcp://host:1"}, "no_codec"),
    ],
)
def test_what_is_wrong_with_a_plug_in_is_said_before_anything_is_opened(
    packages: Path, addresses: dict[str, str], says: str
) -> None:
    with pytest.raises(JointlabError, match=says):
        instruments_of(settings(**({"daq_address": "local", "tester_url": "tcp://host:1"} | addresses)))


def test_a_plug_in_that_is_not_installed_is_named_by_its_file() -> None:
    assert open_source_of("anything://0", f"{EXAMPLES / 'own_daq.py'}:open_source") is not None
    with pytest.raises(JointlabError, match="there is no file"):
        codec_of("tcp://host:1", "no_such.py:codec")
