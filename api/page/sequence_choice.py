"""The sequence that an address names: that of an investigation, a diagnosis or a run, or one that has a name."""

from collections.abc import Mapping, Sequence

from api.page.address import number
from api.page.formatting import WHOLE_LIST
from api.page.starting import limits_of
from api.service.context import Services
from jointlab.diagnosis.investigation_text import asked_text
from jointlab.jobs.investigations import sequence_for_request
from jointlab.sequences import BUILT_IN, NAMES, sequence_named, text_of, to_yaml
from jointlab.sequences.of_run import sequence_for_diagnosis, sequence_of_run
from rig.sequences.sequence import Sequence as Document
from store.service.sequence_documents import list_with_names

ASKED = "investigation"
"""Field of the address with the number of the investigation whose experiment is measured."""
OF_OTHERS = ((ASKED, "For investigation"), ("next", "For diagnosis"), ("like", "Like run"))


def sources(services: Services, query: Mapping[str, str]) -> dict[str, tuple[str, str, Sequence[str]]]:
    """The source of the sequence, as a field of the address: an investigation, a diagnosis, a run, or a name."""
    for name, label in OF_OTHERS:
        if number(query, name) is not None:
            return {name: (label, query[name], (query[name],))}
    with services.catalogue.reading() as session:
        names = [name for name, _ in list_with_names(session, NAMES, limit=WHOLE_LIST)]
    return {"sequence": ("Sequence", query.get("sequence", "") or BUILT_IN, names)}


def chosen(services: Services, query: Mapping[str, str]) -> tuple[Document, str]:
    """The sequence, and the experiment that is asked for, in words.

    Raises NotFoundError, JointlabError, StoreError, RigError where there is none; see the functions that make it.
    """
    investigation, diagnosis, like = (number(query, name) for name, _ in OF_OTHERS)
    with services.catalogue.reading() as session:
        if investigation is not None:
            asked, sequence = sequence_for_request(session, investigation, limits_of(services))
            return sequence, asked_text(asked)
        if diagnosis is not None:
            experiment, sequence = sequence_for_diagnosis(session, diagnosis, limits_of(services))
            return sequence, experiment
        if like is not None:
            return sequence_of_run(session, like), ""
        return sequence_named(session, query.get("sequence") or BUILT_IN), ""


def chosen_text(services: Services, query: Mapping[str, str]) -> tuple[str, str]:
    """The same as YAML text; one that has a name may have become invalid, and is there to be corrected."""
    if all(number(query, name) is None for name, _ in OF_OTHERS):
        return services.catalogue.read(text_of, query.get("sequence") or BUILT_IN), ""
    sequence, experiment = chosen(services, query)
    return to_yaml(sequence.model_dump(mode="json", exclude_none=True)), experiment
