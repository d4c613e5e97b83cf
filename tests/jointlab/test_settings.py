"""Configuration: the environment over the file over defaults, and every mistake in it named."""

import tomllib
from datetime import date
from pathlib import Path

import pytest

from daq.channels import Bridge, BridgeConfiguration, ChannelKind
from jointlab.errors import SettingsError
from jointlab.instruments import channels_of
from jointlab.settings import Settings, load_settings
from jointlab.trials.simulated_laboratory import CHANNELS, as_toml, simulated_settings
from simlab.laboratory import Addresses
from tests.api.conftest import Command

ADDRESSES = Addresses("grpc://127.0.0.1:1", "tcp://127.0.0.1:2", "socket://127.0.0.1:3", "127.0.0.1:4")


@pytest.fixture
def config(jointlab: Command, tmp_path: Path) -> Path:
    """jointlab.toml of the working folder."""
    return tmp_path / "jointlab.toml"


def test_without_a_file_there_are_defaults(config: Path) -> None:
    settings = load_settings()
    assert settings.database_url == "sqlite:///jointlab.db"
    assert settings.daq_address == "local"
    assert settings.channels == ()


def test_the_environment_wins_over_the_file_and_the_file_over_defaults(
    config: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config.write_text('daq_address = "grpc://file:1"\ntester_url = "tcp://file:502"\n', encoding="utf-8")
    monkeypatch.setenv("JOINTLAB_TESTER_URL", "tcp://environment:502")
    settings = load_settings()
    assert settings.daq_address == "grpc://file:1"
    assert settings.tester_url == "tcp://environment:502"
    assert settings.thermometer_url == Settings.model_fields["thermometer_url"].default


def test_another_file_can_be_named(config: Path, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    config.write_text('daq_address = "grpc://here:1"\n', encoding="utf-8")
    (tmp_path / "other.toml").write_text('daq_address = "grpc://there:1"\n', encoding="utf-8")
    monkeypatch.setenv("JOINTLAB_CONFIG", str(tmp_path / "other.toml"))
    assert load_settings().daq_address == "grpc://there:1"


def test_the_file_of_a_simulated_laboratory_is_accepted_and_means_the_same(config: Path) -> None:
    text = as_toml(ADDRESSES)
    assert tomllib.loads(text)["daq_address"] == ADDRESSES.daq
    config.write_text(text, encoding="utf-8")
    assert load_settings() == simulated_settings(ADDRESSES, database_url="sqlite:///jointlab.db")
    assert load_settings().channels == CHANNELS
    assert load_settings().channels[0].calibrated_on == date(2026, 3, 2)


def test_a_simulated_laboratory_asks_neither_the_file_nor_the_environment(
    config: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config.write_text("broken =", encoding="utf-8")
    monkeypatch.setenv("JOINTLAB_WAVEFORM_FOLDER", "/the/laboratory's/own")
    assert simulated_settings(ADDRESSES).waveform_folder is None


CHANNEL = """
[[channels]]
name = "hammer"
physical = "cDAQ1Mod1/ai0"
kind = "force_iepe"
sensitivity = 2.25e-3
unit = "N"
minimum = -2000
maximum = 2000
"""


def test_a_channel_is_written_as_its_certificate_has_it(config: Path) -> None:
    written = (
        CHANNEL.replace("2.25e-3", '"2.25 mV/N"') + 'certificate = "K-17"\nuncertainty = 0.02\ndue_on = 2027-03-02\n'
    )
    config.write_text(written, encoding="utf-8")
    (channel,) = load_settings().channels
    assert channel.sensitivity == pytest.approx(2.25e-3)
    assert (channel.certificate, channel.uncertainty, channel.due_on) == ("K-17", 0.02, date(2027, 3, 2))


LOAD_CELL = CHANNEL.replace("force_iepe", "force_bridge").replace("2.25e-3", '"1 mV/V/kN"')


def test_a_load_cell_is_written_with_its_bridge(config: Path) -> None:
    config.write_text(LOAD_CELL + 'bridge = { excitation = 5, configuration = "half" }\n', encoding="utf-8")
    (channel,) = channels_of(load_settings())
    assert channel.kind is ChannelKind.FORCE_BRIDGE
    assert channel.sensitivity == pytest.approx(1e-6)
    assert channel.bridge == Bridge(5.0, BridgeConfiguration.HALF, 350.0)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (LOAD_CELL.replace("1 mV/V/kN", "1 mV/N").encode(), ["channels.0", "write 0.4 mV/V/kN"]),
        ((LOAD_CELL + "bridge = { excitation = -5 }").encode(), ["channels.0.bridge.excitation"]),
        ((LOAD_CELL + "bridge = { excitation = 5, arms = 4 }").encode(), ["channels.0.bridge.arms"]),
        (CHANNEL.replace("2.25e-3", '"100 mV/g"').encode(), ["channels.0", "m/s^2", "unit of the channel is N"]),
        (b"daq_address =", ["jointlab.toml is not valid TOML: Invalid value"]),
        (b'daq_address = "\xff"', ["jointlab.toml is not valid TOML", "utf-8"]),
        (b'daq_adress = "local"', ["jointlab.toml", "daq_adress: there is no such key"]),
        (b"daq_address = 7", ["daq_address: is 7, which is no text"]),
        (CHANNEL.replace('"N"', '"lbf"').encode(), ["channels.0.unit", "'N', 'm/s^2' or 'm'"]),
        (CHANNEL.replace("force_iepe", "force").encode(), ["channels.0.kind"]),
        (CHANNEL.replace("2.25e-3", "-1.0").encode(), ["channels.0.sensitivity"]),
        (CHANNEL.replace("name =", "nme =").encode(), ["channels.0.name: is missing", "channels.0.nme"]),
        (CHANNEL.replace('"hammer"', '"Hammer 1"').encode(), ["channels.0.name"]),
        ((CHANNEL + 'calibrated_on = "last year"').encode(), ["channels.0.calibrated_on"]),
    ],
)
def test_a_mistake_in_the_file_is_named_in_one_line(
    jointlab: Command, config: Path, content: bytes, words: list[str]
) -> None:
    config.write_bytes(content)
    answer = jointlab("config")
    assert answer.returncode == 3
    (line,) = answer.stderr.splitlines()
    for word in words:
        assert word in line


def test_a_mistake_in_the_environment_is_named(jointlab: Command, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JOINTLAB_CHANNELS", "[{")
    answer = jointlab("config")
    assert answer.returncode == 3
    (line,) = answer.stderr.splitlines()
    assert "channels" in line
    assert "JSON" in line


def test_a_file_that_is_named_and_not_there_is_not_passed_over(
    config: Path, monkeypatch: pytest.MonkeyPatch, jointlab: Command
) -> None:
    monkeypatch.setenv("JOINTLAB_CONFIG", "elsewhere.toml")
    with pytest.raises(SettingsError, match=r"JOINTLAB_CONFIG names elsewhere\.toml, which does not exist"):
        load_settings()
    assert jointlab("config").returncode == 3


def test_a_folder_in_place_of_the_file_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("JOINTLAB_CONFIG", str(tmp_path))
    with pytest.raises(SettingsError, match=f"names {tmp_path}, which is a folder; name the file"):
        load_settings()


def test_config_shows_where_each_value_comes_from_and_no_password(
    jointlab: Command, config: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    config.write_text(as_toml(ADDRESSES), encoding="utf-8")
    monkeypatch.setenv("JOINTLAB_DATABASE_URL", "postgresql://technician:secret@host/lab")
    answer = jointlab("config")
    assert answer.returncode == 0
    assert "file: jointlab.toml\n" in answer.stdout
    assert "database_url: postgresql://technician:***@host/lab  (from JOINTLAB_DATABASE_URL)\n" in answer.stdout
    assert "secret" not in answer.stdout
    assert "daq_address: grpc://127.0.0.1:1\n" in answer.stdout
    assert "channels: 4\n" in answer.stdout
    for channel in CHANNELS:
        assert f"  {channel.name}: {channel.physical}, {channel.kind}, " in answer.stdout


def test_config_says_where_there_is_no_file(jointlab: Command) -> None:
    answer = jointlab("config")
    assert answer.stdout.startswith("file: jointlab.toml (not there)\n")
    assert "channels: 0\n" in answer.stdout
