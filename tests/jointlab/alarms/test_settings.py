"""The table [alarms]: what does not fit is named, and no secret is shown."""

from pathlib import Path

import pytest

from jointlab.alarms.alarms import channels_of
from jointlab.errors import SettingsError
from jointlab.settings import load_settings
from tests.api.conftest import Command, jointlab

__all__ = ["jointlab"]
URL = "https://hooks.example/services/T0/B1/a-secret-path"
WHOLE = f"""
[alarms]
failed_jobs = true
[alarms.webhook]
url = "{URL}"
[alarms.mail]
host = "mail.lab.example"
user = "rig"
sender = "rig@lab.example"
to = ["ann@lab.example"]
[alarms.relay]
url = "/dev/ttyUSB1"
line = "rts"
"""


@pytest.fixture
def config(jointlab: Command, tmp_path: Path) -> Path:
    return tmp_path / "jointlab.toml"


def test_the_configuration_is_shown_without_any_secret(
    config: Path, jointlab: Command, monkeypatch: pytest.MonkeyPatch
) -> None:
    config.write_text(WHOLE, encoding="utf-8")
    monkeypatch.setenv("JOINTLAB_WEBHOOK_SECRET", "very-secret")
    monkeypatch.setenv("JOINTLAB_MAIL_PASSWORD", "very-secret")
    channels = channels_of(load_settings().alarms)
    assert [channel.name for channel in channels] == ["webhook", "mail"]
    shown = jointlab("config")
    assert shown.returncode == 0
    assert "mail.lab.example" in shown.stdout
    for text in (shown.stdout, repr(load_settings()), repr(channels), load_settings().model_dump_json()):
        assert "a-secret-path" not in text
        assert "very-secret" not in text


def test_a_user_of_the_mail_server_needs_a_password_in_the_environment(config: Path) -> None:
    config.write_text(WHOLE, encoding="utf-8")
    with pytest.raises(SettingsError, match="JOINTLAB_MAIL_PASSWORD"):
        channels_of(load_settings().alarms)


@pytest.mark.parametrize(
    ("table", "why"),
    [
        ('[alarms.webhook]\nurl = "file:///etc/passwd"', "http or https"),
        ('[alarms.webhook]\nurl = "https://b.c/a secret path"', "without spaces"),
        ('[alarms.webhook]\nurl = "https://ann:word@b.c/"', "without a user"),
        ('[alarms.webhook]\nurl = "https://b.c/"\nsecret = "x"', "there is no such key"),
        ('[alarms.mail]\nhost = "h"\nsender = "a@b.c"\nto = ["d@e.f\\nBcc: g@h.i"]', "is no address"),
        ('[alarms.mail]\nhost = "h"\nsender = "a@b.c"\nto = ["d@e.f"]\nuser = "u"\nsecurity = "none"', "encryption"),
        ('[alarms.relay]\nurl = "COM1"', "give line, or both on and off"),
        ('[alarms.relay]\nurl = "COM1"\non = "a0f"\noff = "00"', "on: is 'a0f'; write two hexadecimal digits"),
    ],
)
def test_what_does_not_fit_is_named(config: Path, table: str, why: str) -> None:
    config.write_text(table, encoding="utf-8")
    with pytest.raises(SettingsError, match=why):
        load_settings()
