"""The webhook: a POST request with a JSON body, signed by HMAC-SHA256 where there is a secret (RFC 2104)."""

import hashlib
import hmac
import json
from contextlib import closing
from dataclasses import dataclass, field
from http.client import HTTPConnection, HTTPException, HTTPSConnection
from urllib.parse import urlsplit

from jointlab.alarms.channel import TITLES, NotDeliveredError, cut_after, printable
from store.service.alarms import NewAlarm
from store.version import release

SIGNATURE, ALARM = "Jointlab-Signature", "Jointlab-Alarm"
"""Headers with the signature of the body, and with the alarm's `uid`, by which receivers drop doubles."""


@dataclass(frozen=True)
class Webhook:
    """A receiver of POST requests. Redirections are not followed, and no proxy is used.

    Attributes:
        url: of the receiver.
        secret: signs the body; None: no signature.
        deadline: s that an attempt may take.
    """

    url: str = field(repr=False)
    secret: str | None = field(repr=False)
    deadline: float
    name: str = "webhook"

    def compose(self, alarm: NewAlarm) -> str:
        """The body: the alarm as JSON."""
        document = {
            "id": alarm.uid, "kind": alarm.kind, "title": TITLES[alarm.kind], "rig": alarm.rig, "run": alarm.run_id,
            "text": alarm.text, "happened_at": alarm.happened_at.isoformat(),
        }  # fmt: skip
        return json.dumps(document)

    def send(self, uid: str, body: str) -> str:
        """Send it; any status but 2xx is no delivery. Raises NotDeliveredError."""
        content, address = body.encode(), urlsplit(self.url)
        headers = {"Content-Type": "application/json", "User-Agent": f"jointlab/{release()}", ALARM: uid}
        if self.secret is not None:
            headers[SIGNATURE] = signature(self.secret, content)
        kind = HTTPSConnection if address.scheme == "https" else HTTPConnection
        connection = kind(address.hostname or "", address.port, timeout=self.deadline)
        path = (address.path or "/") + (f"?{address.query}" if address.query else "")
        try:
            with closing(connection), cut_after(self.deadline, lambda: connection.sock):
                connection.request("POST", path, content, headers)
                with connection.getresponse() as answer:
                    said = printable(f"{answer.status} {answer.reason}")
        except (OSError, HTTPException, ValueError) as error:
            raise NotDeliveredError(error) from error
        if answer.status // 100 != 2:
            raise NotDeliveredError(said)
        return said


def signature(secret: str, body: bytes) -> str:
    """The value of the header `SIGNATURE`."""
    return f"sha256={hmac.new(secret.encode(), body, hashlib.sha256).hexdigest()}"
