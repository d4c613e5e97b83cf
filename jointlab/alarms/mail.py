"""E-mail: a plain-text message to a mail server (RFC 5321), encrypted by default."""

import ssl
from dataclasses import dataclass, field
from email import message_from_string
from email.message import EmailMessage
from email.policy import SMTP as SMTP_POLICY
from smtplib import SMTP, SMTP_SSL, SMTPException
from socket import gethostname

from jointlab.alarms.channel import TITLES, NotDeliveredError, cut_after, printable
from jointlab.alarms.settings import MailSettings
from store.service.alarms import NewAlarm


@dataclass(frozen=True)
class Mail:
    """A mail server.

    Attributes:
        settings: of the server, with sender and recipients.
        password: of the user; None where nobody logs in.
        deadline: s that an attempt may take.
    """

    settings: MailSettings
    password: str | None = field(repr=False)
    deadline: float
    name: str = "mail"

    def compose(self, alarm: NewAlarm) -> str:
        """The whole message with its head; only ASCII characters."""
        message = EmailMessage(policy=SMTP_POLICY)
        message["From"], message["To"] = self.settings.sender, ", ".join(self.settings.to)
        message["Subject"] = f"Jointlab, {alarm.rig}: {TITLES[alarm.kind]}"
        message["Date"] = alarm.happened_at
        message["Message-ID"] = f"<{alarm.uid}@jointlab>"  # the same in each attempt, so that doubles are seen
        message["Auto-Submitted"] = "auto-generated"
        text = (
            f"{alarm.text}\n\nat {alarm.happened_at:%Y-%m-%d %H:%M:%S} UTC, on {alarm.rig}\n\n"
            "Acknowledge it on the page of the service, or by jointlab alarms acknowledge.\n"
        )
        message.set_content(text, cte="quoted-printable")
        return message.as_string()

    def send(self, uid: str, body: str) -> str:  # noqa: ARG002 - the head has it
        """Send it; it counts as delivered where the server takes it for one recipient. Raises NotDeliveredError."""
        given = self.settings
        tls = None if given.security == "none" else ssl.create_default_context()
        server = (
            SMTP_SSL(timeout=self.deadline, context=tls, local_hostname=gethostname())
            if given.security == "tls"
            else SMTP(timeout=self.deadline, local_hostname=gethostname())
        )
        try:
            with cut_after(self.deadline, lambda: getattr(server, "sock", None)):
                try:
                    refused = self._send(server, tls, body)
                finally:
                    server.close()
        except (OSError, SMTPException, ValueError) as error:
            raise NotDeliveredError(error) from error
        return printable(f"taken, but not for {', '.join(refused)}" if refused else "taken")

    def _send(self, server: SMTP, tls: ssl.SSLContext | None, body: str) -> list[str]:
        """Send the message `body` to `server`; returns the recipients that the server refused."""
        given = self.settings
        server._host = given.host  # type: ignore[attr-defined]  # private: `starttls` checks the certificate for it
        server.connect(given.host, given.port)
        if given.security == "starttls":
            server.starttls(context=tls)
        if given.user is not None and self.password is not None:
            server.login(given.user, self.password)
        message = message_from_string(body, policy=SMTP_POLICY)
        refused = server.sendmail(given.sender, given.to, message.as_bytes())
        return [*refused]
