"""Common to all tables: names of constraints, column types, columns of provenance."""

from datetime import UTC, datetime
from operator import index
from typing import Any, ClassVar

from sqlalchemy import (
    JSON,
    BigInteger,
    Connection,
    DateTime,
    Dialect,
    Double,
    Integer,
    LargeBinary,
    MetaData,
    String,
    event,
)
from sqlalchemy.engine.default import DefaultExecutionContext
from sqlalchemy.orm import DeclarativeBase, Mapped, Mapper, declared_attr, mapped_column
from sqlalchemy.types import TypeDecorator

from store.database.checksums import WITH_ROW, checksum, hashed_values
from store.errors import StoreError
from store.version import software_version


class UtcDateTime(TypeDecorator[datetime]):
    """A time in UTC on both databases. SQLite has no time zones, so a time without a zone is refused."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_bind_param(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Convert to UTC; StoreError for a time without a zone."""
        if value is None:
            return None
        if value.tzinfo is None:
            raise StoreError(f"time {value} has no time zone; give times in UTC")
        utc = value.astimezone(UTC)
        return utc.replace(tzinfo=None) if dialect.name == "sqlite" else utc

    def process_result_value(
        self,
        value: datetime | None,
        dialect: Dialect,  # noqa: ARG002 - SQLAlchemy's signature
    ) -> datetime | None:
        """Give the time back as UTC."""
        if value is None:
            return None
        return value.replace(tzinfo=UTC) if value.tzinfo is None else value.astimezone(UTC)


class Number(TypeDecorator[float]):
    """A float, also of a numpy type, which SQLite would silently store as bytes."""

    impl = Double
    cache_ok = True

    def process_bind_param(self, value: float | None, dialect: Dialect) -> float | None:  # noqa: ARG002 - see above
        """Convert to a Python float."""
        return None if value is None else float(value)


class Whole(TypeDecorator[int]):
    """An integer, also of a numpy type; a float is refused."""

    impl = Integer
    cache_ok = True

    def process_bind_param(self, value: int | None, dialect: Dialect) -> int | None:  # noqa: ARG002 - see above
        """Convert to a Python int."""
        return None if value is None else index(value)


WIDE = BigInteger().with_variant(Integer(), "sqlite")
"""The number of a row where there may be more than 4 bytes can count; a number of SQLite always has 8."""


class Base(DeclarativeBase):
    """Base of all tables; constraints have names, so that migrations can find them on both databases."""

    metadata = MetaData(
        naming_convention={
            "ix": "ix_%(table_name)s_%(column_0_N_name)s",
            "uq": "uq_%(table_name)s_%(column_0_N_name)s",
            "fk": "fk_%(table_name)s_%(column_0_name)s",
            "pk": "pk_%(table_name)s",
        }
    )
    type_annotation_map = {  # noqa: RUF012 - SQLAlchemy declares it as an instance attribute
        datetime: UtcDateTime(),
        float: Number(),
        int: Whole(),
        str: String(),
        bytes: LargeBinary(),
        dict[str, Any]: JSON(none_as_null=True),
        list[str]: JSON(),
    }


class Recorded:
    """Columns of every row: its number, the time of writing and the version of the software."""

    id: Mapped[int] = mapped_column(Integer, primary_key=True, sort_order=-1)
    created_at: Mapped[datetime] = mapped_column(default=lambda: datetime.now(UTC), sort_order=1)
    software_version: Mapped[str] = mapped_column(default=software_version, sort_order=1)


class Checksummed:
    """The column of a row of measurements with the checksum over its other values, which every write renews."""

    __table__: ClassVar[Any]

    @declared_attr
    def checksum(cls) -> Mapped[str]:  # noqa: N805 - a method of the class
        """See `store.database.checksums`; empty where a row was not written by this program."""

        def of_insert(context: DefaultExecutionContext) -> str:
            values: dict[str, Any] = context.get_current_parameters()  # type: ignore[no-untyped-call]  # SQLAlchemy's
            return checksum(WITH_ROW, hashed_values(cls.__table__, values.get))

        return mapped_column(default=of_insert, server_default="", sort_order=2)


def _renew(_mapper: Mapper[Any], _connection: Connection, row: Any) -> None:
    row.checksum = checksum(WITH_ROW, hashed_values(row.__table__, lambda name: getattr(row, name)))


event.listen(Checksummed, "before_update", _renew, propagate=True)
