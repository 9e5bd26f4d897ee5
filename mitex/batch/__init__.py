"""Many fits as jobs: a plan of exemplars, meshes and methods, run on one machine or on many.

    from mitex.batch import Plan, run_plan

    report = run_plan(Plan.read("plan.toml"), "out/all")

Every job is the ordinary command in a process of its own. What is done stays done: the same call goes on.
"""

from typing import TYPE_CHECKING

from mitex.lazy import attributes

__all__ = ["Engine", "Event", "Job", "MethodPlan", "Plan", "Report", "Row", "Task", "run_plan", "status"]

__getattr__ = attributes(
    __name__,
    {
        "Engine": "mitex.batch.engines",
        "Event": "mitex.batch.driver",
        "Job": "mitex.batch.jobs",
        "MethodPlan": "mitex.batch.plan",
        "Plan": "mitex.batch.plan",
        "Report": "mitex.batch.report",
        "Row": "mitex.batch.report",
        "Task": "mitex.batch.task",
        "run_plan": "mitex.batch.driver",
        "status": "mitex.batch.report",
    },
)

if TYPE_CHECKING:
    from mitex.batch.driver import Event, run_plan
    from mitex.batch.engines import Engine
    from mitex.batch.jobs import Job
    from mitex.batch.plan import MethodPlan, Plan
    from mitex.batch.report import Report, Row, status
    from mitex.batch.task import Task
