"""The jobs of a plan: each one command, known by a hash of all that its result follows from."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

from mitex import __version__
from mitex.batch import options
from mitex.batch.inputs import Input, digest, find
from mitex.batch.plan import MethodPlan, Plan
from mitex.errors import ConfigError
from mitex.methods.method import Method
from mitex.methods.registry import methods
from mitex.training import values

RESULTS = "results"  # folder of what the jobs write, in the batch folder
KINDS = {"id": str, "words": tuple[str, ...], "resumed": tuple[str, ...], "result": str, "needs": str | None}
ABOUT = {"method": str, "exemplar": str, "seed": int | None, "mesh": str}
LONGEST_NAME = 40  # of a part of a job's name [characters]


@dataclass(frozen=True)
class Job:
    """One command, which is run in the batch folder.

    Attributes:
        id: a readable name, and a hash of the method, its options, its inputs' contents and Mitex's version.
        words: after `mitex`.
        resumed: the words with which an interrupted run goes on from its checkpoint; none if it cannot.
        result: file or folder that it writes, relative to the batch folder.
        needs: id of the job whose result it reads; None if it reads none.
        about: what a table says of it: method, exemplar, seed, mesh.
    """

    id: str
    words: tuple[str, ...]
    resumed: tuple[str, ...]
    result: str
    needs: str | None
    about: Mapping[str, Any]

    @property
    def name(self) -> str:
        """For people: without the hash."""
        return self.id.rpartition("-")[0]

    def record(self) -> dict[str, Any]:
        """The job as a JSON object."""
        return asdict(self)

    @staticmethod
    def of_record(record: Mapping[str, Any]) -> Job:
        """The inverse of `record`.

        Raises:
            TypeError, ValueError, KeyError: It is no record of a job.
        """
        own = {key: values.check(record[key], kind) for key, kind in KINDS.items()}
        about = dict(record["about"])
        for key in about:
            values.check(about[key], ABOUT[key])
        return Job(**{**record, **own, "about": about})


def jobs_of(plan: Plan) -> list[Job]:
    """All jobs of a plan, those before the ones that need them.

    Raises:
        ConfigError: An input does not exist or cannot be read, or the same job is there twice.
    """
    digest.cache_clear()  # files may have changed since
    jobs: dict[str, Job] = {}
    for job in (job for part in plan.methods for job in _jobs(part, plan)):
        if job.id in jobs:
            raise ConfigError(f"the plan has the job {job.name} twice", "name every input and seed once")
        jobs[job.id] = job
    return list(jobs.values())


def _jobs(part: MethodPlan, plan: Plan) -> Iterator[Job]:
    """The jobs of a method, each fit before those that apply its texture."""
    method = methods()[part.method]
    exemplars = _exemplars(plan.first(part), plan)
    meshes = find(part.meshes, plan.folder, "mesh", _mesh_names())
    for exemplar in exemplars:
        for seed in part.seeds or (None,):
            for mesh in meshes if method.fits_to_mesh else [None]:
                fit = _fit(part, method, plan, exemplar, seed, mesh)
                yield fit
                if part.output == "none":
                    continue
                targets = [mesh] if mesh else meshes if method.applies_to_meshes else [None]
                yield from (_apply(part, plan, fit, target) for target in targets)


def _fit(
    part: MethodPlan, method: Method, plan: Plan, exemplar: Input, seed: int | None, mesh: Input | None
) -> Job:
    """The job of a fit.

    Args:
        part, method, plan: what is fit.
        exemplar: of the plan, which the fit learns from, or the first one whose run it learns from.
        seed: None for that of the preset.
        mesh: which it is fit to; None for any.
    """
    first = plan.first(part)
    first_fit = None if first is part else _fit(first, methods()[first.method], plan, exemplar, seed, None)
    subject = exemplar if first_fit is None else Input(first_fit.result, None)
    seed_input = None if seed is None else Input(str(seed), None)
    inputs = [*_option(part.learns_from, subject), *_option("mesh", mesh), *_option("seed", seed_input)]
    settings = options.fit_words(method, part.fit, plan.folder)
    lasting = {key: value for key, value in part.fit.items() if key not in method.load_fit().only_at_start}
    lasting_settings = options.fit_words(method, lasting, plan.folder)
    from_text = options.is_text(method, part.learns_from)
    implicit = options.implicit_inputs(method, part.fit, plan.folder, from_text=from_text)
    about = {"method": part.label, "exemplar": exemplar.label, "seed": seed}
    about |= {"mesh": mesh.label} if mesh else {}
    words = ("fit", method.name, "--quiet")
    id = _id("fit", about, [*words, *inputs, *settings, *implicit])
    result = f"{RESULTS}/{id}"
    command = (*words, *_texts([*inputs, *settings]), "--out", result)
    resumed = (*words, *_texts([*inputs, *lasting_settings]), "--out", result, "--resume")
    needs = None if first_fit is None else first_fit.id
    return Job(id, command, resumed if method.resumes else (), result, needs, about)


def _apply(part: MethodPlan, plan: Plan, fit: Job, mesh: Input | None) -> Job:
    """The job that puts the texture of a fit on a mesh, or on the one that it was fit to."""
    values = dict(part.apply)
    method = methods()[part.method]
    if fit.about["seed"] is not None and "seed" in options.apply_kinds(method):
        values.setdefault("seed", fit.about["seed"])
    inputs = [*_option("mesh", mesh), *options.apply_words(method, values, plan.folder)]
    about = dict(fit.about) | ({"mesh": mesh.label} if mesh else {})
    id = _id("apply", about, [fit.id, part.output, *inputs])
    name = mesh.label if mesh else str(about["exemplar"])
    file = f"{_file_name(name)}/" if part.output == "maps" else f"{_file_name(name)}.{part.output}"
    result = f"{RESULTS}/{id}"
    words = ("apply", fit.result, "--quiet", *_texts(inputs), "--out", f"{result}/{file}")
    return Job(id, words, (), result, fit.id, about)


def _exemplars(part: MethodPlan, plan: Plan) -> list[Input]:
    """What a method learns from."""
    method = methods()[part.method]
    if options.is_text(method, part.learns_from):
        return [Input(text, None) for text in part.exemplars]
    if part.learns_from != method.learns_from:  # which may be names as well as files
        return [Input.of(text, plan.folder) for text in part.exemplars]
    return find(part.exemplars, plan.folder, "exemplar", options.source_names(method))


def _option(name: str, value: Input | None) -> list[Input]:
    """The words of an option; none without a value, and one word if it begins with a dash."""
    if value is None:
        return []
    option = f"--{name.replace('_', '-')}"
    if value.text.startswith("-"):
        return [Input(f"{option}={value.text}", None)]
    return [Input(option, None), value]


def _texts(inputs: Iterable[Input]) -> list[str]:
    return [each.text for each in inputs]


def _id(command: str, about: Mapping[str, Any], parts: Sequence[str | Input]) -> str:
    keys = [part.key if isinstance(part, Input) else part for part in parts]
    digest = hashlib.sha256(json.dumps([__version__, command, *keys]).encode("utf-8", "surrogateescape"))
    seed = [] if about["seed"] is None else [f"s{about['seed']}"]
    names = [about["method"], about["exemplar"], *seed, *([about["mesh"]] if "mesh" in about else [])]
    return "-".join([command, *map(_file_name, names), digest.hexdigest()[:16]])


def _file_name(name: str) -> str:
    """A name as it can stand in a file's."""
    return re.sub(r"[^\w.]+", "_", name, flags=re.ASCII).strip("._")[:LONGEST_NAME] or "x"


def _mesh_names() -> list[str]:
    from mitex.mesh.embedded import embedded_names

    return embedded_names()
