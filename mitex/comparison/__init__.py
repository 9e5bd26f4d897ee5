"""Comparing methods: the same exemplars on the same meshes by each of them, measured alike, as one report.

    from mitex.comparison import compare, comparison_plan

    plan = comparison_plan(["lava"], ["vase"], ["image_quilting", "surface"], seeds=3)
    report = compare(plan, "out/compare")

The fits are jobs of `mitex.batch`: what is done stays done, and the same call goes on.
"""

from typing import TYPE_CHECKING

from mitex.lazy import attributes

__all__ = ["KINDS", "Kind", "Measure", "Result", "Summary", "compare", "comparison_plan"]

__getattr__ = attributes(
    __name__,
    {
        "KINDS": "mitex.comparison.kinds",
        "Kind": "mitex.comparison.kinds",
        "Measure": "mitex.comparison.measures",
        "Result": "mitex.comparison.results",
        "Summary": "mitex.comparison.summary",
        "compare": "mitex.comparison.run",
        "comparison_plan": "mitex.comparison.plan",
    },
)

if TYPE_CHECKING:
    from mitex.comparison.kinds import KINDS, Kind
    from mitex.comparison.measures import Measure
    from mitex.comparison.plan import comparison_plan
    from mitex.comparison.results import Result
    from mitex.comparison.run import compare
    from mitex.comparison.summary import Summary
