"""Sphinx configuration. The build reads only this repository: no intersphinx inventories, no remote fonts."""

import sys
from importlib import metadata
from pathlib import Path

sys.path.append(str(Path(__file__).parent / "_ext"))

project = "robthermal"
author = "The robthermal authors"
copyright = f"2026, {author}"
try:
    release = metadata.version("robthermal")
except metadata.PackageNotFoundError:  # built straight from a checkout
    release = "not installed"

extensions = [
    "sphinx.ext.autodoc",
    "mathml",
    "corners",
    "sphinx.ext.viewcode",
    "numpydoc",
    "myst_nb",
]
html_math_renderer = "mathml"
exclude_patterns = ["_build", "**.ipynb_checkpoints"]

myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
# The site shows what the notebooks print and draw. They are stored without outputs and run again only if they changed;
# the tests, which run every notebook themselves, build the site with one of them (`-t tests`, tests/test_docs.py).
nb_execution_mode = "cache"
nb_execution_cache_path = str(Path(__file__).parents[1] / "build" / "notebooks")
nb_execution_timeout = 120  # a cell may take this long [s]
nb_execution_raise_on_error = True
nb_output_stderr = "warn"  # a tutorial that prints a warning stops the build
nb_merge_streams = True  # what a cell prints is one block
if tags.has("tests"):  # noqa: F821  (defined by Sphinx)
    notebooks = (Path(__file__).parent / "tutorials").glob("*.ipynb")
    nb_execution_excludepatterns = [f"*/{one.name}" for one in notebooks if one.stem != "gallery"]
    del notebooks

autodoc_member_order = "groupwise"
autodoc_typehints = "none"  # numpydoc already states each type, and its unit
numpydoc_show_class_members = False  # autodoc lists them; tests/test_project.py checks the docstrings

html_theme = "pydata_sphinx_theme"
html_title = "robthermal"
html_show_sourcelink = False
templates_path = ["_templates"]
html_static_path = ["_static"]
html_css_files = ["robthermal.css"]
html_theme_options = {
    "navbar_end": ["theme-switcher"],
    "show_prev_next": False,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}
