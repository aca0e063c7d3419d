"""Parameters that a class takes over from its bases stand in its reference as well."""

import inspect

from numpydoc.docscrape import NumpyDocString


def setup(app):
    # Before numpydoc, which renders the sections.
    app.connect("autodoc-process-docstring", completed, priority=400)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def inherited_parameters(kind):
    """Parameters of a class's signature that its bases describe and it does not itself."""
    own = described(kind)
    missing = [name for name in inspect.signature(kind).parameters if name not in own]
    found = []
    for base in kind.__mro__[1:-1]:
        for name, parameter in described(base).items():
            if name in missing and parameter not in found:
                found.append(parameter)
                missing = [other for other in missing if other not in names(parameter)]
    return found


def described(kind):
    """Name -> Parameter of what the class's own docstring describes."""
    doc = NumpyDocString(inspect.cleandoc(vars(kind).get("__doc__") or ""))
    parameters = doc["Parameters"] + doc["Attributes"]
    return {name: parameter for parameter in parameters for name in names(parameter)}


def names(parameter):
    return [name.strip().lstrip("*") for name in parameter.name.split(",")]


def completed(app, what, name, obj, options, lines):
    if what != "class" or not (more := inherited_parameters(obj)):
        return
    doc = NumpyDocString("\n".join(lines))
    doc["Parameters"] = doc["Parameters"] + more
    lines[:] = str(doc).splitlines()
