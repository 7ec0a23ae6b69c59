"""Book and slides build without a warning, and every page and slide can be read, also by those who do not see it.

The pages are opened in Debian's chromium. Where there is none the browser tests are skipped, except in CI.
"""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from conftest import BROWSER_SECONDS
from places import ROOT

LECTURES = sorted(path.stem for path in (ROOT / "lectures").glob("*.md"))
DECKS = sorted(path.stem for path in (ROOT / "lectures" / "slides").glob("*.md"))
TALKS = [name for name in DECKS if name != "index" and not (ROOT / "lectures" / "slides" / f"{name}.md").is_symlink()]
OTHERS = [path for folder in ("appendix", "instructors") for path in (ROOT / "lectures" / folder).glob("*.md")]
PAGES = [*LECTURES, *sorted(f"{path.parent.name}/{path.stem}" for path in OTHERS)]

# Runs in a deck: what lies outside of its slide, for each slide.
OUTSIDE = """() => Reveal.getSlides().flatMap((slide, number) => {
  const at = Reveal.getIndices(slide);
  Reveal.slide(at.h, at.v);
  const boxes = [...slide.querySelectorAll('*')].map(element => element.getBoundingClientRect());
  const title = slide.querySelector('h1, h2, h3').getBoundingClientRect();
  const right = Math.max(...boxes.map(box => box.right)), bottom = Math.max(...boxes.map(box => box.bottom));
  const shown = title.top >= 0 && title.height >= 40 && slide.children.length > 1;
  return shown && right <= innerWidth && bottom <= innerHeight
    ? [] : [`slide ${number + 1} "${slide.innerText.slice(0, 40)}" reaches ${right} x ${bottom}, title ${title.top}`];
})"""
# Runs in a talk: slides without notes, with much code, with lines of code that wrap, or with words that a last row
# cannot read. Of a figure the smallest text counts, as large as it is shown.
UNFIT = """() => Reveal.getSlides().flatMap((slide, number) => {
  const at = Reveal.getIndices(slide), found = [];
  Reveal.slide(at.h, at.v);
  const sizes = [];
  for (const element of slide.querySelectorAll('*:not(aside)')) {
    const words = [...element.childNodes].some(node => node.nodeType === 3 && node.textContent.trim());
    if (words && !element.closest('aside')) sizes.push(parseFloat(getComputedStyle(element).fontSize));
  }
  for (const image of slide.querySelectorAll('img')) {
    const drawing = new DOMParser().parseFromString(atob(image.src.split('base64,')[1]), 'image/svg+xml');
    const [, , width, height] = drawing.documentElement.getAttribute('viewBox').split(' ').map(Number);
    const scale = Math.min(image.clientWidth / width, image.clientHeight / height);
    drawing.querySelectorAll('text').forEach(text => sizes.push(scale * parseFloat(text.getAttribute('font-size'))));
  }
  if (Math.min(...sizes) < 0.025 * 720) found.push(`text of ${Math.min(...sizes)} px`);
  if (!slide.querySelector('aside.notes')) found.push('no notes');
  const lines = [...slide.querySelectorAll('pre')].map(block => block.innerText.trimEnd().split('\\n').length);
  if (Math.max(0, ...lines) > 12) found.push(`${Math.max(...lines)} lines of code`);
  for (const block of slide.querySelectorAll('pre')) {
    const style = getComputedStyle(block), padding = parseFloat(style.paddingTop) + parseFloat(style.paddingBottom);
    const rows = Math.round((block.clientHeight - padding) / parseFloat(style.lineHeight));
    const lines = block.innerText.trimEnd().split('\\n').length;
    if (rows > lines) found.push(`code that wraps: ${lines} lines in ${rows} rows`);
  }
  return found.length ? [`slide ${number + 1} "${slide.querySelector('h1, h2').innerText}": ${found}`] : [];
})"""
# Runs in a page of the book: what would have to be scrolled sideways, the window or a part of it that is no listing.
WIDE = """() => [document.documentElement, ...document.querySelectorAll('main *:not(pre)')].filter(element =>
  element.scrollWidth > element.clientWidth + 1 &&
  (element === document.documentElement || ['auto', 'scroll'].includes(getComputedStyle(element).overflowX))
).map(element => `${element.tagName} ${element.innerText.slice(0, 60)}`)"""
# Runs in a page of the book: listings whose lines wrap, so that their indentation is lost.
WRAPPED = """() => [...document.querySelectorAll('.cell_input pre, .program pre')].filter(block =>
  getComputedStyle(block).whiteSpace !== 'pre').map(block => block.innerText.slice(0, 60))"""
