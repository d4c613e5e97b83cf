"""What the documentation site needs beyond MkDocs: notebooks that are run, equations without a script, no network."""

import html
import re
import sys
from pathlib import Path
from typing import Any

from latex2mathml.converter import convert
from mkdocs.exceptions import PluginError
from mkdocs.structure.files import File

sys.path.insert(0, str(Path(__file__).parent))
from run_notebook import as_markdown

EQUATION = re.compile(r'<(span|div) class="arithmatex">\\([(\[])(.*?)\\[)\]]</\1>', re.DOTALL)
LOADED = re.compile(r'<(?:script|img|link|iframe)\b[^>]*?\b(?:src|href)="(https?:)?//[^"]*"[^>]*>')


def on_files(files: Any, config: Any) -> Any:
    """Add a page for each notebook, with its outputs."""
    for notebook in sorted(Path(config.docs_dir).glob("notebooks/*.ipynb")):
        files.append(File.generated(config, f"notebooks/{notebook.stem}.md", content=as_markdown(notebook)))
    return files


def on_page_content(content: str, **_: Any) -> str:
    """Turn equations from LaTeX into MathML, which browsers draw by themselves."""
    return EQUATION.sub(_mathml, content)


def on_post_build(config: Any) -> None:
    """Refuse a site that would load anything from another host."""
    for page in Path(config.site_dir).rglob("*.html"):
        for found in LOADED.finditer(page.read_text(encoding="utf-8")):
            raise PluginError(f"{page} loads {found.group()}")


def _mathml(found: re.Match[str]) -> str:
    return convert(html.unescape(found.group(3)), display="block" if found.group(2) == "[" else "inline")
