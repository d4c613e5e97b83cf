"""`jointlab opcua`: serve what the rig does as variables of OPC UA."""

from typing import Annotated

import typer
from pydantic import ValidationError

from api.commands.log_options import LogFormOption, LogLevel, with_log_options
from api.commands.service_options import RigOption, ServiceOption, rig_of, service_of
from jointlab.alarms.settings import secret_of
from jointlab.errors import JointlabError
from jointlab.logs import write_logs
from jointlab.publishing.opcua import serve
from jointlab.publishing.settings import SERVICE_KEY, OpcuaSettings
from jointlab.settings import describe, load_settings


def opcua(
    address: Annotated[
        str | None, typer.Argument(help="Where to listen: opc.tcp://host:port; that of the configuration by default.")
    ] = None,
    service: ServiceOption = None,
    rig: RigOption = None,
    log_level: LogLevel = None,
    log_form: LogFormOption = None,
) -> None:
    """Serve what the rig does as variables of OPC UA, until interrupted (Ctrl-C). They can be read and not written.

    It asks a running service, whose key is in JOINTLAB_SERVICE_KEY (scope read:data), and needs the extra `opcua`.
    While the service is away, all values are bad. Who reaches the address reads them without a key.
    """
    settings = with_log_options(load_settings(), log_level, log_form)
    try:
        chosen = settings.publishing.opcua if address is None else OpcuaSettings(address=address)
    except ValidationError as error:
        raise JointlabError(describe(error)) from error
    name, asked = rig_of(settings, rig), service_of(settings, service)
    write_logs(settings.log)
    serve(chosen, name, asked, secret_of(SERVICE_KEY))
