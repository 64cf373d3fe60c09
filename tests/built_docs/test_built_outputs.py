"""What commands print, on the built pages: sentences wrap, and wide tables say that they scroll."""

import re

from support.browser import chromium, offline

CODE = """() => [...document.querySelectorAll('div.highlight pre')]
  .filter(code => code.scrollWidth > code.clientWidth)
  .map(code => getComputedStyle(code).backgroundAttachment)"""


def test_long_sentences_of_outputs_wrap_and_their_columns_do_not(built):
    page = (built / "tutorials" / "which_controller.html").read_text("utf-8")
    notes = re.findall(r"^(.*)>note: contacts", page, flags=re.MULTILINE)
    assert notes
    assert all('class="sentence"' in before for before in notes)
    rows = re.findall(r"^(.*)>  l_sole +0", page, flags=re.MULTILINE)
    assert rows
    assert not any("sentence" in before for before in rows)
    assert "wide-output" in page
    assert "wide-output" not in (built / "install.html").read_text("utf-8")


def test_names_in_tables_break_after_dots_and_are_whole_in_the_text(built):
    page = (built / "api.html").read_text("utf-8")
    assert "copsense.<wbr>load_<wbr>stance" in page
    assert "<wbr>" not in re.sub(r"<td\b.*?</td>", "", page, flags=re.DOTALL)


def test_code_that_goes_on_beside_a_narrow_screen_has_a_shadow_there(built):
    with chromium() as browser:
        with offline(browser, built / "coming_from.html", width=390) as page:
            narrow = page.evaluate(CODE)
        with offline(browser, built / "coming_from.html", width=1300) as page:
            wide = page.evaluate(CODE)
    assert narrow
    assert set(narrow) == {"local, scroll"}  # what covers the shadow at the end, and the shadow
    assert wide == []
