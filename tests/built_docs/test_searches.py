"""The search of the documentation, in a browser, finds the page for what a newcomer asks."""

import functools
import http.server
import threading

import pytest
from support.browser import chromium

FIRST = 4  # of the pages that are found
# What is typed -> the pages of which one is among the first.
QUESTIONS = {
    "install": "install",
    "install conda": "install",
    "windows": "install",
    "my robot urdf": "tutorials/my_robot",
    "contact frame": "conventions|adding|faq|glossary",
    "sole polygon": "faq|glossary|tutorials/my_robot|adding|conventions",
    "package:// mesh not found": "faq|adding",
    "posture does not settle": "faq",
    "joint beyond limit": "faq",
    "payload": "faq|cheat_sheet|drives",
    "hand on a wall": "faq|postures|gallery",
    "stairs": "faq",
    "slope": "postures|faq|gallery",
    "quadruped": "faq|gallery|tutorials/my_robot",
    "zmp": "glossary",
    "centroidal moment pivot": "glossary",
    "foot rotation indicator": "glossary",
    "mujoco contact force sign": "glossary|faq",
    "wrench order force moment": "conventions|glossary",
    "quaternion order": "conventions|glossary",
    "which controller keeps the feet": "tutorials/which_controller",
    "friction limits": "tutorials/limits|theory|api/copsense.limits",
    "push": "tutorials/limits|api/copsense.pushes",
    "how sure": "tutorials/how_sure",
    "encoder error": "tutorials/how_sure|uncertainty|logs",
    "million postures": "tutorials/million_postures",
    "best posture": "tutorials/which_posture|optimise",
    "own controller closed loop": "tutorials/my_controller",
    "ros bag": "logs|faq",
    "pandas": "faq|api",
    "degrees or radians": "faq|conventions",
    "tsid": "coming_from",
    "errata": "errata",
    "cheat sheet": "cheat_sheet",
    "load_stance": "api/copsense.robots",
    "minimum_torque": "api/copsense.criterion",
}
RUN = """query => {
  const [text, ...terms] = Search._parseQuery(query);
  return Search._performSearch(text, ...terms).reverse().map(result => result[0]);
}"""


@pytest.fixture(scope="module")
def page(built):
    handler = functools.partial(QuietHandler, directory=str(built))
    with http.server.ThreadingHTTPServer(("127.0.0.1", 0), handler) as server:
        threading.Thread(target=server.serve_forever, daemon=True).start()
        with chromium() as browser:
            page = browser.new_page()
            page.goto(f"http://127.0.0.1:{server.server_port}/search.html")
            page.wait_for_function("Search.hasIndex() && typeof Stemmer !== 'undefined'")
            yield page
        server.shutdown()


class QuietHandler(http.server.SimpleHTTPRequestHandler):
    """Serves a folder and says nothing."""

    def log_message(self, *_):
        """Keep the tests' output free of requests."""


def test_thirty_questions_are_asked():
    assert len(QUESTIONS) >= 30


@pytest.mark.parametrize("question", QUESTIONS)
def test_a_question_finds_its_page_among_the_first(question, page):
    found = list(dict.fromkeys(page.evaluate(RUN, question)))
    wanted = QUESTIONS[question].split("|")
    first = [name for name in found[:FIRST] if any(name.startswith(page) for page in wanted)]
    assert first, f"{question!r} finds {found[:8]}"


def test_what_is_typed_is_shown(page):
    page.goto(page.url.partition("?")[0] + "?q=zmp")
    page.wait_for_selector("#search-results li a")
    shown = page.eval_on_selector_all("#search-results li a", "links => links.map(l => l.href)")
    assert any("glossary.html" in link for link in shown[:FIRST])
