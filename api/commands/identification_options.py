"""The options of an identification on the command line, made from their one declaration."""

import functools
import inspect
from collections.abc import Callable
from typing import Annotated, Any

import typer
from pydantic.fields import FieldInfo

from jointlab.identification.options import Options

METAVARS = {"free_beam": "RUN", "regularise": "SHARE", "force_window": "SECONDS", "exponential_window": "SECONDS"}


def takes_options(command: Callable[..., None]) -> Callable[..., None]:
    """Give a command an option for every field of `Options`, in place of its parameter called `options`."""

    @functools.wraps(command)
    def with_options(**given: Any) -> None:
        chosen = {name: given.pop(name) for name in Options.model_fields}
        options = Options(**{name: value for name, value in chosen.items() if value not in (None, [])})
        command(**given, options=options)

    signature = inspect.signature(command, eval_str=True)
    own = [parameter for name, parameter in signature.parameters.items() if name != "options"]
    added = [_parameter(name, field) for name, field in Options.model_fields.items()]
    with_options.__signature__ = signature.replace(parameters=[*own, *added])  # type: ignore[attr-defined] # typer's
    return with_options


def option(name: str) -> Any:
    """One field of `Options` as an option of typer, for `Annotated`."""
    return _option(name, Options.model_fields[name])


def _parameter(name: str, field: FieldInfo) -> inspect.Parameter:
    is_list = field.default == ()
    kind: Any = list[str] | None if is_list else field.annotation
    default = None if is_list else field.default
    annotation = Annotated[kind, _option(name, field)]
    return inspect.Parameter(name, inspect.Parameter.KEYWORD_ONLY, default=default, annotation=annotation)


def _option(name: str, field: FieldInfo) -> Any:
    limits = {key: getattr(limit, key) for limit in field.metadata for key in ("ge", "le") if hasattr(limit, key)}
    extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
    description = (field.description or "").removesuffix(f", {extra.get('x-unit')}")
    return typer.Option(
        help=f"{description[:1].upper()}{description[1:]}{'; may be repeated' if field.default == () else ''}.",
        metavar=METAVARS.get(name),
        min=limits.get("ge"),
        max=limits.get("le"),
    )
