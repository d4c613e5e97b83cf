"""A drive process as a program starts it: `python -m jointlab.drive SETTINGS [alarms]`; SETTINGS is a JSON file."""

import sys
from pathlib import Path

from jointlab.drive.process import run
from jointlab.errors import EXPECTED
from jointlab.settings import Settings


def main() -> None:
    """Drive the rig of the settings file that the argument names; an expected error is one line."""
    settings = Settings.model_validate_json(Path(sys.argv[1]).read_bytes())
    try:
        run(settings, until_alone=True, alarms="alarms" in sys.argv[2:])
    except EXPECTED as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main()
