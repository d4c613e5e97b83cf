"""Configuration: one TOML file and the environment, which wins. Shown by `jointlab config`."""

import os
import sys
import tomllib
from datetime import date
from pathlib import Path
from typing import Annotated, Literal

from pydantic import (
    AnyHttpUrl,
    BaseModel,
    ConfigDict,
    Field,
    IPvAnyAddress,
    ValidationError,
    ValidationInfo,
    field_validator,
)
from pydantic_settings import BaseSettings, PydanticBaseSettingsSource, SettingsConfigDict, TomlConfigSettingsSource
from pydantic_settings import SettingsError as EnvironmentSettingsError

from daq.channels import ChannelKind
from jointlab.alarms.settings import AlarmSettings
from jointlab.errors import SettingsError
from jointlab.logs import LogSettings
from jointlab.publishing.settings import PublishingSettings
from jointlab.report.laboratory import NO_LABORATORY, LaboratorySettings
from jointlab.sensitivity import sensitivity_in_si
from rig.tester.missing_functions import Lack
from store.database.time_limits import DEFAULT_LIMITS, TimeLimits
from store.validation import TextLike, faults_text

CONFIG_VARIABLE = "JOINTLAB_CONFIG"
DEFAULT_CONFIG = "jointlab.toml"


RIG_NAME = r"^[A-Za-z0-9][A-Za-z0-9_ -]{0,49}$"
RigName = Annotated[
    str,
    TextLike(RIG_NAME, "write 1 to 50 letters, digits, spaces, underscores and hyphens; begin with a letter or digit"),
]
ChannelName = Annotated[
    str, TextLike(r"^[a-z][a-z0-9_]{0,49}$", "write small letters, digits and underscores; begin with a letter")
]


class BridgeSettings(BaseModel):
    """How a bridge of strain gauges is connected and fed."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    excitation: float = Field(gt=0, le=20, description="supply by the module, V")
    configuration: Literal["full", "half", "quarter"] = Field(default="full", description="what of it is in the sensor")
    resistance: float = Field(default=350.0, gt=0, le=1e5, description="of an arm, nominal, ohm")


class ChannelSettings(BaseModel):
    """One row of the channel table: what hangs on which input, and when it was calibrated."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)

    name: ChannelName = Field(description="name used in records, such as hammer")
    physical: str = Field(max_length=100, description="NI-DAQmx physical channel, such as cDAQ1Mod1/ai0")
    kind: Literal["force_iepe", "acceleration_iepe", "force_bridge", "force_charge", "acceleration_charge", "voltage"]
    unit: Literal["N", "m/s^2", "m"]
    sensitivity: float = Field(
        gt=0, le=1e9, description='with its unit, such as "100 mV/g"; a number alone is V (V/V, C) for each `unit`'
    )
    minimum: float = Field(ge=-1e9, le=1e9, description="lowest value expected, in `unit`")
    maximum: float = Field(ge=-1e9, le=1e9, description="highest value expected, in `unit`")
    excitation_current: float = Field(default=0.0, ge=0, le=0.02, description="IEPE supply, A")
    serial: str = Field(default="", max_length=100)
    calibrated_on: date | None = None
    certificate: str = Field(default="", max_length=100, description="number of its calibration certificate")
    uncertainty: float | None = Field(
        default=None, gt=0, lt=1, description="of the sensitivity, relative, expanded (k = 2)"
    )
    due_on: date | None = Field(default=None, description="day until which the calibration is valid")
    polarity: Literal[1, -1] = Field(
        default=1, description="-1 where the sensor gives a negative voltage for a positive quantity"
    )
    noise: float | None = Field(
        default=None, gt=0, le=1e9, description="rms noise at rest by the data sheets of sensor and input, in `unit`"
    )
    bridge: BridgeSettings | None = Field(default=None, description="of a force_bridge, such as { excitation = 5 }")

    @field_validator("sensitivity", mode="before")
    @classmethod
    def _read_its_unit(cls, given: object, known: ValidationInfo) -> object:
        if isinstance(given, str) and {"kind", "unit"} <= known.data.keys():
            return sensitivity_in_si(given, known.data["unit"], ChannelKind(known.data["kind"]).input_unit)
        return given


