"""The files of deploy/ name what is there: commands, options, variables, files, volumes, other services."""

import configparser
import importlib
import ipaddress
import os
import re
import shlex
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Iterator, Mapping
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest
import yaml

from jointlab.alarms.settings import MAIL_PASSWORD, WEBHOOK_SECRET
from jointlab.drive.halter import Halter
from jointlab.drive.stop_listener import StopListener
from jointlab.publishing.settings import MQTT_PASSWORD, SERVICE_KEY
from jointlab.settings import CONFIG_VARIABLE, Settings, load_settings
from jointlab.systemd import INTERVAL
from store.database.connection import address_of
from tests.command_lines import is_known

ROOT = Path(__file__).resolve().parents[2]
DEPLOY = ROOT / "deploy"
UNITS = sorted((DEPLOY / "systemd").glob("jointlab*.service"))
TIMERS = sorted((DEPLOY / "systemd").glob("jointlab*.timer"))
COMPOSE: dict[str, Any] = yaml.safe_load((DEPLOY / "compose.yaml").read_text("utf-8"))
SERVICES: dict[str, dict[str, Any]] = COMPOSE["services"]
OURS = [name for name, service in SERVICES.items() if service["image"].startswith("jointlab:")]
SECRETS = {CONFIG_VARIABLE, MAIL_PASSWORD, WEBHOOK_SECRET, SERVICE_KEY, MQTT_PASSWORD}
PUBLISHING = ("mqtt", "opcua")  # they know the service alone
EXAMPLES = {
    "/etc/jointlab/environment": DEPLOY / "systemd" / "environment.example",
    "/etc/jointlab/publishing": DEPLOY / "systemd" / "publishing.example",
}
CONTAINERFILE = (DEPLOY / "Containerfile").read_text("utf-8")
Environment = Mapping[str, str]
DOCUMENTATION = (ROOT / "docs" / "deployment.md").read_text("utf-8")
BLOCKS = [
    block.replace("\\\n", " ") for block in re.findall(r"^```\w*\n(.*?)^```", DOCUMENTATION, re.MULTILINE | re.DOTALL)
]
COMMANDS = [line.strip() for block in BLOCKS for line in block.splitlines()]
"""Lines of the blocks of the documentation, those that are continued as one."""


def unit(path: Path) -> configparser.RawConfigParser:
    """A unit; values of keys that come several times are lines."""

    class Several(dict[str, Any]):
        def __setitem__(self, key: str, value: Any) -> None:
            if key in self and isinstance(value, list):
                self[key].extend(value)
            else:
                super().__setitem__(key, value)

    parsed = configparser.RawConfigParser(dict_type=Several, strict=False, delimiters=("=",), comment_prefixes=("#",))
    parsed.optionxform = str  # type: ignore[method-assign,assignment]  # as the documentation says
    parsed.read(path, "utf-8")
    return parsed


def variables(lines: str) -> dict[str, str]:
    """Those that lines such as ``NAME=value`` or ``'NAME=a value'`` set."""
    words = [word for line in lines.splitlines() if not line.startswith("#") for word in shlex.split(line)]
    return dict(word.split("=", 1) for word in words)


def section_of(path: Path) -> configparser.SectionProxy:
    return unit(path)["Service"]


def environment_of_unit(path: Path) -> dict[str, str]:
    section = section_of(path)
    given = variables(section.get("Environment", ""))
    if "EnvironmentFile" in section:
        example = EXAMPLES[section["EnvironmentFile"].removeprefix("-")]  # -: it may be absent
        given |= variables(example.read_text("utf-8").replace("# J", "J"))
    return given


def filled(text: str) -> str:
    """With the variables of example.env, and a value for each that it leaves open."""
    example = variables((DEPLOY / "example.env").read_text("utf-8"))

    def value(found: re.Match[str]) -> str:
        return example[found[1]] or "something"

    return re.sub(r"\$\{(\w+)(?::[?-][^}]*)?\}", value, text)


def environment_of_service(name: str) -> dict[str, str]:
    return {key: filled(str(value)) for key, value in SERVICES[name].get("environment", {}).items()}


def settings_with(monkeypatch: pytest.MonkeyPatch, environment: Environment) -> Settings:
    """What the program reads from an environment and from deploy/jointlab.toml."""
    for name in [name for name in os.environ if name.startswith("JOINTLAB_")]:
        monkeypatch.delenv(name)
    assert {name for name in environment if name.startswith("JOINTLAB_")} <= SECRETS | {
        f"JOINTLAB_{field}".upper() for field in Settings.model_fields
    }
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert environment[CONFIG_VARIABLE] == "/etc/jointlab/jointlab.toml"
    monkeypatch.setenv(CONFIG_VARIABLE, str(DEPLOY / "jointlab.toml"))
    return load_settings()


