"""The run folder."""

import shutil
import tomllib
from unittest.mock import Mock

import pytest

from mitex.errors import CheckpointError, OutputError
from mitex.training import checkpoint, run, train

from .task import SmallConfig, SmallTask


def _files(folder):
    return sorted(path.name for path in folder.iterdir())


def test_a_new_folder_is_made_and_kept_once_a_step_is_done(tmp_path):
    out = tmp_path / "a" / "b"
    with run.opened(out, resume=False) as (folder, metrics):
        run.prepare(folder, SmallConfig(), {"method": "small"})
        metrics.write({"step": 1})
    assert folder == out
    assert _files(out) == ["config.toml", "metrics.jsonl"]
    run.check(out)  # it never reached a checkpoint, so nothing is lost by starting again


@pytest.mark.parametrize("existing", [".", "a", "a/b"])
def test_nothing_stays_of_a_run_that_fails_before_its_first_step(tmp_path, existing):
    (tmp_path / existing).mkdir(parents=True, exist_ok=True)
    before = sorted(tmp_path.rglob("*"))
    with pytest.raises(RuntimeError), run.opened(tmp_path / "a" / "b", resume=False) as (folder, _):
        run.prepare(folder, SmallConfig(), {})
        raise RuntimeError
    assert sorted(tmp_path.rglob("*")) == before


def test_nothing_stays_where_metrics_cannot_be_opened(tmp_path, monkeypatch):
    monkeypatch.setattr(run, "Metrics", Mock(side_effect=OutputError("full", "free space")))
    with pytest.raises(OutputError), run.opened(tmp_path / "a" / "b", resume=False):
        pass
    assert not _files(tmp_path)


def test_a_damaged_checkpoint_leaves_the_folder_as_it_was(tmp_path):
    (tmp_path / checkpoint.NAME).write_bytes(b"damaged")
    with pytest.raises(CheckpointError), run.opened(tmp_path, resume=True) as (folder, _):
        checkpoint.load(folder)
    assert _files(tmp_path) == [checkpoint.NAME]


def test_config_toml_holds_config_task_and_versions(tmp_path):
    run.prepare(tmp_path, SmallConfig(seed=8), {"method": "small"})
    content = tomllib.loads((tmp_path / "config.toml").read_text())
    assert content["seed"] == 8
    assert content["layers"] == ["relu1_1"]
    assert content["run"] == {"method": "small"}
    assert content["versions"].keys() == {"mitex", "torch", "mitsuba", "drjit"}
    assert content["versions"]["torch"].startswith("2.")


def test_leftovers_of_a_killed_run_are_swept(tmp_path):
    (tmp_path / "previews").mkdir()
    for name in (
        ".checkpoint.0a1b2c3d.tmp.safetensors",
        ".tmpA1b2C3",  # as safetensors names its own
        "previews/.000001.0a1b2c3d.tmp.png",
        "diverged.json",
    ):
        (tmp_path / name).touch()
    foreign = [".notes.tmp", ".notes.tmp.txt", ".tmp", ".tmpfile.txt", "notes.0a1b2c3d.tmp.txt"]
    for name in ("previews/000001.png", "previews/.x.tmp.png", *foreign):
        (tmp_path / name).touch()
    (tmp_path / ".folder.0a1b2c3d.tmp").mkdir()
    run.prepare(tmp_path, SmallConfig(), {})
    assert _files(tmp_path) == sorted(["config.toml", ".folder.0a1b2c3d.tmp", "previews", *foreign])
    assert _files(tmp_path / "previews") == [".x.tmp.png", "000001.png"]


