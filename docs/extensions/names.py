"""Names of the package in text become links to its reference.

In docstrings `Muscle` or `Plugin.attached` does where the reference knows it, and is code where it
does not. On pages `em.Muscle` and `em.Muscle(...)` always do: a name that the package does not have
is a warning of the build.
"""

import re
from importlib.util import find_spec

from docutils import nodes
from sphinx import addnodes
from sphinx.transforms import SphinxTransform
from sphinx.util.nodes import make_refnode

PACKAGE = "exudyn_muscles"
ROOMS = ("", ".analysis", ".opensim", ".operators", ".plot", ".studies", ".view")


def setup(app):
    app.add_role("known", known)
    app.add_transform(NamesOnPages)
    app.connect("missing-reference", resolved)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def pending(text, name, context, must_exist):
    node = addnodes.pending_xref(
        "", reftype="known", refdomain="", reftarget=name, refwarn=must_exist, refcontext=context
    )
    node += nodes.literal(text, text)
    return node


def known(name, rawtext, text, lineno, inliner, options=None, content=None):
    """The role of what stands between single backticks in docstrings."""
    context = inliner.document.settings.env.ref_context
    around = ".".join(filter(None, [context.get("py:module"), context.get("py:class")]))
    return [pending(text, text.split("(")[0], around, False)], []


class NamesOnPages(SphinxTransform):
    """`em.Muscle` in the text of a page."""

    default_priority = 500

    def apply(self):
        for node in list(self.document.findall(nodes.literal)):
            name = re.match(r"(?:em|exudyn_muscles)\.([A-Za-z_][\w.]*\w)", node.astext())
            if name and not isinstance(node.parent, (nodes.reference, addnodes.pending_xref)):
                node.replace_self(pending(node.astext(), name[1], "", True))


def resolved(app, env, node, contnode):
    """A link to what the reference has under the name."""
    if node["reftype"] != "known":
        return None
    name, around = node["reftarget"], node["refcontext"]
    objects = env.get_domain("py").objects
    places = [around, around.rpartition(".")[0], *(PACKAGE + room for room in ROOMS)]
    for full in (f"{place}.{name}" for place in places if place):
        if full in objects:
            found = objects[full]
            return make_refnode(
                app.builder, node["refdoc"], found.docname, found.node_id, contnode, full
            )
    known_otherwise = not node["refwarn"] or find_spec(f"{PACKAGE}.{name}")  # code, or a module
    return contnode if known_otherwise else None
