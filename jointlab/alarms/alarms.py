"""The alarms of one service, put together: the watch, the delivery by each channel, and the relay."""

from collections.abc import Iterable
from pathlib import Path

from jointlab.alarms.channel import AlarmChannel
from jointlab.alarms.deliverer import Deliverer
from jointlab.alarms.mail import Mail
from jointlab.alarms.relay import Relay
from jointlab.alarms.settings import MAIL_PASSWORD, WEBHOOK_SECRET, AlarmSettings, secret_of
from jointlab.alarms.unstored import UnstoredAlarms
from jointlab.alarms.watch import AlarmWatch
from jointlab.alarms.webhook import Webhook
from jointlab.drive.process import SPOOLS
from jointlab.errors import SettingsError
from jointlab.runs.carry_out import spool_folder
from jointlab.settings import Settings, drive_folder
from jointlab.supervision.manager import RunManager
from store.catalogue import Catalogue
from store.service.alarms import NewAlarm

KEPT = "alarms.json"
"""File in the folder of the drive process with the alarms that the database does not have yet."""


def channels_of(settings: AlarmSettings) -> tuple[AlarmChannel, ...]:
    """The channels that are configured. Raises SettingsError where a secret is missing in the environment."""
    found = list[AlarmChannel]()
    if settings.webhook is not None:
        found.append(Webhook(settings.webhook.url.get_secret_value(), secret_of(WEBHOOK_SECRET), settings.deadline))
    if settings.mail is not None:
        password = secret_of(MAIL_PASSWORD)
        if settings.mail.user is not None and password is None:
            raise SettingsError(f"[alarms.mail] has a user, so {MAIL_PASSWORD} has to be set in the environment")
        found.append(Mail(settings.mail, password, settings.deadline))
    return tuple(found)


class Alarms:
    """Raises and tells the alarms of one rig until it is closed.

    Args:
        settings: with the rig, and whom to tell.
        runs: steers the rig; None where this service drives none.
        channels: by which people are told.
    """

    def __init__(
        self, catalogue: Catalogue, settings: Settings, runs: RunManager | None, channels: Iterable[AlarmChannel]
    ) -> None:
        given, rig, folder = settings.alarms, settings.rig, drive_folder(settings)
        unstored = UnstoredAlarms(folder / KEPT)
        self.rig = rig
        self._watch = AlarmWatch(catalogue, rig, runs, given, unstored, _spools(catalogue, folder))
        self._deliverers = [Deliverer(catalogue, rig, each, given.deadline, unstored) for each in channels]
        self._relay = None if given.relay is None else Relay(given.relay, lambda: bool(self._watch.standing))

    @property
    def standing(self) -> tuple[NewAlarm, ...]:
        """The alarms of the rig that nobody has acknowledged, newest first; known without a database."""
        return self._watch.standing

    def look(self) -> None:
        """Look at once, because an alarm was raised or acknowledged."""
        self._watch.look()

    def close(self) -> None:
        """End all threads; what is not delivered is stored, and the next service delivers it."""
        self._watch.close()
        for each in self._deliverers:
            each.close()
        if self._relay is not None:
            self._relay.close()


def _spools(catalogue: Catalogue, folder: Path) -> tuple[Path, Path]:
    return folder / SPOOLS, spool_folder(catalogue)
