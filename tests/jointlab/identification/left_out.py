"""A run whose joints were identified, and then left out as if its accelerances had no mode."""

from dataclasses import replace
from pathlib import Path

from analysis.inverse.frequency_law import FrequencyLaw
from jointlab.identification.levels import Levels
from jointlab.identification.options import Options
from jointlab.identification.pipeline import Identification
from jointlab.identification.run import identify_and_save
from jointlab.identification.save import save_identification
from store.catalogue import Catalogue
from store.exchange.bundle_exchange import import_bundle
from tests.jointlab.identification.layouts import LAYOUTS, write_bundle

REASON = "no mode stands out of the noise"


def without_joints(found: Identification) -> Identification:
    """The same identification, as it is where the accelerances have no mode."""
    return replace(found, inverse=None, inverse_left_out=REASON, levels=Levels(), comparison=())


def identified_then_left_out(catalogue: Catalogue, folder: Path) -> tuple[int, Identification]:
    """The run, and what was identified of it first; `folder` is for its bundle."""
    number = import_bundle(catalogue, write_bundle(LAYOUTS["nine nodes"], folder))
    found = identify_and_save(catalogue, number, Options(joint_law=FrequencyLaw.CONSTANT))
    with catalogue.writing() as session:
        save_identification(session, number, without_joints(found))
    return number, found