BROKEN_IMAGES = """async () => {
  const images = [...document.images];
  await Promise.all(images.map(image => image.decode().catch(() => null)));
  return images.filter(image => !image.naturalWidth || !image.alt.trim()).map(image => image.outerHTML.slice(0, 200));
}"""


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build book and slides from nothing, as `make lectures` does, every cell run anew."""
    folder = tmp_path_factory.mktemp("lectures")
    command = [sys.executable, ROOT / "lectures" / "_lib" / "build.py", folder]
    done = subprocess.run(command, capture_output=True, text=True, timeout=3600)
    assert done.returncode == 0, done.stderr
    return folder


@pytest.mark.parametrize(("fails", "status"), [(1, 0), (2, 1)], ids=["once", "twice"])
def test_a_page_of_which_a_cell_failed_is_run_once_more(tmp_path: Path, fails: int, status: int) -> None:
    script = tmp_path / "lectures" / "_lib" / "build.py"
    (tmp_path / "lectures" / "slides").mkdir(parents=True)
    script.parent.mkdir()
    shutil.copy(ROOT / "lectures" / "_lib" / "build.py", script)
    (tmp_path / "lectures" / "conf.py").write_text(
        f"import sys\nsys.path.append({str(ROOT / 'lectures' / '_ext')!r})\n"
        "extensions = ['myst_nb', 'sphinx_revealjs', 'execution']\nexclude_patterns = ['_*', 'slides']\n"
        "nb_execution_mode = 'cache'\nnb_execution_show_tb = True\n"
    )
    measured = (
        "---\nfile_format: mystnb\nkernelspec:\n  name: python3\n---\n# Measured\n\n```{code-cell} ipython3\n"
        f"runs = open({str(tmp_path / 'runs')!r}, 'a+')\nruns.write('x')\nruns.seek(0)\n"
        f"assert len(runs.read()) > {fails}\n```\n"
    )
    (tmp_path / "lectures" / "index.md").write_text(measured)
    (tmp_path / "lectures" / "slides" / "index.md").write_text("# A talk\n")
    command = [sys.executable, script, tmp_path / "out"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=600)
    assert done.returncode == status, done.stderr
    assert "index is run once more, because not everything held" in done.stderr
    assert (tmp_path / "runs").read_text() == "xx"
    assert (tmp_path / "out" / "slides" / "index.html").is_file() == (status == 0)
    assert (tmp_path / "out" / "book" / "notebooks" / "index.ipynb").is_file() == (status == 0)


@pytest.fixture
def page(browser: Any) -> Iterator[Any]:
    """Open a window as large as a projector; whatever a page asks for beyond its own folder fails the test."""
    # Without motion a colour is there at once, so that nothing is measured on its way from one to another.
    window = browser.new_page(viewport={"width": 1280, "height": 720}, reduced_motion="reduce")
    window.set_default_timeout(1000 * BROWSER_SECONDS)
    outside: list[str] = []
    window.on(
        "request", lambda request: None if request.url.startswith(("file:", "data:")) else outside.append(request.url)
    )
    # What was still on its way when a page was left or closed is aborted.
    missing = lambda request: request.failure != "net::ERR_ABORTED"  # noqa: E731
    window.on("requestfailed", lambda request: missing(request) and outside.append(f"failed: {request.url}"))
    yield window
    window.close()
    assert outside == []


def violations(page: Any, contrast: bool) -> list[str]:
    """Return what axe finds on a page, one line for each rule; the contrast of each word takes most of its time."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    # axe would fetch style sheets once more, which a browser forbids for files; it does not need to.
    options = {"preload": False, "resultTypes": ["violations"], "rules": {"color-contrast": {"enabled": contrast}}}
    found = axe.Axe().run(page, options=options).response["violations"]
    return [f"{rule['id']}: {rule['help']}: {rule['nodes'][0]['html'][:150]}" for rule in found]


@pytest.fixture
def contrast(request: pytest.FixtureRequest, name: str) -> bool:
    """Whether contrast is measured, too: one style serves all pages, and these two show most pairs of its colours."""
    return bool(request.config.getoption("complete")) or name in (LECTURES[0], "instructors/write_a_lab")


@pytest.mark.parametrize("name", PAGES)
def test_every_page_of_the_book_can_be_read(site: Path, page: Any, name: str, contrast: bool) -> None:
    """No broken or undescribed picture, nothing that axe objects to, and nothing but code to scroll sideways.

    What a phone shows too small leads to a file that can be enlarged. A dark page has other colours only.
    """
    page.goto(f"file://{site}/book/{name}.html")
    assert page.evaluate(BROKEN_IMAGES) == []
    assert page.evaluate(WIDE) == []
    assert violations(page, contrast) == []
    if contrast:
        page.emulate_media(color_scheme="dark")
        page.wait_for_function("document.documentElement.dataset.theme === 'dark'")
        assert violations(page, contrast) == []
    page.set_viewport_size({"width": 390, "height": 800})
    page.evaluate("document.querySelectorAll('details').forEach(fold => { fold.open = true })")
    assert page.evaluate(WIDE) == []
    assert page.evaluate(WRAPPED) == []
    assert page.evaluate("[...document.querySelectorAll('main img[src$=svg]')].every(one => one.closest('a[href]'))")


