"""`mitex demo` goes on where it was stopped."""

from pathlib import Path

import pytest

from mitex.exemplar import Exemplar
from mitex.methods import nca
from mitex.methods.nca import PRESETS
from mitex.methods.nca.demo import EXEMPLAR, PARENT, SETTINGS, demo
from mitex.methods.nca.fitting import _parent
from mitex.training import resolve
from mitex.training.locate import CHECKPOINT, PREVIOUS


class Stopped(Exception):
    """At the training."""


@pytest.mark.parametrize("left", [None, CHECKPOINT, PREVIOUS])
def test_a_run_in_the_folder_is_continued(tmp_path, monkeypatch, left):
    """Also below `~`, and when the process was killed between the two renames of a checkpoint."""
    monkeypatch.setenv("HOME", str(tmp_path))
    run = tmp_path / "demo" / "run"
    run.mkdir(parents=True)
    if left:
        (run / left).touch()
    options = {}

    def fit(exemplar, out, **keywords):
        options.update(keywords, out=out)
        raise Stopped

    monkeypatch.setattr(nca, "fit", fit)
    with pytest.raises(Stopped):
        demo(Path("~/demo"), seed=0, steps=1)
    assert options["out"] == run
    assert options["resume"] == bool(left) and (options["init"] is None) == bool(left)


def test_its_parent_fits_its_settings():
    """So that a training can start from the bundled model, with all maps of the exemplar."""
    exemplar = Exemplar.load(EXEMPLAR)
    config = resolve(PRESETS, overrides=SETTINGS)
    look, about = _parent(PARENT, config, sorted(exemplar.maps))
    assert about["name"] == PARENT and look.maps == tuple(sorted(exemplar.maps))
