"""Book and slides build without a warning, and every page and slide can be read, also by those who do not see it.

The pages are opened in Debian's chromium. Where there is none the browser tests are skipped, except in CI.
"""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parent.parent
LECTURES = sorted(path.stem for path in (ROOT / "lectures").glob("*.md"))
PAGES = [*LECTURES, *sorted(f"instructors/{path.stem}" for path in (ROOT / "lectures" / "instructors").glob("*.md"))]

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
BROKEN_IMAGES = """async () => {
  const images = [...document.images];
  await Promise.all(images.map(image => image.decode().catch(() => null)));
  return images.filter(image => !image.naturalWidth || !image.alt.trim()).map(image => image.outerHTML.slice(0, 200));
}"""


@pytest.fixture(scope="session")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build book and slides from nothing, as `make lectures` does, every cell run anew."""
    folder = tmp_path_factory.mktemp("lectures")
    for builder, output in (("html", "book"), ("revealjs", "slides")):
        command = [sys.executable, "-m", "sphinx", "-q", "-W", "--keep-going", "-b", builder]
        command += ["-d", f"{folder}/doctrees-{output}", "-D", f"nb_execution_cache_path={folder}/cache"]
        command += [str(ROOT / "lectures"), f"{folder}/{output}"]
        done = subprocess.run(command, capture_output=True, text=True, timeout=600)
        assert done.returncode == 0, done.stderr.partition("Versions\n")[0]
    return folder


@pytest.fixture
def page(browser: Any) -> Iterator[Any]:
    """Open a window as large as a projector; whatever a page asks for beyond its own folder fails the test."""
    window = browser.new_page(viewport={"width": 1280, "height": 720})
    outside: list[str] = []
    window.on(
        "request", lambda request: None if request.url.startswith(("file:", "data:")) else outside.append(request.url)
    )
    window.on("requestfailed", lambda request: outside.append(f"failed: {request.url}"))
    yield window
    window.close()
    assert outside == []


def violations(page: Any) -> list[str]:
    """Return what axe finds on a page, one line for each rule."""
    # axe would fetch style sheets once more, which a browser forbids for files; it does not need to.
    axe = pytest.importorskip("axe_playwright_python.sync_playwright")
    found = axe.Axe().run(page, options={"preload": False}).response["violations"]
    return [f"{rule['id']}: {rule['help']}: {rule['nodes'][0]['html'][:150]}" for rule in found]


@pytest.mark.parametrize("name", PAGES)
def test_every_page_of_the_book_can_be_read(site: Path, page: Any, name: str) -> None:
    """No broken or undescribed picture, nothing wider than the window, nothing that axe objects to."""
    page.goto(f"file://{site}/book/{name}.html")
    assert page.evaluate(BROKEN_IMAGES) == []
    assert page.evaluate("document.documentElement.scrollWidth <= innerWidth")
    assert violations(page) == []


@pytest.mark.parametrize("name", LECTURES)
def test_every_slide_fits_a_projector(site: Path, page: Any, name: str) -> None:
    """Nothing lies outside of 1280 x 720 pixels, no slide is empty, no picture is broken or undescribed."""
    page.goto(f"file://{site}/slides/{name}.html")
    page.wait_for_function("Reveal.isReady()")
    assert page.evaluate(BROKEN_IMAGES) == []
    assert page.evaluate(OUTSIDE) == []


@pytest.mark.parametrize("name", LECTURES)
def test_axe_has_nothing_against_the_slides(site: Path, page: Any, name: str) -> None:
    """All slides of a deck are checked at once, in the view for printing."""
    page.goto(f"file://{site}/slides/{name}.html?print-pdf")
    page.wait_for_function("Reveal.isReady() && document.querySelector('.pdf-page')")
    assert violations(page) == []


@pytest.mark.parametrize("name", [name for name in LECTURES if name != "index"])
def test_a_lecture_has_what_each_lecture_has(name: str) -> None:
    """Goals, demos, common mistakes, exercises with folded solutions, a summary, and assertions at the end."""
    text = (ROOT / "lectures" / f"{name}.md").read_text()
    for heading in ("## Goals", "## What people get wrong", "## Exercises", "## Summary"):
        assert f"\n{heading}\n" in text, f"{name} lacks the section {heading}"
    cells = text.split("```{code-cell}")[1:]
    assert any("hide-cell" in cell for cell in cells), f"{name} has no folded solution"
    assert "assert " in cells[-1], f"{name} does not end with assertions"
