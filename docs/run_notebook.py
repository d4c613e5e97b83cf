"""Run a notebook's cells in one namespace, without a kernel, and give what they show as Markdown."""

import ast
import base64
import io
import json
from contextlib import redirect_stdout
from pathlib import Path
from typing import Any

import matplotlib

matplotlib.use("Agg")
from matplotlib import pyplot


def as_markdown(notebook: Path) -> str:
    """A notebook with the outputs of its cells.

    Args:
        notebook: an .ipynb file.

    Raises:
        Exception: whatever a cell raises.
    """
    namespace: dict[str, Any] = {"__name__": "__notebook__"}
    parts = []
    for cell in json.loads(notebook.read_text(encoding="utf-8"))["cells"]:
        source = "".join(cell["source"])
        if cell["cell_type"] == "markdown":
            parts.append(source)
        else:
            parts += [f"```python\n{source}\n```", *_outputs(source, namespace)]
    return "\n\n".join(parts) + "\n"


def _outputs(source: str, namespace: dict[str, Any]) -> list[str]:
    """What a cell shows: printed text, the value of a last expression, and figures."""
    body, value = ast.parse(source), None
    last = body.body.pop() if body.body and isinstance(body.body[-1], ast.Expr) else None
    with redirect_stdout(io.StringIO()) as printed:
        exec(compile(body, "<cell>", "exec"), namespace)
        if last is not None:
            value = eval(compile(ast.Expression(last.value), "<cell>", "eval"), namespace)
    text = printed.getvalue().rstrip()
    shown = [f"```text\n{text}\n```"] if text else []
    if hasattr(value, "_repr_html_"):
        shown.append(f'<div class="output" style="overflow-x: auto">{value._repr_html_()}</div>')
    elif value is not None and not source.rstrip().endswith(";"):
        shown.append(f"```text\n{value!r}\n```")
    return shown + [_picture(number) for number in pyplot.get_fignums()]


def _picture(number: int) -> str:
    figure, file = pyplot.figure(number), io.BytesIO()
    figure.savefig(file, format="png", dpi=100, bbox_inches="tight")
    pyplot.close(figure)
    return f"![Figure](data:image/png;base64,{base64.b64encode(file.getvalue()).decode('ascii')})"
