"""`jointlab config`: the configuration and its sources."""

import os

from sqlalchemy import make_url
from sqlalchemy.exc import ArgumentError

from api.commands.terminal import out
from daq.channels import ChannelKind
from jointlab.errors import SettingsError
from jointlab.sensitivity import sensitivity_text
from jointlab.settings import config_path, load_settings


def config() -> None:
    """Show the configuration in force: JOINTLAB_* variables, then jointlab.toml, then defaults."""
    settings = load_settings()
    path = config_path()
    out.print(f"file: {path}{'' if path.is_file() else ' (not there)'}")
    for name in type(settings).model_fields:
        if name == "channels":
            continue
        variable = f"JOINTLAB_{name.upper()}"
        value = getattr(settings, name)
        shown = without_password(value) if name == "database_url" else value
        out.print(f"{name}: {shown}{f'  (from {variable})' if variable in os.environ else ''}")
    out.print(f"channels: {len(settings.channels)}")
    for row in settings.channels:
        at_input = ChannelKind(row.kind).input_unit
        calibrated = f"calibrated {row.calibrated_on}" if row.calibrated_on else "not calibrated"
        due = f", valid until {row.due_on}" if row.due_on else ""
        out.print(
            f"  {row.name}: {row.physical}, {row.kind}, {sensitivity_text(row.sensitivity, row.unit, at_input)}, "
            f"{row.minimum:g} to {row.maximum:g} {row.unit}, serial {row.serial or 'unknown'}, {calibrated}{due}"
        )


def without_password(url: str) -> str:
    """The address of a database as it may be shown.

    Raises:
        SettingsError: it is no address.
    """
    try:
        return make_url(url).render_as_string(hide_password=True)
    except ArgumentError as error:
        raise SettingsError(f"database_url {url!r} is not the address of a database") from error
