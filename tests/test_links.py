"""Every link of a page within the repository leads to a file, and to a heading of it."""

import re
from pathlib import Path

import pytest
from markdown_it import MarkdownIt

ROOT = Path(__file__).parents[1]
PAGES = sorted(
    path.relative_to(ROOT).as_posix()
    for pattern in ("*.md", "docs/*.md", "docs/*/*.md", "benchmarks/*.md", "paper/*.md")
    for path in ROOT.glob(pattern)
)
TARGET = re.compile(r"^\(([\w-]+)\)=$", re.MULTILINE)  # MyST's own anchors
SCHEME = re.compile(r"^[a-z]+:")


def links(page: Path) -> list[str]:
    """Targets of a page's links and pictures."""
    found = []
    for token in MarkdownIt("commonmark").enable("table").parse(page.read_text("utf-8")):
        for part in token.children or ():
            target = part.attrGet("href") or part.attrGet("src")
            if target:
                found.append(str(target))
    return found


def anchors(page: Path) -> set[str]:
    """What a link into a page may name: its headings as GitHub and MyST write them, its targets."""
    text = page.read_text("utf-8")
    tokens = MarkdownIt("commonmark").parse(text)
    titles = [
        "".join(part.content for part in tokens[index + 1].children or ())
        for index, token in enumerate(tokens)
        if token.type == "heading_open"
    ]
    return {slug(title) for title in titles} | set(TARGET.findall(text))


def slug(title: str) -> str:
    """A heading's anchor: letters, digits and hyphens in small letters."""
    return re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-")


def broken(page: Path) -> list[str]:
    """The links of a page that lead nowhere in the repository."""
    found = []
    for link in links(page):
        path, _, anchor = link.partition("#")
        target = page if not path else page.parent / path
        if SCHEME.match(link):
            continue
        if not target.exists() or (anchor and anchor not in anchors(target)):
            found.append(link)
    return found


@pytest.mark.parametrize("page", PAGES)
def test_links_of_a_page_lead_somewhere(page):
    assert broken(ROOT / page) == []


def test_a_link_that_leads_nowhere_is_found(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# One & two\n\n(here)=\n[a](#one--two) [b](#here) [c](x.md) ![d](#no) <e:f>\n")
    assert broken(page) == ["x.md", "#no"]
