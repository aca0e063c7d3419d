"""Muscle laws by their sources, and a law of the user's own."""

from .de_groote_fregly_2016 import DeGrooteFregly2016, DeGrooteFregly2016Published
from .law import MuscleLaw
from .meyer_fregly_2016 import MeyerFregly2016
from .millard_2012 import Millard2012
from .schutte_1993 import Schutte1993
from .spline_law import SplineLaw
from .thelen_2003 import Thelen2003
from .thelen_2003_deprecated import Thelen2003Deprecated

# The built-in laws by name, as the command line and the tests of every law have them.
LAWS: dict[str, type[MuscleLaw]] = {
    law.__name__: law
    for law in (
        DeGrooteFregly2016, DeGrooteFregly2016Published, Thelen2003, Thelen2003Deprecated,
        Millard2012, Schutte1993, MeyerFregly2016, SplineLaw,
    )
}  # fmt: skip
