"""Configuration of programs that publish a rig: the table [publishing]. Secrets come from the environment alone."""

from typing import Literal
from urllib.parse import urlsplit

from pydantic import AnyHttpUrl, BaseModel, ConfigDict, Field, field_validator, model_validator

from jointlab.loopback import is_loopback

MQTT_PASSWORD, SERVICE_KEY = "JOINTLAB_MQTT_PASSWORD", "JOINTLAB_SERVICE_KEY"
"""Variables of the environment with the secrets."""
PORTS: dict[str, int] = {"mqtt": 1883, "mqtts": 8883}


class MqttSettings(BaseModel):
    """The broker of MQTT that is told what the rig does."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    broker: str = Field(description='"mqtt://host:port", or "mqtts://host:port", which encrypts')
    user: str | None = Field(default=None, min_length=1, description=f"logs in; its password is in {MQTT_PASSWORD}")
    prefix: str = Field(
        default="jointlab",
        max_length=100,
        pattern=r"^[A-Za-z0-9_.-]+(/[A-Za-z0-9_.-]+)*$",
        description="topics begin with it; the rig's name follows",
    )

    @field_validator("broker")
    @classmethod
    def _is_an_address(cls, broker: str) -> str:
        found = urlsplit(broker)
        if found.scheme not in PORTS or not found.hostname or found.path not in ("", "/"):
            raise ValueError(f"{broker!r} is no address of a broker; give mqtt://host:port or mqtts://host:port")
        if found.username is not None or found.password is not None:
            raise ValueError(f"leave the user out of the address; give it as user, and its password in {MQTT_PASSWORD}")
        found.port  # noqa: B018 - raises ValueError where it is no number
        return broker

    @model_validator(mode="after")
    def _keep_the_password(self) -> "MqttSettings":
        if self.user is not None and not self.is_encrypted and not is_loopback(self.host):
            raise ValueError("a password is not sent without encryption; use mqtts://, or leave user out")
        return self

    @property
    def is_encrypted(self) -> bool:
        """Whether TLS is used."""
        return self._scheme == "mqtts"

    @property
    def host(self) -> str:
        """Of the broker."""
        return urlsplit(self.broker).hostname or ""

    @property
    def port(self) -> int:
        """Of the broker; by default that of its protocol."""
        return urlsplit(self.broker).port or PORTS[self._scheme]

    @property
    def _scheme(self) -> Literal["mqtt", "mqtts"]:
        return "mqtts" if urlsplit(self.broker).scheme == "mqtts" else "mqtt"


class OpcuaSettings(BaseModel):
    """Where the server of OPC UA listens. Who reaches it reads what the rig does, without a key."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    address: str = Field(default="opc.tcp://127.0.0.1:4840", description='"opc.tcp://host:port"')

    @field_validator("address")
    @classmethod
    def _is_an_address(cls, address: str) -> str:
        found = urlsplit(address)
        if found.scheme != "opc.tcp" or not found.hostname or not found.port:
            raise ValueError(f"{address!r} is no address to listen at; give opc.tcp://host:port")
        return address

    @property
    def host(self) -> str:
        """Where to listen."""
        return urlsplit(self.address).hostname or ""

    @property
    def port(self) -> int:
        """Where to listen."""
        return urlsplit(self.address).port or 0


class PublishingSettings(BaseModel):
    """Who is told what the rig does, and the service that is asked."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    service: AnyHttpUrl = Field(
        default=AnyHttpUrl("http://127.0.0.1:8000"), description=f"that is asked; a key for it is in {SERVICE_KEY}"
    )
    mqtt: MqttSettings | None = None
    opcua: OpcuaSettings = OpcuaSettings()
