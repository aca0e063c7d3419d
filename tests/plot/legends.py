"""What figures say."""


def legend(axes):
    """Texts of the one legend of the figure of these axes."""
    figure = axes[0].figure
    found = [*figure.legends, *(a.get_legend() for a in figure.axes if a.get_legend())]
    assert len(found) == 1
    return [text.get_text() for text in found[0].get_texts()]
