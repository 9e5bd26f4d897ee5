"""How Sphinx turns README, CONTRIBUTING and the pages of `docs/` into a site; `make docs` calls it.

The source folder is the repository itself, so that a link between two files leads to the same place on the
site as in the checkout. A new page needs no entry anywhere: `navigation` finds it.
"""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent))

import mitex

project = "Mitex"
author = "the Mitex authors"
version = release = mitex.__version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.napoleon",
    "sphinx_copybutton",
    "navigation",
    "links",
    "lazy_names",
    "plugin_reference",
    "living",
]
root_doc = "README"
include_patterns = ["README.md", "CONTRIBUTING.md", "CHANGELOG.md", "docs/**"]
exclude_patterns = [".*", "out", "runs", "dist", "build", "mitex", "tests", "docs/site"]

# Pages: links to headings by their text, as on code hosts.
myst_heading_anchors = 4
default_role = "py:obj"  # `name` in a docstring is a link where the name is one of the reference, else code

# The reference is read from the docstrings; nothing is rendered or trained for it.
autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_default_options = {"members": True}
autodoc_preserve_defaults = True
napoleon_numpy_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True

# Notebooks are executed here, once for each of their versions.
nb_execution_mode = "cache"
nb_execution_in_temp = True
nb_execution_raise_on_error = True
nb_execution_timeout = 240
nb_merge_streams = True

html_theme = "furo"
html_title = "Mitex"
html_extra_path = ["index.html"]  # the start page is README.html
html_static_path = ["static"]
html_css_files = ["narrow.css"]
html_copy_source = False
html_show_sphinx = False
html_show_copyright = False