@pytest.mark.parametrize("path", UNITS, ids=lambda path: path.name)
def test_a_unit_calls_the_program_as_it_is(path: Path) -> None:
    program, *words = shlex.split(section_of(path)["ExecStart"])
    if program.endswith("/jointlab"):
        assert is_known(shlex.join(["jointlab", *words]))
    elif program.endswith("/dask"):
        is_known_to_dask(words)
    else:
        assert os.access(ROOT / program.replace("/opt/jointlab-deploy", "deploy").lstrip("/"), os.X_OK)


def is_known_to_dask(words: list[str]) -> None:
    command = pytest.importorskip("distributed.cli.dask_scheduler").main
    options = {option for parameter in command.params for option in (*parameter.opts, *parameter.secondary_opts)}
    assert words[0] == "scheduler"
    assert {word for word in words if word.startswith("--")} <= options


def test_variables_of_dask_in_the_documentation_are_settings_of_dask() -> None:
    pytest.importorskip("distributed")
    config = importlib.import_module("dask.config")
    named = set(re.findall(r"DASK_(DISTRIBUTED__\w+)=", DOCUMENTATION))
    assert len(named) == 8
    for name in named:
        config.get(name.lower().replace("__", ".").replace("_", "-"))  # raises KeyError where there is none


@pytest.mark.parametrize(
    "path", [path for path in UNITS if "Environment" in section_of(path)], ids=lambda path: path.name
)
def test_variables_of_a_unit_are_settings(path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    settings = settings_with(monkeypatch, environment_of_unit(path))
    if path.name == "jointlab.service":
        assert [str(each) for each in settings.service.trusted_proxies] == ["127.0.0.1", "::1"]
    publishes = path.stem.removeprefix("jointlab-") in PUBLISHING
    assert (section_of(path)["EnvironmentFile"] == "/etc/jointlab/publishing") is publishes
    if path.name != "jointlab-drive.service" and not publishes:
        assert address_of(settings.database_url).get_backend_name() == "postgresql"


@pytest.mark.parametrize("path", UNITS, ids=lambda path: path.name)
def test_what_goes_on_is_restarted_and_watched_with_room_for_a_slow_sign(path: Path) -> None:
    section = section_of(path)
    if section.get("Type") == "oneshot":
        assert path.with_suffix(".timer") in TIMERS
        return
    assert section["Restart"] == "always"
    watched = section.get("Type") == "notify"
    assert watched == (path.name in ("jointlab.service", "jointlab-drive.service"))
    if watched:
        assert float(section["WatchdogSec"]) >= 10 * INTERVAL


def test_every_timer_has_its_unit() -> None:
    assert {path.with_suffix(".service") for path in TIMERS} <= set(UNITS)


def test_systemd_finds_no_fault(tmp_path: Path) -> None:
    if shutil.which("systemd-analyze") is None:
        pytest.skip("systemd-analyze is not installed")
    for path in (*UNITS, *TIMERS):
        text = re.sub(r"^ExecStart=\S+", "ExecStart=/bin/true", path.read_text("utf-8"), flags=re.MULTILINE)
        (tmp_path / path.name.replace("@.", "@1.")).write_text(text, encoding="utf-8")
    done = subprocess.run(
        ["systemd-analyze", "verify", "--man=no", *map(str, sorted(tmp_path.iterdir()))],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    about_ours = [line for line in done.stderr.splitlines() if str(tmp_path) in line or line.startswith("jointlab")]
    assert not about_ours, done.stderr


@pytest.mark.parametrize("name", OURS)
def test_a_service_calls_the_program_as_it_is(name: str) -> None:
    service = SERVICES[name]
    command = service["command"]
    entry = service.get("entrypoint", ["jointlab"])
    if entry == ["dask"]:
        is_known_to_dask(command)
    elif entry == ["jointlab"]:
        assert is_known(shlex.join(["jointlab", *command]))
    else:
        assert entry == ["jointlab-backup"]
        assert "deploy/backup.sh /usr/local/bin/jointlab-backup" in CONTAINERFILE
    asked = service.get("healthcheck", {}).get("test", ["CMD", "jointlab", "--version"])
    assert asked[0] == "CMD"
    assert asked[1] != "jointlab" or is_known(shlex.join(asked[1:]))


@pytest.mark.parametrize("name", [name for name in OURS if SERVICES[name]["environment"]])
def test_variables_of_a_service_are_settings(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    settings = settings_with(monkeypatch, environment_of_service(name))
    if name == "drive":
        assert settings.drive.stop_address == "0.0.0.0"
        assert f"{settings.drive.stop_port}:{settings.drive.stop_port}" in SERVICES[name]["ports"]
        return
    if name in PUBLISHING:
        assert set(SERVICES[name]["environment"]) == {CONFIG_VARIABLE, SERVICE_KEY, MQTT_PASSWORD}
        return
    database = address_of(settings.database_url)
    assert (database.host, database.username, database.database) == ("database", "jointlab", "jointlab")
    assert database.username == SERVICES["database"]["environment"]["POSTGRES_USER"]
    assert settings.scheduler == "tcp://scheduler:8786"
    if name == "service":
        (proxy,) = settings.service.trusted_proxies
        assert str(proxy) == SERVICES["proxy"]["networks"]["inside"]["ipv4_address"]


@pytest.mark.parametrize("name", SERVICES)
def test_what_a_service_refers_to_is_there(name: str) -> None:
    service = SERVICES[name]
    assert set(service.get("depends_on", {})) <= set(SERVICES)
    assert set(service["networks"]) <= set(COMPOSE["networks"])
    for mount in service["volumes"]:
        source = filled(mount).split(":")[0]
        known = source in COMPOSE["volumes"] or (DEPLOY / source).is_file() or source.startswith("/")
        assert known, mount
    for other, how in service.get("depends_on", {}).items():
        if how["condition"] == "service_healthy":
            assert "healthcheck" in SERVICES[other] or (other == "service" and "HEALTHCHECK" in CONTAINERFILE)


@pytest.mark.parametrize("name", [*OURS, "proxy"])
def test_a_service_that_the_network_reaches_can_change_nothing_but_its_data(name: str) -> None:
    service = SERVICES[name]
    assert service["read_only"] is True
    assert service["cap_drop"] == ["ALL"]
    assert "no-new-privileges:true" in service["security_opt"]


def test_only_proxy_and_stop_are_reached_from_outside() -> None:
    ports = {name: port for name, service in SERVICES.items() for port in service.get("ports", ())}
    assert {name for name, port in ports.items() if not port.startswith("127.0.0.1:")} == {"proxy", "drive"}
    assert {name for name, port in ports.items() if port.startswith("127.0.0.1:")} == {"opcua"}


def test_no_other_container_gets_the_address_of_the_proxy_that_the_service_trusts() -> None:
    address = ipaddress.ip_address(SERVICES["proxy"]["networks"]["inside"]["ipv4_address"])
    (config,) = COMPOSE["networks"]["inside"]["ipam"]["config"]
    network, others = (ipaddress.ip_network(config[each]) for each in ("subnet", "ip_range"))
    assert isinstance(network, ipaddress.IPv4Network)
    assert isinstance(others, ipaddress.IPv4Network)
    assert address in network
    assert address not in others
    assert others.subnet_of(network)
    assert others.num_addresses > 2 * len(SERVICES)


def test_both_that_tell_alarms_have_the_secrets_for_it() -> None:
    for name in ("service", "drive"):
        assert {MAIL_PASSWORD, WEBHOOK_SECRET} <= set(SERVICES[name]["environment"]), name
    for name in ("jointlab.service", "jointlab-drive.service"):
        read = section_of(DEPLOY / "systemd" / name)["EnvironmentFile"].removeprefix("-")
        assert all(each in EXAMPLES[read].read_text("utf-8") for each in (MAIL_PASSWORD, WEBHOOK_SECRET))


def test_the_health_of_the_drive_process_is_asked_of_its_listener_and_fails_where_none_answers() -> None:
    kind, program, *words = SERVICES["drive"]["healthcheck"]["test"]
    assert (kind, program) == ("CMD", "python")
    port = Settings().drive.stop_port
    with closing(Halter(lambda who, why, by_person: None, lambda: None)) as halter:
        with closing(StopListener("127.0.0.1", 0, halter, lambda: {"phase": "idle"})) as listener:
            asked = [sys.executable, *(word.replace(f":{port}/", f":{listener.port}/") for word in words)]
            assert asked[1:] != words
            assert subprocess.run(asked, check=False).returncode == 0
        assert subprocess.run(asked, capture_output=True, check=False).returncode != 0


def test_a_command_of_a_person_finds_what_the_units_find() -> None:
    (line,) = (each for each in COMMANDS if "systemd-run" in each)
    words = shlex.split(line)
    section = section_of(DEPLOY / "systemd" / "jointlab.service")
    options = dict(
        word.removeprefix("--").split("=", 1) for word in words if re.match("--(uid|property|working-)", word)
    )
    assert options["uid"] == section["User"]
    assert options["property"] == f"EnvironmentFile={section['EnvironmentFile']}"
    assert options["working-directory"] == section["WorkingDirectory"]
    given = dict(word.removeprefix("--setenv=").split("=", 1) for word in words if word.startswith("--setenv="))
    expected = variables(section["Environment"])
    del expected["JOINTLAB_SERVICE"]  # which proxies the service trusts
    assert given == expected


def test_what_is_installed_names_its_commit_to_every_user() -> None:
    assert not [line for line in COMMANDS if "git clone" in line]
    made = [line for line in COMMANDS if "/opt/jointlab-0" in line and "git" in line]
    assert len(made) == 2
    for line in made:
        assert re.fullmatch(r"mkdir (\S+) && git archive HEAD \| tar -x -C \1 && make -C \1 install", line)


def test_an_upgrade_stops_and_starts_all_that_goes_on() -> None:
    going_on = {path.stem for path in UNITS if section_of(path).get("Type") != "oneshot"}
    (stopped,) = (line for line in COMMANDS if line.startswith("systemctl stop jointlab "))
    assert {re.sub(r"@.*", "@", each) for each in shlex.split(stopped)[2:]} == going_on
    (upgrade,) = (block for block in BLOCKS if stopped in block)
    after = upgrade[upgrade.index(stopped) :].splitlines()
    started = [shlex.split(line, comments=True)[2:] for line in after if line.startswith("systemctl start")]
    assert {re.sub(r"@.*", "@", each) for line in started for each in line} == going_on


def test_a_restore_is_tried_by_users_that_may_and_with_paths_that_they_find() -> None:
    (made,) = (line for line in COMMANDS if "createdb" in line and line.endswith(" trial"))
    assert made.startswith("sudo -u postgres createdb -O jointlab ")
    (restored,) = (line for line in COMMANDS if "store restore" in line)
    program = section_of(DEPLOY / "systemd" / "jointlab.service")["ExecStart"].split()[0]
    assert restored.startswith("sudo -u jointlab env ")
    assert f" {program} store restore " in restored


def test_the_proxy_is_restarted_for_its_variables_as_it_cannot_be_reloaded() -> None:
    assert "admin off" in (DEPLOY / "Caddyfile").read_text("utf-8")
    assert "systemctl restart caddy" in DOCUMENTATION


def steps() -> Iterator[tuple[str, list[str]]]:
    """Instructions of the Containerfile with their words."""
    lines = "\n".join(line for line in CONTAINERFILE.splitlines() if not line.startswith("#")).replace("\\\n", " ")
    for line in filter(None, map(str.strip, lines.splitlines())):
        instruction, rest = line.split(maxsplit=1)
        yield instruction, rest.split()


def test_the_image_is_made_of_files_that_are_there_and_runs_as_an_ordinary_user() -> None:
    stages = [words[-1] for instruction, words in steps() if instruction == "FROM" and "AS" in words]
    assert {instruction for instruction, _ in steps()} <= {
        "FROM", "WORKDIR", "RUN", "COPY", "ENV", "USER", "VOLUME", "EXPOSE", "HEALTHCHECK", "ENTRYPOINT", "CMD"
    }  # fmt: skip
    for words in (words for instruction, words in steps() if instruction == "COPY"):
        if words[0].startswith("--from="):
            assert words[0].removeprefix("--from=") in stages
            continue
        assert all((ROOT / source).exists() for source in words[:-1])
    users = [words[0] for instruction, words in steps() if instruction == "USER"]
    assert users == ["jointlab"]
    assert f"useradd --system --uid 10001 --home-dir /var/lib/jointlab {users[0]}" in CONTAINERFILE
    assert f"jointlab:{tomllib.loads((ROOT / 'pyproject.toml').read_text())['project']['version']}" in CONTAINERFILE


def engine() -> str | None:
    """A container engine that answers here."""
    for name in ("docker", "podman"):
        if shutil.which(name) and subprocess.run([name, "info"], capture_output=True, check=False).returncode == 0:
            return name
    return None


def test_the_image_is_built_and_tells_its_version() -> None:
    program = engine()
    if program is None:
        pytest.skip("no container engine answers here")
    archive = subprocess.run(["git", "archive", "HEAD"], cwd=ROOT, capture_output=True, check=True).stdout
    build = [program, "build", "-q", "-f", "deploy/Containerfile", "-t", "jointlab:test", "-"]
    subprocess.run(build, input=archive, check=True)
    run = [program, "run", "--rm", "--read-only", "jointlab:test", "--version"]
    said = subprocess.run(run, capture_output=True, text=True, check=True).stdout
    assert re.match(r"jointlab \d+\.\d+\.\d+\+g[0-9a-f]{7}", said)
