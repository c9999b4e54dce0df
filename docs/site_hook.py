"""What MkDocs calls while it builds the site: adds the pages of the environments, and the changelog."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import make_environment_pages as environments
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files
from mkdocs.structure.pages import Page

ROOT = Path(__file__).parent.parent
CHANGELOG = "changelog.md"
OVERVIEW = "environments/index.md"


def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """List the pages of the environments below their overview."""
    entries: list[Any] = [{"Overview": OVERVIEW}]
    for title, names in environments.groups().items():
        if len(names) == 1:
            entries.append({title: source(names[0])})
            continue
        entries.append({title: [{environments.short_name(name): source(name)} for name in names]})
    assert config.nav is not None
    config.nav = [
        {"Environments": entries} if entry == {"Environments": OVERVIEW} else entry for entry in config.nav
    ]
    return config


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add what is generated."""
    for group in environments.groups().values():
        for name in group:
            files.append(File.generated(config, source(name), content=environments.page(name)))
    files.append(
        File.generated(config, CHANGELOG, content=(ROOT / "CHANGELOG.md").read_text(encoding="utf-8"))
    )
    return files


def on_page_markdown(markdown: str, page: Page, config: MkDocsConfig, files: Files) -> str:
    """Fill in the table of the overview."""
    return environments.overview(markdown) if page.file.src_uri == OVERVIEW else markdown


def source(name: str) -> str:
    """Return the address of an id's page."""
    return f"environments/{name}.md"