def test_the_search_finds_a_lecture_without_a_network(site: Path, browser: Any) -> None:
    """In a window of its own: a page that was opened as a file may not fetch the excerpts of what it has found."""
    window = browser.new_page()
    window.set_default_timeout(1000 * BROWSER_SECONDS)
    window.goto(f"file://{site}/book/search.html?q=deadlock")
    window.wait_for_selector("#search-results a[href*='02_executors']")
    window.close()


def test_paper_shows_what_is_folded_and_is_white(site: Path, page: Any) -> None:
    page.emulate_media(color_scheme="dark")
    page.goto(f"file://{site}/book/02_executors.html")
    closed = "document.querySelectorAll('article details:not([open])').length"
    look = f"() => [document.documentElement.dataset.theme, {closed}]"
    scheme, folded = page.evaluate(look)
    assert scheme == "dark" and folded > 10
    page.evaluate("dispatchEvent(new Event('beforeprint'))")
    assert page.evaluate(look) == ["light", 0]
    page.evaluate("dispatchEvent(new Event('afterprint'))")
    assert page.evaluate(look) == ["dark", folded]


@pytest.mark.parametrize("name", ["a-group-that-has-too-much-to-do", "spin-once-runs-one"])
def test_a_link_opens_what_it_leads_to(site: Path, page: Any, name: str) -> None:
    """The first one leads to a heading with a folded part below it, the second one into such a part."""
    page.goto(f"file://{site}/book/02_executors.html")
    assert page.locator("details.part").count() and not page.locator("details.part[open]").count()
    page.evaluate(f"location.hash = '{name}'")
    page.wait_for_selector(f"#{name} > details.part[open], details.part[open] #{name}", state="attached")


@pytest.mark.parametrize("name", TALKS)
def test_a_talk_can_be_given(site: Path, page: Any, name: str) -> None:
    """25 to 35 slides, each with notes, at most 12 lines of code, and no text below 2.5 % of the height."""
    page.goto(f"file://{site}/slides/{name}.html")
    page.wait_for_function("Reveal.isReady()")
    assert 25 <= page.evaluate("Reveal.getTotalSlides()") <= 35
    assert page.evaluate(UNFIT) == []


@pytest.mark.parametrize("name", DECKS)
def test_every_slide_fits_a_projector(site: Path, page: Any, name: str) -> None:
    """Nothing lies outside of 1280 x 720 pixels, no slide is empty, no picture is broken or undescribed."""
    page.goto(f"file://{site}/slides/{name}.html")
    page.wait_for_function("Reveal.isReady()")
    assert page.evaluate(BROKEN_IMAGES) == []
    assert page.evaluate(OUTSIDE) == []


@pytest.mark.parametrize("name", DECKS)
def test_axe_has_nothing_against_the_slides(site: Path, page: Any, name: str, contrast: bool) -> None:
    """All slides of a deck are checked at once, in the view for printing."""
    page.goto(f"file://{site}/slides/{name}.html?print-pdf")
    page.wait_for_function("Reveal.isReady() && document.querySelector('.pdf-page')")
    assert violations(page, contrast) == []


def test_a_talk_can_be_printed(site: Path, browser: Any, tmp_path: Path) -> None:
    """A page for each slide, and with the notes two pages; where there is no browser, one sentence."""
    for name in ("_static", "_images"):
        (tmp_path / name).symlink_to(site / "slides" / name)
    deck = tmp_path / f"{TALKS[0]}.html"
    deck.write_text((site / "slides" / deck.name).read_text())
    command = [sys.executable, ROOT / "lectures" / "_lib" / "print_talks.py", tmp_path]
    subprocess.run(command, check=True, timeout=300)
    slides = deck.read_text().count('<aside class="notes"')
    for ending, number in (("", slides), ("_notes", 2 * slides)):
        printed = deck.with_name(f"{deck.stem}{ending}.pdf").read_bytes()
        assert len(re.findall(rb"/Type\s*/Page\b", printed)) == number
    without = subprocess.run(command, capture_output=True, text=True, timeout=300, env={"PATH": ""})
    assert without.returncode == 1 and without.stderr.startswith("No browser was found"), without.stderr


@pytest.mark.parametrize("name", [name for name in LECTURES if name[0].isdigit()])
def test_a_lecture_has_what_each_lecture_has(name: str) -> None:
    """Goals, demos, common mistakes, exercises with folded solutions, a summary, and assertions at the end."""
    text = (ROOT / "lectures" / f"{name}.md").read_text()
    # A page whose deck is a talk has the form that `instructors/write_a_lecture.md` describes.
    more = ("## Quiz", "## Read on", "## What this page measured") if name in TALKS else ()
    for heading in ("## Goals", "## What people get wrong", "## Exercises", "## Summary", *more):
        assert f"\n{heading}\n" in text, f"{name} lacks the section {heading}"
    cells = text.split("```{code-cell}")[1:]
    assert any("hide-cell" in cell for cell in cells), f"{name} has no folded solution"
    assert "assert " in cells[-1], f"{name} does not end with assertions"
