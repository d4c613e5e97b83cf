"""The tables of the catalogue: `measurements` (written once), `results` (recomputed beside the old), `service`.

The class of a table ends in `Row`. What functions of the store take and give are frozen dataclasses without that
ending; where `analysis` has the same word, that of the store begins with `Stored`. Functions on tables are in the
packages of the same names. Exceptions: diagnoses (`results`), spools (`measurements`), commissioning records
(`service`).
"""

from store.models import measurements, results, service

__all__ = ["measurements", "results", "service"]