class CommissioningSettings(BaseModel):
    """The means to examine the rig, and the time for which an examination holds."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    valid_days: float = Field(default=30.0, gt=0, description="days after which a run warns of an old examination")
    calibrator_frequency: float = Field(default=159.15, gt=0, le=1e4, description="of the hand-held calibrator, Hz")
    calibrator_acceleration: float = Field(default=10.0, gt=0, le=1e3, description="of it, m/s^2 rms")
    calibrator_uncertainty: float = Field(default=0.03, gt=0, lt=1, description="of that, relative, expanded (k = 2)")


class ServiceSettings(BaseModel):
    """The network settings of the service."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    trusted_proxies: tuple[IPvAnyAddress, ...] = Field(
        default=(), description="addresses of proxies whose X-Forwarded-For and X-Forwarded-Proto are believed"
    )
    open_jobs: int = Field(default=20, ge=1, description="jobs of one key that may be queued or running")
    export_days: float = Field(default=30.0, gt=0, description="days for which files of exports are kept")
    session_hours: float = Field(default=12.0, gt=0, le=720, description="hours after which a log-in to the page ends")


class DriveSettings(BaseModel):
    """The drive process of the rig, which `jointlab drive` or the service starts."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    folder: Path | None = Field(
        default=None,
        description="its socket, lock, log and records that are not in the database yet, on a local disk; by default a "
        "folder of the rig's name in the user's state folder",
    )
    stop_address: str = Field(
        default="127.0.0.1", description="where STOP listens; who reaches it can stop the machine"
    )
    stop_port: int = Field(default=8001, ge=0, le=65535, description="its port; 0: any free one")
    stop_button: str | None = Field(
        default=None, description="serial port or pyserial URL of a button: a byte, or a lost line, means STOP"
    )
    when_alone: Literal["finish", "stop"] = Field(
        default="finish",
        description="what happens to a run when no program steers the rig any more: it goes on until it needs the "
        "operator, or it is ended, with an actuator that it drives at rest",
    )


class HallRig(BaseModel):
    """A rig that the service shows and stops, wherever its drive process is."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    rig: RigName = Field(description="its name, `rig` in its own configuration")
    stop_address: str = Field(description="where its drive process listens for STOP")
    stop_port: int = Field(default=8001, ge=1, le=65535, description="its port")
    page: AnyHttpUrl | None = Field(default=None, description="the page of its own service, where it is driven from")


