"""What the commands that run jobs hand on of their options, for each kind of engine."""

import pytest

from mitex.batch.engines.dask_cluster import Dask
from mitex.batch.engines.local import Local
from mitex.batch.engines.slurm import Slurm
from mitex.cli import main
from tests.cli.handing_on import handed_on


class Reached(Exception):
    """Work would begin now."""


@pytest.fixture
def handed(monkeypatch, tmp_path):
    """The engine, and the other options, with which a command would run a plan."""
    (tmp_path / "plan.toml").write_text('exemplars = ["lava"]\n[methods.image_quilting]\nmeshes = ["vase"]\n')
    calls = []

    def stop(plan, folder, engine, **options):
        calls.append((engine, options))
        raise Reached

    monkeypatch.setattr("mitex.batch.run_plan", stop)
    monkeypatch.setattr("mitex.comparison.run.run_plan", stop)

    def handed(command, words):
        head = ["compare", "--plan"] if command == "compare" else ["batch"]
        with pytest.raises(Reached):
            main([*head, str(tmp_path / "plan.toml"), "--out", str(tmp_path / "out"), *words.split()])
        return calls.pop()

    return handed


@pytest.mark.parametrize("command", ["batch", "compare"])
class TestOptions:
    def test_those_of_jobs(self, handed, command):
        engine, options = handed(command, "--jobs 3 --threads 2 --retry")
        assert isinstance(engine, Local) and engine.at_once == 3
        assert options["threads"] == 2 and options["retry"] is True

    def test_by_default(self, handed, command):
        engine, options = handed(command, "")
        assert isinstance(engine, Local) and engine.at_once == 1
        assert options["threads"] is None and options["retry"] is False

    def test_dask(self, handed, command):
        engine, _ = handed(command, "--engine dask --jobs 3")
        assert isinstance(engine, Dask) and (engine._address, engine._jobs) == (None, 3)
        engine, _ = handed(command, "--engine dask --address tcp://a:1")
        assert isinstance(engine, Dask) and engine._address == "tcp://a:1"

    def test_slurm(self, handed, command):
        words = "--engine slurm --jobs 5 --threads 8 --slurm partition=cpu time=90 --slurm qos=low"
        engine, options = handed(command, words)
        assert isinstance(engine, Slurm) and (engine.at_once, engine.threads, options["threads"]) == (5, 8, 8)
        assert engine._options == {"slurm_partition": "cpu", "slurm_time": 90, "slurm_qos": "low"}


@pytest.mark.parametrize(("words", "seeds"), [("", (5, 7)), ("--seeds 3", (0, 1, 2)), ("--seeds 1", (0,))])
def test_seeds_in_place_of_the_plans(tmp_path, monkeypatch, words, seeds):
    plan = 'exemplars = ["lava"]\nseeds = [5, 7]\n[methods.image_quilting]\nmeshes = ["vase"]\n'
    (tmp_path / "plan.toml").write_text(plan)
    command = f"compare --plan {tmp_path / 'plan.toml'} --out {tmp_path / 'out'} {words}"
    (plan, *_), _ = handed_on(monkeypatch, "mitex.comparison.run.run_plan", command.split())
    assert [part.seeds for part in plan.methods] == [seeds]
