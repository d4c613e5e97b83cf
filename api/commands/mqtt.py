"""`jointlab mqtt`: publish what the rig does to a broker of MQTT."""

from typing import Annotated

import typer
from pydantic import ValidationError

from api.commands.log_options import LogFormOption, LogLevel, with_log_options
from api.commands.service_options import RigOption, ServiceOption, rig_of, service_of
from jointlab.alarms.settings import secret_of
from jointlab.errors import JointlabError
from jointlab.logs import write_logs
from jointlab.publishing.mqtt import publish
from jointlab.publishing.settings import MQTT_PASSWORD, SERVICE_KEY, MqttSettings
from jointlab.settings import Settings, describe, load_settings


def mqtt(
    broker: Annotated[
        str | None, typer.Argument(help="mqtt://host:port or mqtts://host:port; that of the configuration by default.")
    ] = None,
    user: Annotated[str | None, typer.Option(help="Who logs in; the password is in JOINTLAB_MQTT_PASSWORD.")] = None,
    prefix: Annotated[str | None, typer.Option(help="Topics begin with it and the rig's name.")] = None,
    service: ServiceOption = None,
    rig: RigOption = None,
    log_level: LogLevel = None,
    log_form: LogFormOption = None,
) -> None:
    """Publish what the rig does to a broker of MQTT, until interrupted (Ctrl-C). It reads only; nobody can command it.

    It asks a running service, whose key is in JOINTLAB_SERVICE_KEY (scope read:data), and needs the extra `mqtt`. When
    service or broker have gone, it waits for them.
    """
    settings = with_log_options(load_settings(), log_level, log_form)
    chosen = mqtt_settings(settings, broker, user, prefix)
    name, address = rig_of(settings, rig), service_of(settings, service)
    write_logs(settings.log)
    publish(chosen, secret_of(MQTT_PASSWORD), name, address, secret_of(SERVICE_KEY))


def mqtt_settings(settings: Settings, broker: str | None, user: str | None, prefix: str | None) -> MqttSettings:
    """The settings of the broker with what was given on the command line.

    Raises:
        JointlabError: no broker is named, or a value does not fit.
    """
    configured = settings.publishing.mqtt
    stated = {} if configured is None else configured.model_dump()
    options = {"broker": broker, "user": user, "prefix": prefix}
    given = stated | {name: value for name, value in options.items() if value is not None}
    if "broker" not in given:
        raise JointlabError("name the broker: jointlab mqtt mqtt://host:1883, or `broker` in [publishing.mqtt]")
    try:
        return MqttSettings(**given)
    except ValidationError as error:
        raise JointlabError(describe(error)) from error
