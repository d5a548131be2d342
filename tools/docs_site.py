"""What `mkdocs build` needs beyond docs/: pages that lie elsewhere, linked files, and the API.

The pages in docs/ are written for whoever reads them in the repository, with links from file to
file. On the site the same links lead to pages, or to copies of the files; links to folders become
text.
"""

import os
import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from mkdocs.structure.files import File, Files

ROOT = Path(__file__).resolve().parents[1]
PAGES = {  # that lie outside docs/, and what they are on the site
    "README.md": "readme.md",
    "GLOSSARY.md": "glossary.md",
    "CONTRIBUTING.md": "contributing.md",
    "CHANGELOG.md": "changelog.md",
    "sumo_nets/grid5x5/instances.md": "instances-table.md",
    "sumo_nets/grid5x5/claims/claims.md": "claims.md",
}
API, STUB = "api.md", ROOT / "planner" / "__init__.pyi"
LINK = re.compile(r"(!?)\[((?:[^\[\]\\]|\\.|\[[^\]]*\])*)\]\(([^)\s#]*)(#[^)\s]*)?\)")
PUBLIC = re.compile(r"^from \.([\w.]+) import (\w+) as \2$", re.MULTILINE)


def public_names() -> dict[str, list[str]]:
    """Return the full names of all public objects, by the stage that they belong to."""
    found: dict[str, list[str]] = {}
    for module, name in PUBLIC.findall(STUB.read_text(encoding="utf-8")):
        found.setdefault(module.split(".")[0], []).append(f"planner.{module}.{name}")
    return found


def api_page() -> str:
    """Return the page of the API, which mkdocstrings fills in from the docstrings."""
    parts = ["# API", "All that is public, stage by stage; `import planner` has every name."]
    for stage, names in public_names().items():
        parts += [f"## {stage}", *(f"::: {name}" for name in names)]
    return "\n\n".join(parts) + "\n"


def on_files(files: Files, config: Any) -> Files:
    """Add the pages and files that are not in docs/."""
    for source, uri in PAGES.items():
        files.append(File.generated(config, uri, abs_src_path=str(ROOT / source)))
    files.append(File.generated(config, API, content=api_page()))
    pages = [ROOT / "docs" / file.src_uri for file in files.documentation_pages()]
    sources = [*(page for page in pages if page.exists()), *(ROOT / source for source in PAGES)]
    for path in sorted({path for source in sources for path in _linked(source)}):
        files.append(File.generated(config, _copy_of(path), abs_src_path=str(path)))
    return files


def on_page_markdown(markdown: str, page: Any, **_: Any) -> str:
    """Return a page whose links lead to where things are on the site."""
    if page.file.src_uri == API:
        return markdown
    elsewhere = {uri: ROOT / source for source, uri in PAGES.items()}
    here = page.file.src_uri
    source = elsewhere.get(here, ROOT / "docs" / here)
    return LINK.sub(lambda link: _on_site(link, source, here), markdown)


def _linked(source: Path) -> Iterator[Path]:
    """Yield the files that a page links to and that are no pages."""
    for _, _, target, _ in LINK.findall(source.read_text(encoding="utf-8")):
        path = _target(source, target)
        if path is not None and path.is_file() and _page_of(path) is None and not _in_docs(path):
            yield path


def _on_site(link: re.Match[str], source: Path, here: str) -> str:
    mark, text, target, anchor = link.groups()
    path = _target(source, target)
    if path is None:
        return link[0]
    uri = _page_of(path) or (_copy_of(path) if path.is_file() else None)
    if _in_docs(path):
        uri = path.relative_to(ROOT / "docs").as_posix()
    if uri is None:
        return str(text)
    return f"{mark}[{text}]({os.path.relpath(uri, Path(here).parent)}{anchor or ''})"


def _target(source: Path, target: str) -> Path | None:
    """Return the file or folder that a link is to; None for other places and headings alone."""
    if not target or ":" in target:
        return None
    return Path(os.path.normpath(source.parent / target))


def _page_of(path: Path) -> str | None:
    return PAGES.get(path.relative_to(ROOT).as_posix()) if path.is_relative_to(ROOT) else None


def _in_docs(path: Path) -> bool:
    return path.is_relative_to(ROOT / "docs") and path.is_file()


def _copy_of(path: Path) -> str:
    return f"files/{path.relative_to(ROOT).as_posix()}"
