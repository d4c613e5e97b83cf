"""The laboratory as its reports show it: name, address and logo."""

import base64
from pathlib import Path
from typing import Annotated

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

from jointlab.errors import JointlabError

LOGO_TYPES = {".png": "image/png", ".jpg": "image/jpeg", ".jpeg": "image/jpeg", ".svg": "image/svg+xml"}
"""Media type of a logo by the suffix of its file."""


def _is_picture(path: Path) -> Path:
    if path.suffix.lower() not in LOGO_TYPES:
        raise ValueError(f"{path.name} is none of {', '.join(LOGO_TYPES)}")
    return path


class LaboratorySettings(BaseModel):
    """Who measures, as reports show it."""

    model_config = ConfigDict(extra="forbid", frozen=True)

    name: str = Field(default="", max_length=200, description="shown at the head of reports")
    address: str = Field(default="", max_length=500, description="shown under the name; may have several lines")
    logo: Annotated[Path, AfterValidator(_is_picture)] | None = Field(
        default=None, description="PNG, JPEG or SVG file, which every report embeds"
    )

    def logo_data(self) -> str:
        """The logo as a data URL; empty without one.

        Raises:
            JointlabError: the file cannot be read.
        """
        if self.logo is None:
            return ""
        try:
            content = base64.b64encode(self.logo.read_bytes()).decode("ascii")
        except OSError as error:
            raise JointlabError(f"the logo {self.logo} cannot be read: {error.strerror or error}") from error
        return f"data:{LOGO_TYPES[self.logo.suffix.lower()]};base64,{content}"


NO_LABORATORY = LaboratorySettings()
