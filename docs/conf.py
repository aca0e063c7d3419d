"""Settings of the documentation's site: `sphinx-build -W -n --keep-going -j 2 docs out/site`."""

import os
import shutil
import sys
from importlib.metadata import version as installed
from pathlib import Path

import numpydoc.xref

import exudyn_muscles

BACKEND_OF_NOTEBOOKS = "module://matplotlib_inline.backend_inline"
HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "extensions"))
# Notebooks and examples take package and models beside this folder, and open no windows.
os.environ["PYTHONPATH"] = os.pathsep.join(
    filter(None, [str(HERE.parent), os.environ.get("PYTHONPATH")])
)
os.environ |= {"MPLBACKEND": BACKEND_OF_NOTEBOOKS, "EXUDYN_NO_USER_SETTINGS": "1"}
os.environ.pop("EXUDYN_SUPPRESS_UI_WINDOW_OPEN", None)  # Exudyn would say so on every page
shutil.rmtree(HERE / "tutorials" / "out", ignore_errors=True)  # what the last build's wrote there

project = "exudyn_muscles"
author = copyright = "the exudyn_muscles developers"
release = installed("exudyn_muscles")

extensions = [
    "myst_nb",
    "numpydoc",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx_copybutton",
    "sphinx_design",
    # this project's own, in extensions/
    "inherited",
    "mathematics",
    "names",
    "examples_gallery",
]
exclude_patterns = ["extensions", "tutorials/out"]
nitpicky = True
default_role = "known"  # names.py: a link where the reference knows the name

myst_enable_extensions = ["amsmath", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

# Tutorials are run by every build, each in a kernel of its own, and stop it where they fail.
nb_execution_mode = "force"
nb_execution_raise_on_error = True
nb_execution_timeout = 300
nb_execution_show_tb = True
nb_output_stderr = "remove"  # what the first use on a machine says of its compilation
nb_merge_streams = True

copybutton_prompt_text, copybutton_prompt_is_regexp = r">>> |\.\.\. ", True

autodoc_member_order = "bysource"
autodoc_typehints = "none"  # types and shapes stand in the docstrings
autodoc_preserve_defaults = True
autosummary_generate = False
numpydoc_show_class_members = False
# Types of parameters are links where they are names of the package, and text else.
numpydoc.xref.DEFAULT_LINKS.clear()  # into Python's and NumPy's manuals, which are not at hand
numpydoc_xref_param_type = True
numpydoc_xref_ignore = "all"
numpydoc_xref_aliases = {name: f"exudyn_muscles.{name}" for name in exudyn_muscles.__all__}

html_math_renderer = "pictures"
html_theme = "furo"
html_title = "exudyn_muscles"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_copy_source = False
html_show_sphinx = False
html_theme_options = {"sidebar_hide_name": False}

# Addresses that the check of links (`sphinx-build -b linkcheck`, by hand) need not ask.
linkcheck_ignore = [r"http://localhost.*"]
