"""Settings for all tests.

Hypothesis draws the same examples in every run, so that a failure can be repeated. A longer, random
search: `pytest --hypothesis-profile=search`.
"""

from hypothesis import HealthCheck, settings

settings.register_profile(
    "default", deadline=None, derandomize=True, suppress_health_check=[HealthCheck.filter_too_much]
)
settings.register_profile(
    "search", settings.get_profile("default"), derandomize=False, max_examples=3000
)
settings.load_profile("default")
