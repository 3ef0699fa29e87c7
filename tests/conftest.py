"""What all tests share: Hypothesis draws the same examples in every run, and takes the time it needs."""

import os

from hypothesis import HealthCheck, settings

settings.register_profile(
    "parakin",
    deadline=None,
    derandomize=True,
    max_examples=int(os.environ.get("PARAKIN_EXAMPLES", "8")),
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.function_scoped_fixture],
)
settings.load_profile("parakin")

os.environ.pop("COLUMNS", None)  # processes of pytest-xdist have 80, and what is written to files is not cut to lines