@pytest.mark.parametrize(
    "config", [None, "", "learning_rate = 0.1\n", 'run = "seven"\n', "[run\n", b"\xff\xfe\0", "[versions]\n"]
)
def test_metrics_of_another_program_are_left_alone(tmp_path, config):
    """`metrics.jsonl` is a common name; what makes a run ours is the table `run` in its config.toml."""
    contents = {"metrics.jsonl": b'{"epoch": 1}\n', "thesis.tex": b"years of work", ".x.tmp": b"a draft"}
    if config is not None:
        contents["config.toml"] = config if isinstance(config, bytes) else config.encode()
    for name, content in contents.items():
        (tmp_path / name).write_bytes(content)
    with pytest.raises(OutputError, match="holds other files"), run.opened(tmp_path, resume=False):
        pass
    assert {name: (tmp_path / name).read_bytes() for name in _files(tmp_path)} == contents


def test_a_run_that_died_before_its_first_checkpoint_may_start_again(tmp_path):
    """Whatever the moment: `opened` makes metrics.jsonl first, `prepare` config.toml, then come the steps."""
    (tmp_path / "metrics.jsonl").touch()
    run.check(tmp_path)
    (tmp_path / ".config.0a1b2c3d.tmp.toml").write_text("step")
    run.check(tmp_path)
    run.prepare(tmp_path, SmallConfig(), {"method": "small"})
    (tmp_path / "metrics.jsonl").write_text('{"step": 1}\n')
    (tmp_path / "previews").mkdir()
    run.check(tmp_path)


@pytest.mark.parametrize("name", ["checkpoint.safetensors", "checkpoint.previous.safetensors"])
def test_a_run_is_not_overwritten(tmp_path, name):
    (tmp_path / name).touch()
    with pytest.raises(OutputError, match="holds a run already; add `resume=True`"):
        run.check(tmp_path)
    run.check(tmp_path, resume=True)


def test_a_finished_result_is_not_overwritten(tmp_path):
    """Methods that train in one go leave no checkpoint, only their result."""
    run.prepare(tmp_path, SmallConfig(), {"method": "small"})
    run.check(tmp_path)
    (tmp_path / "texture.safetensors").write_bytes(b"hours of work")
    with pytest.raises(OutputError, match="holds a finished run; name another `out`"):
        run.check(tmp_path)
    with pytest.raises(CheckpointError, match="no checkpoint"):
        run.check(tmp_path, resume=True)


def test_other_files_are_left_alone(tmp_path):
    (tmp_path / "thesis.tex").touch()
    with pytest.raises(OutputError, match="holds other files; name a new or empty folder"):
        run.check(tmp_path)
    assert _files(tmp_path) == ["thesis.tex"]


@pytest.mark.parametrize("name", [".", "missing"])
def test_nothing_to_resume(tmp_path, name):
    with pytest.raises(CheckpointError, match="no checkpoint in .* to resume; leave out `resume`"):
        run.check(tmp_path / name, resume=True)
    assert not _files(tmp_path)


def test_impossible_folders(tmp_path):
    (tmp_path / "file").touch()
    for out in (tmp_path / "file", tmp_path / "file" / "below", "a\0b", tmp_path / ("x" * 300)):
        with pytest.raises(OutputError), run.opened(out, resume=False):
            pass
    assert _files(tmp_path) == ["file"]


def test_a_second_run_leaves_the_first_alone(tmp_path):
    with run.opened(tmp_path / "run", resume=False) as (folder, metrics):
        run.prepare(folder, SmallConfig(), {})
        with pytest.raises(OutputError, match="another process"), run.opened(folder, resume=False):
            pass
        metrics.write({"step": 1})
        assert _files(folder) == ["config.toml", "metrics.jsonl"]


def test_a_folder_that_is_removed_during_the_run_does_not_come_back(tmp_path):
    class Watched(SmallTask):
        def begin(self, step, generator):
            if step == 2:
                shutil.rmtree(tmp_path / "run")
            return super().begin(step, generator)

    with pytest.raises(OutputError, match="was removed"):
        train(Watched(), SmallConfig(steps=4, checkpoint_every=1), tmp_path / "run", lr=0.1)
    assert not _files(tmp_path)
