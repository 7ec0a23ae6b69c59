"""Sphinx configuration: a page of the book and a deck of slides for each topic, both MyST notebooks.

Every code cell runs on the real rclpy; a cell that fails ends the build. The book is made of this folder. The slides
are made of the folder `slides`, in which each lecture is a talk of its own that runs the programs of the book's page.
"""

from __future__ import annotations

import os
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parent
sys.path[:0] = [str(ROOT), str(HERE / "_ext"), str(HERE / "_lib")]

from autograder.graph.domains import claim_domain  # noqa: E402
from autograder.sandbox.environment import profile_environment  # noqa: E402  (needs the path above)

_domain = claim_domain()
# What the kernels inherit. The log folder must exist before rclpy starts.
os.environ |= profile_environment() | {"ROS_DOMAIN_ID": str(_domain.id), "JUPYTER_PREFER_ENV_PATH": "1"}
os.environ |= {"LECTURES": str(HERE), "PYTHONPATH": str(HERE / "_lib")}
Path(os.environ["ROS_LOG_DIR"]).mkdir(parents=True, exist_ok=True)
# A page that runs the command `autograder` means the one of this environment.
os.environ["PATH"] = os.pathsep.join([str(Path(sys.executable).parent), os.environ.get("PATH", "")])

project = "ROS 2 in Python"
author = "The course kit's authors"
language = "en"
extensions = ["myst_nb", "sphinx_revealjs", "execution"]
extensions += ["slides", "talk", "programs", "drawings", "claims", "folds", "reference", "tables"]
exclude_patterns = ["_*", "slides"]
templates_path = ["_templates"]
pygments_style = "default"
myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3

nb_execution_mode = "cache"
nb_execution_in_temp = True
nb_execution_timeout = 300  # seconds for a cell: compiling an interface takes half a minute on a busy machine
nb_execution_show_tb = True
nb_merge_streams = True
nb_ipywidgets_js: dict[str, dict[str, str]] = {}
nb_code_prompt_show = "Show the {type}"
nb_code_prompt_hide = "Hide the {type}"
nb_mime_priority_overrides = [
    ("revealjs", "text/html", 30),
    ("revealjs", "image/svg+xml", 40),
    ("revealjs", "image/png", 50),
    ("revealjs", "text/markdown", 80),
    ("revealjs", "text/plain", 100),
]

# Why this theme: see instructors/write_a_lecture.md.
html_theme = "pydata_sphinx_theme"
html_theme_options = {
    "logo": {"text": project},
    "navbar_center": [],
    "navbar_end": ["theme-switcher"],
    "article_header_start": [],
    "article_header_end": ["slides_link"],
    "secondary_sidebar_items": ["page-toc"],
    "show_toc_level": 2,
    "search_bar_text": "Search the book",
    "footer_start": [],
    "footer_end": [],
}
html_context = {"default_mode": "auto"}  # light or dark, as the reader's system is
html_sidebars = {"**": ["all_pages"]}
html_title = project
html_theme_path = ["_theme"]
html_static_path = ["_static"]
html_css_files = ["course.css", "book.css"]
html_js_files = ["folds.js"]
html_copy_source = False
html_use_index = True

revealjs_html_theme = "deck"
revealjs_style_theme = "deck.css"
revealjs_static_path = ["_static"]
revealjs_css_files = ["pygments.css", "course.css"]
revealjs_script_conf = {
    "width": 1280,
    "height": 720,
    "margin": 0,
    "center": False,
    "hash": True,
    "transition": "none",
    "slideNumber": "c/t",
    "controls": False,
}
