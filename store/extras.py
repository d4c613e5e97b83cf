"""Packages that a base installation leaves out, and the extra that brings each."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager

from store.errors import StoreError

EXTRAS: Mapping[str, str] = {
    "asyncua": "opcua",
    "dask": "cluster",
    "distributed": "cluster",
    "fastapi": "page",
    "fastapi_offline": "page",
    "h5py": "files",
    "jinja2": "report",
    "matplotlib": "report",
    "nicegui": "page",
    "opentelemetry": "traces",
    "paho": "mqtt",
    "prometheus_client": "page",
    "psycopg": "postgres",
    "pyarrow": "parquet",
    "starlette": "page",
    "tomlkit": "page",
    "uvicorn": "page",
}
"""The extra of each package that is imported, by the name it is imported by."""


class MissingExtraError(StoreError):
    """A function needs an extra that is not installed."""


@contextmanager
def explained_imports() -> Iterator[None]:
    """A context for imports of packages that an extra brings.

    Raises MissingExtraError, which says what to install, if one is missing.
    """
    try:
        yield
    except ModuleNotFoundError as error:
        package = (error.name or "").partition(".")[0]
        if package not in EXTRAS:
            raise
        raise MissingExtraError(
            f"{package} is not installed here; install the extra that has it: pip install 'jointlab[{EXTRAS[package]}]'"
        ) from error
