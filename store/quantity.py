"""Fields of documents that hold a quantity: the schema has the unit, for people and for programs."""

from typing import Any

from pydantic import Field, ValidationError, ValidatorFunctionWrapHandler, WrapValidator
from pydantic_core import InitErrorDetails, PydanticCustomError

_LIMITS = frozenset({"greater_than", "greater_than_equal", "less_than", "less_than_equal"})


def quantity(unit: str, description: str = "", **constraints: Any) -> Any:
    """A field that holds a quantity, for `Annotated`: its unit is in the schema, as `x-unit` and in words.

    Args:
        unit: such as "N/m"; "1" for a ratio.
        constraints: of the value, such as `gt=0`.
    """
    words = f"{description}, {unit}" if description else unit
    field = Field(description=words, json_schema_extra={"x-unit": unit}, **constraints)
    # not of a list: behind such a validator a strict one would no longer be a tuple as it comes from JSON
    if unit != "1" and constraints.keys() & {"gt", "ge", "lt", "le"}:
        field.metadata.append(_telling(unit))
    return field


def _telling(unit: str) -> WrapValidator:
    """A validator that adds `unit` to the errors about limits, for `store.validation.fault_of`."""

    def told(value: Any, handler: ValidatorFunctionWrapHandler) -> Any:
        try:
            return handler(value)
        except ValidationError as error:
            found = error.errors(include_url=False)
            if any(each["type"] not in _LIMITS for each in found):
                raise
            faults = [
                InitErrorDetails(
                    type=PydanticCustomError(each["type"], "{msg}", {**each["ctx"], "unit": unit, "msg": each["msg"]}),
                    loc=each["loc"],
                    input=each["input"],
                )
                for each in found
            ]
            raise ValidationError.from_exception_data(error.title, faults) from None

    return WrapValidator(told)