class Settings(BaseSettings):
    """Everything that differs between one laboratory and another.

    Each field is also an environment variable: `JOINTLAB_` and its name in capitals.
    """

    model_config = SettingsConfigDict(env_prefix="JOINTLAB_", extra="forbid", frozen=True)

    database_url: str = Field(default="sqlite:///jointlab.db", description="SQLAlchemy URL, SQLite or PostgreSQL")
    database_limits: TimeLimits = Field(
        default=DEFAULT_LIMITS, description="s that a call of the database may take: connect, answer, lock, idle, pool"
    )
    waveform_folder: Path | None = Field(default=None, description="waveform files; beside the database by default")
    daq_address: str = Field(
        default="local", description='"local" NI driver, "grpc://host:port" of a device server, or "plug-in://..."'
    )
    tester_url: str | None = Field(
        default=None,
        description='"tcp://host:port", "rtu:///dev/ttyS0" or "plug-in+tcp://..."; "external": its own software drives '
        "it; left out: the rig has no tester",
    )
    external_patience: float = Field(
        default=300.0,
        gt=0,
        description="s without a new point of an external tester, after which the operator is asked",
    )
    tester_map: Path | None = Field(
        default=None, description="TOML file with the registers of a tester that has others than docs/register_map.md"
    )
    tester_without: tuple[Lack, ...] = Field(
        default=(), description='what the tester may lack of what its stops need, such as ["watchdog"]'
    )
    thermometer_url: str = Field(default="/dev/ttyUSB0", description="serial port or pyserial URL")
    simulated_operator: str | None = Field(
        default=None, description='"host:port" of who strikes and mounts on a simulated bench (jointlab simulate)'
    )
    channels: tuple[ChannelSettings, ...] = Field(default=(), max_length=256, description="the channel table")
    rig: RigName = Field(
        default="rig",
        description="name of the rig; each rig on one database needs one of its own",
    )

    service: ServiceSettings = Field(default=ServiceSettings(), description="how the service meets its network")
    drive: DriveSettings = Field(default=DriveSettings(), description="the drive process, table [drive]")
    commissioning: CommissioningSettings = Field(
        default=CommissioningSettings(), description="examinations of the rig, table [commissioning]"
    )
    alarms: AlarmSettings = Field(default=AlarmSettings(), description="whom to tell of what, table [alarms]")
    laboratory: LaboratorySettings = Field(
        default=NO_LABORATORY, description="who measures, as reports show it, table [laboratory]"
    )
    log: LogSettings = Field(default=LogSettings(), description="what every process tells, table [log]")
    hall: tuple[HallRig, ...] = Field(
        default=(), max_length=200, description="rigs that the service shows and stops, a table [[hall]] for each"
    )
    publishing: PublishingSettings = Field(
        default=PublishingSettings(), description="programs that are told what the rig does, table [publishing]"
    )
    workers: int = Field(default=1, ge=1, le=256, description="jobs of the service at a time, a process each")
    scheduler: str | None = Field(default=None, description='dask scheduler for jobs, such as "tcp://host:8786"')

    @field_validator("hall")
    @classmethod
    def _name_each_once(cls, hall: tuple[HallRig, ...]) -> tuple[HallRig, ...]:
        if len({given.rig for given in hall}) < len(hall):
            raise ValueError("two rigs of the hall have one name")
        return hall

    @classmethod
    def settings_customise_sources(
        cls,
        settings_cls: type[BaseSettings],
        init_settings: PydanticBaseSettingsSource,
        env_settings: PydanticBaseSettingsSource,
        dotenv_settings: PydanticBaseSettingsSource,
        file_secret_settings: PydanticBaseSettingsSource,
    ) -> tuple[PydanticBaseSettingsSource, ...]:
        """Arguments, then the environment, then the TOML file."""
        return init_settings, env_settings, TomlConfigSettingsSource(settings_cls, config_path())


def drive_folder(settings: Settings) -> Path:
    """The folder of the drive process of the rig."""
    return state_folder() / settings.rig if settings.drive.folder is None else settings.drive.folder.absolute()


def state_folder() -> Path:
    """Where programs of this user keep what outlives them, and is no result."""
    if sys.platform == "win32":
        return Path(os.environ["LOCALAPPDATA"]) / "jointlab"
    return Path(os.environ.get("XDG_STATE_HOME") or Path.home() / ".local" / "state") / "jointlab"


def config_path() -> Path:
    """The TOML file in use: named by JOINTLAB_CONFIG, or jointlab.toml in the working folder."""
    return Path(os.environ.get(CONFIG_VARIABLE, DEFAULT_CONFIG))


def load_settings() -> Settings:
    """Read the TOML file and the environment.

    Raises:
        SettingsError: the file is named but absent or a folder, is not TOML, or a value does not fit.
    """
    path = config_path()
    if CONFIG_VARIABLE in os.environ and path.is_dir():
        raise SettingsError(f"{CONFIG_VARIABLE} names {path}, which is a folder; name the file")
    if CONFIG_VARIABLE in os.environ and not path.is_file():
        raise SettingsError(f"{CONFIG_VARIABLE} names {path}, which does not exist; unset it or write the file")
    try:
        return Settings()
    except (tomllib.TOMLDecodeError, UnicodeDecodeError) as error:
        raise SettingsError(f"{path} is not valid TOML: {error}") from error
    except OSError as error:
        raise SettingsError(f"{path} cannot be read: {error.strerror or error}") from error
    except ValidationError as error:
        raise SettingsError(f"configuration ({path} and JOINTLAB_*): {describe(error)}") from error
    except EnvironmentSettingsError as error:
        raise SettingsError(f"environment JOINTLAB_*: {error}; write it as JSON") from error


def describe(error: ValidationError) -> str:
    """A validation error in one line: where, and what is wrong."""
    return faults_text(error.errors(), "value")
