"""`mitex compare` and `mitex compare answers`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, UseAppendAction, arg

from mitex.cli.engines import JobOptions, refuse_missing
from mitex.errors import ConfigError
from mitex.methods.checks import mutually_exclusive

if TYPE_CHECKING:
    from mitex.batch import Plan


@dataclass(kw_only=True)
class Compare(JobOptions):
    """Compare methods: the same exemplars on the same meshes by each of them, measured alike, as one report.

    DIR gets report.html with pictures and tables, report.csv and report.json, and in batch/ the runs and
    assets. The same command again goes on; `mitex batch status DIR/batch` tells how far it is.

    examples:
      mitex compare --exemplar lava --mesh vase --methods surface,image_quilting --out out/compare
      mitex compare --exemplar lava rust --mesh vase --methods gatys,image_quilting --seeds 3 --out out/all
      mitex compare --exemplar lava --mesh vase --methods gatys --set gatys:steps=300 --out out/compare
    """

    exemplar: Annotated[tuple[str, ...], arg(metavar="IMAGE|DIR|NAME ...", help_behavior_hint="")] = ()
    """Images, folders of maps or captures, patterns such as "photos/*.png", or names that ship with Mitex."""

    mesh: Annotated[tuple[str, ...], arg(metavar="MESH|NAME ...", help_behavior_hint="")] = ()
    """Mesh files, patterns, or names that ship with Mitex."""

    methods: Annotated[str | None, arg(metavar="NAME,NAME,...", help_behavior_hint="")] = None
    """The methods, as of `mitex fit`."""

    seeds: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: 1, or the plan's)")] = None
    """Fits of each method with another seed; from 2 on, the spread is known."""

    plan: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None
    """A plan as of `mitex batch`; the options above then name what of it is compared: by default, all."""

    preset: Annotated[str | None, arg(metavar="NAME", help_behavior_hint="")] = None
    """A paper's comparison, by name; the options above then name what of it is compared: by default, all."""

    data: Annotated[Path | None, arg(metavar="DIR", help_behavior_hint="")] = None
    """Folder with what the comparison of --preset needs and does not ship with Mitex; by default this one."""

    set: Annotated[
        tuple[tuple[str, ...], ...],
        UseAppendAction,
        arg(metavar="METHOD:KEY=VALUE ...", help_behavior_hint="(repeatable)"),
    ] = ()
    """Any option or setting of a method's fit; with METHOD:apply.KEY=VALUE, an option of `mitex apply`."""

    study: Annotated[bool, arg(help_behavior_hint="")] = False
    """Write study.html, too: a page for a blind test of preference that others can open."""

    judge: Annotated[str | None, arg(metavar="DIR|NAME", help_behavior_hint="(default: as of `fit`)")] = None
    """CLIP folder that scores textures from words, or `words` for the small model that ships with Mitex."""

    out: Annotated[Path, arg(metavar="DIR")]
    """Folder for everything."""

    def run(self) -> None:
        self.check_jobs()
        plan = self._plan()
        from mitex.runtime import let_idle_threads_sleep

        let_idle_threads_sleep()
        from mitex.comparison.run import compare

        comparison = compare(
            plan,
            self.out,
            self.chosen_engine(),
            threads=self.threads,
            retry=self.retry,
            study=self.study,
            judge=self.judge,
        )
        for line in comparison.failures:
            print(f"failed   {line}")
        print(comparison.report)
        if self.study:
            print(comparison.folder / "study.html")
        refuse_missing(comparison.missing, comparison.total)

    def _plan(self) -> Plan:
        from mitex.comparison.narrowing import narrowed
        from mitex.comparison.plan import comparison_plan, prepared

        names = [name for name in (self.methods or "").split(",") if name.strip()]
        settings = [word for words in self.set for word in words]
        if self.data is not None and self.preset is None:
            raise ConfigError("--data means nothing without --preset", "leave it out, or name a preset")
        if self.plan is not None or self.preset is not None:
            mutually_exclusive("--plan", "--preset", self.plan is not None and self.preset is not None)
            part = narrowed(
                self._named_plan(), exemplars=self.exemplar, meshes=self.mesh, labels=names, settings=settings
            )
            return prepared(part, self.seeds)
        lists = {"--exemplar": self.exemplar, "--mesh": self.mesh, "--methods": self.methods}
        for option, values in lists.items():
            if not values:
                raise ConfigError(f"{option} is missing", "see `mitex compare --help`")
        return comparison_plan(
            self.exemplar, self.mesh, names, seeds=1 if self.seeds is None else self.seeds, settings=settings
        )

    def _named_plan(self) -> Plan:
        if self.plan is not None:
            from mitex.batch import Plan

            return Plan.read(self.plan)
        from mitex.comparison.presets import preset_plan

        return preset_plan(str(self.preset), self.data or Path())


@dataclass
class Answers:
    """Evaluate the answers to the page that `mitex compare --study` wrote: who was preferred, and by chance?

    examples:
      mitex compare answers out/compare answers/*.json
    """

    folder: Annotated[Positional[Path], arg(metavar="DIR")]
    """What was given as --out."""

    files: Annotated[Positional[tuple[Path, ...]], arg(metavar="FILE ...", help_behavior_hint="")]
    """What people saved."""

    def run(self) -> None:
        from mitex.comparison.answers import evaluate, read_answers
        from mitex.comparison.study import Study

        study = Study.load(self.folder)
        print(evaluate(study, read_answers(study, self.files)).text())
