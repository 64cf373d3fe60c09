"""The report in a browser: everything loads, nothing is fetched, and it fits a phone."""

import shutil

import pytest
from support.browser import chromium, colour_at, scene_of

from copsense.explore.drawing import ON_LIGHT
from copsense.paper.report import report_figures
from copsense.paper.report.report_scenes import lateral_run

SCENE = ("", "about:srcdoc")  # the 3-D view's own page, which says which GPU it found


@pytest.fixture(scope="module")
def browser():
    with chromium() as browser:
        yield browser


@pytest.fixture(scope="module")
def address(folder, tmp_path_factory):
    # The page alone, in a folder of its own: nothing beside it may be needed.
    alone = tmp_path_factory.mktemp("alone") / "alone.html"
    shutil.copy(folder / "report.html", alone)
    return alone.as_uri()


@pytest.fixture(scope="module")
def events():
    return {"requests": [], "console": [], "errors": []}


@pytest.fixture(scope="module")
def page(browser, address, events):
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    page.on("request", lambda request: events["requests"].append(request.url))
    page.on(
        "console",
        lambda m: events["console"].extend(
            [m.text] * (m.type == "error" or m.location["url"] not in SCENE)
        ),
    )
    page.on("pageerror", lambda error: events["errors"].append(str(error)))
    page.goto(address, wait_until="load")
    yield page
    page.close()


def test_nothing_is_fetched_but_the_page_itself(page, events, address):
    page.evaluate("window.scrollTo(0, document.body.scrollHeight)")
    assert address in events["requests"]
    assert {url.partition(":")[0] for url in events["requests"]} <= {"file", "data"}
    assert [url for url in events["requests"] if url.startswith("file:")] == [address]


def test_the_console_stays_empty(page, events):
    assert events["console"] == []
    assert events["errors"] == []


def test_every_figure_is_loaded_and_captioned(page, reproduction):
    shown = page.eval_on_selector_all(
        "figure:not(.scene)",
        """figures => figures.map(figure => {
            const image = figure.querySelector('img');
            const box = image.getBoundingClientRect();
            return {id: figure.id, natural: image.naturalWidth, complete: image.complete,
                    width: box.width, height: box.height, alt: image.alt,
                    caption: figure.querySelector('figcaption').innerText}})""",
    )
    assert [figure["id"] for figure in shown] == [f.name for f in report_figures(reproduction)]
    for figure in shown:
        assert figure["complete"], figure["id"]
        assert figure["natural"] > 100, figure["id"]
        assert min(figure["width"], figure["height"]) > 100, figure["id"]
        assert len(figure["caption"]) > 40, figure["id"]
        assert figure["alt"], figure["id"]


def test_the_robot_plays_in_3_d(page, reproduction):
    page.locator("#film iframe").scroll_into_view_if_needed()
    scene = scene_of(page)
    place = "() => window.__viserMutable.nodeRefFromName['/com'].position.y"
    scene.wait_for_function(f"Math.abs(({place})()) > 0.03", timeout=60_000)
    here = lateral_run(reproduction).stance
    seen, right = colour_at(scene, here.placements[0].translation, ON_LIGHT.sole, reach=40)
    assert right, seen


def test_every_claim_is_shown_with_its_verdict(page, reproduction):
    for claim in reproduction.claims:
        row = page.locator(f"#claim-{claim.claim.identifier}")
        assert row.is_visible()
        assert row.locator(".badge").inner_text().endswith(claim.verdict.value)


def test_links_of_the_contents_lead_to_headings(page):
    for link in page.locator("nav a").all():
        target = link.get_attribute("href")
        assert page.locator(f"h2{target}").count() == 1


@pytest.mark.parametrize("width", [360, 390, 768, 1280, 1920])
def test_the_page_never_scrolls_sideways(browser, address, width):
    page = browser.new_page(viewport={"width": width, "height": 800})
    page.goto(address)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    overflowing = page.evaluate(
        """() => [...document.querySelectorAll('main *, header *')].filter(element => {
            if (element.closest('.box, .picture')) return false;
            const box = element.getBoundingClientRect();
            return box.width > 0 && box.right > window.innerWidth + 1;
        }).map(element => element.outerHTML.slice(0, 120))"""
    )
    assert overflowing == []
    page.close()


def test_a_wide_table_scrolls_in_its_own_box(browser, address):
    page = browser.new_page(viewport={"width": 360, "height": 800})
    page.goto(address)
    box = page.locator("[aria-label='Reference values']")
    inner, outer = box.evaluate("box => [box.scrollWidth, box.clientWidth]")
    assert inner > outer
    box.evaluate("box => box.scrollTo(50, 0)")
    assert box.evaluate("box => box.scrollLeft") > 0
    page.close()


@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_text_stands_out_in_light_and_dark(browser, address, scheme):
    """WCAG AA: a contrast of 4.5 or more, of each kind of text against what it is on."""
    page = browser.new_page(color_scheme=scheme)
    page.goto(address)
    for selector in ("body", ".badge.holds", ".badge.if", ".badge.not", "figcaption", "thead th"):
        ink, paper = page.locator(selector).first.evaluate(
            """element => {
                let ground = element;
                const seen = e => getComputedStyle(e).backgroundColor;
                while (seen(ground) === 'rgba(0, 0, 0, 0)') ground = ground.parentElement;
                return [getComputedStyle(element).color, seen(ground)]}"""
        )
        assert contrast(ink, paper) >= 4.5, (scheme, selector, ink, paper)
    page.close()


def contrast(first, second):
    bright, dark = sorted((luminance(first), luminance(second)), reverse=True)
    return (bright + 0.05) / (dark + 0.05)


def luminance(colour):
    parts = [int(part) / 255 for part in colour.strip("rgb()").split(", ")[:3]]
    linear = [p / 12.92 if p <= 0.04045 else ((p + 0.055) / 1.055) ** 2.4 for p in parts]
    return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2]
