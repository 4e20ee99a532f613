"""Sphinx configuration. The build reads only this repository: no intersphinx inventories, no remote fonts."""

from importlib import metadata

project = "robthermal"
author = "The robthermal authors"
copyright = f"2026, {author}"
try:
    release = metadata.version("robthermal")
except metadata.PackageNotFoundError:  # built straight from a checkout
    release = "not installed"

extensions = [
    "sphinx.ext.autodoc",
    "sphinx.ext.mathjax",
    "sphinx.ext.viewcode",
    "numpydoc",
    "myst_nb",
]
exclude_patterns = ["_build", "**.ipynb_checkpoints"]

myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
# Notebooks are executed by the tests, where a failing cell is a failing test; the site build stays quick.
nb_execution_mode = "off"

autodoc_member_order = "groupwise"
autodoc_typehints = "none"  # numpydoc already states each type, and its unit
numpydoc_show_class_members = False  # autodoc lists them; tests/test_project.py checks the docstrings

html_theme = "pydata_sphinx_theme"
html_title = "robthermal"
html_show_sourcelink = False
html_static_path = ["_static"]
html_css_files = ["robthermal.css"]
html_theme_options = {
    "navbar_end": ["theme-switcher"],
    "show_prev_next": False,
    "secondary_sidebar_items": ["page-toc"],
    "footer_start": ["copyright"],
    "footer_end": [],
}
