"""Fields of documents that hold a quantity: the schema has the unit, for people and for programs."""

from typing import Any

from pydantic import Field


def quantity(unit: str, description: str = "", **constraints: Any) -> Any:
    """A field that holds a quantity, for `Annotated`: its unit is in the schema, as `x-unit` and in words.

    Args:
        unit: such as "N/m"; "1" for a ratio.
        constraints: of the value, such as `gt=0`.
    """
    words = f"{description}, {unit}" if description else unit
    return Field(description=words, json_schema_extra={"x-unit": unit}, **constraints)
