"""The laboratory at the head of reports."""

from pathlib import Path

import pytest

from jointlab.errors import JointlabError, SettingsError
from jointlab.report.laboratory import LaboratorySettings
from jointlab.settings import load_settings
from tests.api.conftest import Command


def test_a_logo_of_another_kind_is_refused_with_the_kinds_there_are(jointlab: Command, tmp_path: Path) -> None:
    (tmp_path / "jointlab.toml").write_text('[laboratory]\nlogo = "logo.doc"\n', encoding="utf-8")
    with pytest.raises(SettingsError, match=r"laboratory\.logo.*logo\.doc is none of \.png"):
        load_settings()


def test_a_logo_that_is_not_there_is_named() -> None:
    with pytest.raises(JointlabError, match=r"the logo no/logo\.png cannot be read: No such file"):
        LaboratorySettings(logo=Path("no/logo.png")).logo_data()


def test_without_a_logo_there_is_none() -> None:
    assert LaboratorySettings().logo_data() == ""
