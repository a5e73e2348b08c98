"""The settings of Sphinx for the documentation; `python -m tools.site` builds it."""

import sys
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path[:0] = [str(ROOT), str(ROOT / "server")]

import pftrack  # noqa: E402 - from this tree

project = "pftrack"
author = "the pftrack authors"
copyright = author  # noqa: A001 - Sphinx asks for it by this name
release = version = pftrack.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "tools.site.inserts",
    "tools.site.contents",
    "tools.site.python_pages",
    "tools.site.formulas",
    "tools.site.offline",
]
exclude_patterns = ["maps/**"]
default_role = "code"  # docstrings write code as Markdown does
highlight_language = "none"
suppress_warnings = ["ref.python"]  # short names that several types share

myst_enable_extensions = ["dollarmath", "attrs_inline"]
myst_dmath_allow_space = False
myst_dmath_double_inline = True
myst_heading_anchors = 4

autodoc_member_order = "bysource"
autodoc_preserve_defaults = True
napoleon_numpy_docstring = False
napoleon_use_ivar = True
napoleon_use_rtype = False
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 100
add_module_names = False
toc_object_entries_show_parents = "hide"

html_theme = "furo"
html_theme_options = {
    "light_css_variables": {"color-brand-primary": "#0067a3", "color-brand-content": "#0067a3"},
    "dark_css_variables": {"color-brand-primary": "#6bb8ec", "color-brand-content": "#6bb8ec"},
}
html_title = "pftrack"
html_short_title = "pftrack"
html_static_path = ["static"]
html_css_files = ["site.css"]
html_js_files = [("back.js", {"defer": "defer"})]
html_favicon = str(ROOT / "frontend_static" / "shared" / "icon.svg")
html_domain_indices = False
html_copy_source = False
html_show_sourcelink = False
html_show_sphinx = False
html_show_copyright = False
html_extra_path = [str(ROOT / "build" / "media")]
media_folder = str(ROOT / "build" / "media")
