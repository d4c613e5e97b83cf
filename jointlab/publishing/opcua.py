"""What a rig does, as variables of a server of OPC UA. No client may write, call or add anything."""

import asyncio
import logging
import socket
from contextlib import closing
from datetime import UTC, datetime
from importlib import import_module
from typing import TYPE_CHECKING, Any, NoReturn

from jointlab.background import in_background
from jointlab.client.connection import RigEvent
from jointlab.errors import JointlabError
from jointlab.publishing.service import BEFORE_THE_FIRST, Service, ServiceAwayError, answering_at_the_start
from jointlab.publishing.settings import OpcuaSettings
from jointlab.publishing.variables import (
    EVENT_VARIABLES,
    STATE_VARIABLES,
    VARIABLES,
    Values,
    Variable,
    event_values,
    state_values,
)
from store.extras import explained_imports

if TYPE_CHECKING:
    from asyncua.common.node import Node
    from asyncua.server.server import Server

log = logging.getLogger(__name__)

KINDS = {each.name: each.kind for each in VARIABLES}
NAMESPACE = "urn:jointlab:rig"
UNITS = "http://www.opcfoundation.org/UA/units/un/cefact"
STATE_INTERVAL = 1.0
"""Seconds between two requests for the state."""


def serve(settings: OpcuaSettings, rig: str, service: str, key: str | None) -> NoReturn:
    """Serve what a rig does until the program is ended.

    Args:
        settings: where to listen.
        rig: its name, which its object has.
        service: its address.
        key: of the service.

    Raises:
        JointlabError: the service cannot be used, or the address is taken. Later it waits for the service.
    """
    with explained_imports():
        _ua()  # what is missing is said before anything is asked
    with closing(Service(service, key)) as asked, closing(Service(service, key)) as followed:
        with answering_at_the_start():
            asked.rig()
        _check_address(settings)
        asyncio.run(_serve(settings, rig, asked, followed))
    raise AssertionError("it is served until an error")


def _check_address(settings: OpcuaSettings) -> None:
    try:
        socket.create_server((settings.host, settings.port)).close()
    except OSError as error:
        raise JointlabError(
            f"{settings.address} cannot be used: {error.strerror or error}; name another address, such as "
            "opc.tcp://127.0.0.1:4841"
        ) from error


async def _serve(settings: OpcuaSettings, rig: str, asked: Service, followed: Service) -> None:
    server = await _server(settings)
    variables = await _Variables.added(server, rig)
    loop = asyncio.get_running_loop()

    def tell(event: RigEvent) -> None:
        # waits, so that the service keeps what is not shown yet
        asyncio.run_coroutine_threadsafe(variables.show_event(event), loop).result()

    async with server:
        log.info("serves at %s", settings.address)
        events = in_background(lambda: followed.follow(BEFORE_THE_FIRST, tell))
        while not events.done():
            try:
                found = await asyncio.to_thread(asked.rig)
            except ServiceAwayError as away:
                await variables.show_away(str(away))
            else:
                await variables.show_state(state_values(found))
            await asyncio.sleep(STATE_INTERVAL)
        events.result()


async def _server(settings: OpcuaSettings) -> "Server":
    from asyncua.crypto.permission_rules import User, UserRole
    from asyncua.server.server import Server
    from asyncua.server.user_managers import UserManager

    class Readers(UserManager):
        """Everybody is a reader: asyncua's own manager lets a user called admin write."""

        def get_user(self, *_given: Any, **_further: Any) -> User:
            return User(role=UserRole.User)

    server = Server(user_manager=Readers())
    await server.init()
    server.set_endpoint(settings.address)
    server.set_server_name("Jointlab")
    server.set_security_policy([_ua().SecurityPolicyType.NoSecurity])
    return server


class _Variables:
    """The variables in the address space, with values, times and quality."""

    def __init__(self, nodes: dict[str, "Node"]) -> None:
        self._nodes = nodes
        self._last: dict[str, tuple[Any, datetime]] = {}
        self._trouble: str | None = None

    @classmethod
    async def added(cls, server: "Server", rig: str) -> "_Variables":
        """Variables of a new object, which is named after the rig."""
        index = await server.register_namespace(NAMESPACE)
        parent = await server.nodes.objects.add_object(_ua().NodeId(rig, index), f"{index}:{rig}")
        made = cls({each.name: await _add(parent, each, rig, index) for each in VARIABLES})
        for each in VARIABLES:
            await made._write(each.name, None, datetime.now(UTC))
        return made

    async def show_state(self, values: Values) -> None:
        """The service answers: values of the state, and again those of the last events."""
        if self._trouble is not None:
            log.info("the service answers again")
            self._trouble = None
            for each in EVENT_VARIABLES:
                if each.name in self._last:
                    await self._write(each.name, *self._last[each.name])
        for each in STATE_VARIABLES:
            value = values[each.name]
            if each.name not in self._last or self._last[each.name][0] != value:
                self._last[each.name] = value, datetime.now(UTC)
                await self._write(each.name, *self._last[each.name])

    async def show_event(self, event: RigEvent) -> None:
        """Values that an event changes, with its time."""
        for name, value in event_values(event).items():
            self._last[name] = value, event.at
            await self._write(name, value, event.at)

    async def show_away(self, why: str) -> None:
        """The service does not answer: no value is true any more."""
        if self._trouble is None:
            log.warning("the service is away: %s", why)
            for each in STATE_VARIABLES:
                self._last.pop(each.name, None)  # all of them are written again
            for node in self._nodes.values():
                await node.write_value(_data_value(None, "BadNoCommunication", datetime.now(UTC)))
        self._trouble = why

    async def _write(self, name: str, value: Any, at: datetime) -> None:
        if value is None:
            data_value = _data_value(None, "BadNoData", at)
        else:
            data_value = _data_value(_ua().Variant(value, _variant_type(KINDS[name])), "Good", at)
        await self._nodes[name].write_value(data_value)


def _data_value(value: Any, quality: str, at: datetime) -> Any:
    ua = _ua()
    return ua.DataValue(ua.Variant(None) if value is None else value, ua.StatusCode(quality), at)


async def _add(parent: "Node", variable: Variable, rig: str, index: int) -> "Node":
    ua = _ua()
    node = await parent.add_variable(
        ua.NodeId(f"{rig}.{variable.name}", index), f"{index}:{variable.name}", variable.kind(),
        varianttype=_variant_type(variable.kind),
    )  # fmt: skip
    text = ua.LocalizedText(variable.description)
    await node.write_attribute(ua.AttributeIds.Description, ua.DataValue(ua.Variant(text)))
    if variable.unit is not None:
        number = int.from_bytes(variable.unit_code.encode(), "big")  # as OPC UA makes ids from codes of UNECE
        shown = ua.LocalizedText(variable.unit)
        unit = ua.EUInformation(NamespaceUri=UNITS, UnitId=number, DisplayName=shown, Description=shown)
        await node.add_property(ua.NodeId(f"{rig}.{variable.name}.unit", index), "0:EngineeringUnits", unit)
    return node


def _variant_type(kind: type) -> Any:
    types = _ua().VariantType
    return {str: types.String, int: types.Int64, bool: types.Boolean, float: types.Double}[kind]


def _ua() -> Any:
    """Data types of OPC UA; those of asyncua are typed in a way that no value of Python fits."""
    return import_module("asyncua.ua")
