"""Mathematics as pictures within the page, drawn by ziamath: no network, no script and no font is
needed to see them, and they have the color of the text.
"""

from html import escape

import ziamath
from docutils import nodes

SIZE = 16  # pixels, of the letters


def setup(app):
    ziamath.config.svg2 = False  # without glyphs that formulas share, which had to have one size
    ziamath.config.math.color = "currentColor"
    app.add_html_math_renderer("pictures", (inline, None), (block, None))
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def drawn(node, **options):
    """The picture of a formula, read out as its TeX, and how far below the line it goes."""
    text = " ".join(node.astext().split())
    formula = ziamath.Latex(text, size=SIZE, **options)
    picture = formula.svg().replace("<svg ", f'<svg role="img" aria-label="{escape(text)}" ', 1)
    return picture, formula.getyofst()


def inline(translator, node):
    picture, below = drawn(node, inline=True)
    translator.body.append(
        f'<span class="formula" style="vertical-align: {below}px">{picture}</span>'
    )
    raise nodes.SkipNode


def block(translator, node):
    picture, _ = drawn(node)
    translator.body.append(f'<div class="equation">{picture}</div>\n')
    raise nodes.SkipNode
