"""Print the talks that have been built as PDF: `python print_talks.py build/lectures/slides`.

`01_nodes.pdf` has a page for each slide. In `01_nodes_notes.pdf` a page with the notes follows each slide.
"""

from __future__ import annotations

import shutil
import sys
from pathlib import Path

BROWSERS = ("chromium", "chromium-browser", "google-chrome")
FORMS = {"": "", "_notes": "&showNotes=separate-page"}
"""What the name of a file ends in, and what reveal.js is asked for."""
NOTES_STYLE = (
    ".reveal .speaker-notes-pdf { font-size: 30px !important; line-height: 1.4 !important; }"
    ".reveal .speaker-notes-pdf:last-child { break-after: avoid !important; page-break-after: avoid !important; }"
)
"""Notes as large as they must be if a slide and its notes are printed on one sheet."""


def print_talks(folder: Path) -> list[Path]:
    """Print each deck of a folder into two files beside it, without and with the notes, and return the files.

    Raises:
        SystemExit: there is no browser, or there are no decks.
    """
    browser = next(filter(None, map(shutil.which, BROWSERS)), None)
    if browser is None:
        raise SystemExit(
            "No browser was found to print the slides with. What to do: sudo apt-get install chromium"
            " (or print each deck yourself: open it with ?print-pdf behind its address)."
        )
    decks = sorted(folder.glob("[0-9]*.html"))
    if not decks:
        raise SystemExit(f"There are no slides in {folder}. What to do: make lectures")
    from playwright.sync_api import sync_playwright

    printed: list[Path] = []
    with sync_playwright() as playwright:
        started = playwright.chromium.launch(executable_path=browser, args=["--no-sandbox", "--disable-gpu"])
        window = started.new_page(viewport={"width": 1280, "height": 720})
        window.add_init_script("addEventListener('pdf-ready', () => { window.laidOut = true })")
        for deck in decks:
            for ending, notes in FORMS.items():
                window.goto(f"{deck.resolve().as_uri()}?print-pdf{notes}")
                # All pages are there earlier, but reveal.js still moves them, and then only one would be printed.
                window.wait_for_function("window.laidOut")
                window.add_style_tag(content=NOTES_STYLE)
                file = deck.with_name(f"{deck.stem}{ending}.pdf")
                window.pdf(path=file, prefer_css_page_size=True, print_background=True)
                printed.append(file)
        started.close()
    return printed


if __name__ == "__main__":
    print(*print_talks(Path(sys.argv[1])), sep="\n")
