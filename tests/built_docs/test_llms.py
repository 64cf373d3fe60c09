"""The index for language models lists every page, in the form of llmstxt.org."""

import re
from pathlib import Path

ROOT = Path(__file__).parents[2]
INDEX = ROOT / "docs" / "llms.txt"
LINK = re.compile(r"^- \[[^\]]+\]\(([\w/.-]+)\.html\)(?:: .+)?$")


def links():
    """The pages that are listed."""
    lines = INDEX.read_text("utf-8").splitlines()
    return [match[1] for match in map(LINK.match, lines) if match]


def test_it_has_a_title_a_summary_and_sections_of_links():
    text = INDEX.read_text("utf-8")
    assert re.match(r"# copsense\n\n> (?:.+\n(?:> )?)+\n", text)
    for section in re.split(r"^## .*\n", text, flags=re.MULTILINE)[1:]:
        assert all(LINK.match(line) for line in section.splitlines() if line)


def test_every_page_is_listed():
    docs = ROOT / "docs"
    pages = {
        path.relative_to(docs).with_suffix("").as_posix()
        for path in (*docs.glob("*.md"), *docs.glob("tutorials/*.md"))
    }
    assert set(links()) == pages - {"index"}


def test_it_stands_at_the_root_of_the_built_pages(built):
    assert (built / "llms.txt").read_text("utf-8") == INDEX.read_text("utf-8")
    for link in links():
        assert (built / f"{link}.html").is_file()
