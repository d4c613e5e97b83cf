"""Code of the page that runs in the event loop neither reads nor writes the database itself."""

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

import api.page

FILES = sorted(Path(api.page.__file__).parent.rglob("*.py"))


def own_nodes(function: ast.AST) -> Iterator[ast.AST]:
    """The nodes of a function, without those of the functions in it, which threads may call."""
    for node in ast.iter_child_nodes(function):
        if not isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef | ast.Lambda):
            yield node
            yield from own_nodes(node)


def of_database(function: ast.AST) -> bool:
    attributes = (node for node in own_nodes(function) if isinstance(node, ast.Attribute))
    return any(node.attr in ("reading", "writing") and is_catalogue(node.value) for node in attributes)


def is_catalogue(node: ast.AST) -> bool:
    return (isinstance(node, ast.Attribute) and node.attr == "catalogue") or (
        isinstance(node, ast.Name) and node.id == "catalogue"
    )


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.stem)
def test_no_coroutine_asks_the_database_or_calls_what_does(path: Path) -> None:
    nodes = list(ast.walk(ast.parse(path.read_text(encoding="utf-8"))))
    functions = [node for node in nodes if isinstance(node, ast.FunctionDef)]
    asking = {"current_run"} | {function.name for function in functions if of_database(function)}
    for coroutine in (node for node in nodes if isinstance(node, ast.AsyncFunctionDef)):
        assert not of_database(coroutine), coroutine.name
        calls = (node.func for node in own_nodes(coroutine) if isinstance(node, ast.Call))
        assert not asking & {called.id for called in calls if isinstance(called, ast.Name)}, coroutine.name
