"""Trainings of colours and offsets from words, and the textures that they leave."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.spatial import KDTree

from mitex.asset import Asset
from mitex.errors import CheckpointError, ConfigError, WeightsError
from mitex.losses import Augmentation
from mitex.mesh import icosphere
from mitex.methods.baselines import text2mesh, x_mesh
from mitex.methods.neural_style.cameras import cameras_of
from mitex.methods.neural_style.styled_mesh import StyledMesh
from mitex.methods.registry import load
from mitex.runtime import threads
from mitex.training import train
from tests.methods.nca.text.tiny_text import MeanColour
from tests.methods.neural_style.tiny import BALL, KINDS, SMALL, maker, shaken, tiny
from tests.training.contract import (
    FAULTS,
    assert_loss_is_pure,
    assert_same_checkpoint,
    assert_third_step_leaves_no_trace,
)

FITS = {"text2mesh": text2mesh.fit_text, "x_mesh": x_mesh.fit}
WORDS = SMALL | {"text_prompt": "{text}"}
names = pytest.mark.parametrize("name", KINDS)


@names
class TestTask:
    def test_the_contract(self, name):
        threads(1)
        assert_loss_is_pure(tiny(name), 1)

    @pytest.mark.parametrize("fault", FAULTS)
    def test_a_skipped_step_leaves_no_trace(self, name, fault):
        threads(1)
        assert_third_step_leaves_no_trace(maker(name), replace(KINDS[name][0], steps=4), fault)

    def test_options_matter(self, name):
        def value(**options) -> float:
            task = shaken(tiny(name, **options))
            return float(task.loss(0, torch.Generator().manual_seed(5)).value.detach())

        plain = value()
        gates = ({"gate_width": 7}, {"rank": 3}, {"gate_start": 1.0}, {"mirror": True})
        own = gates if name == "x_mesh" else ()
        for options in (
            *({"sigma": 2.0}, {"frequencies": 5}, {"width": 9}, {"seed": 1}, {"cameras": "anchored"}),
            *({"views": 3}, {"view": 40}, {"fov": 40.0}, {"distance": 3.0}, {"text": "green"}),
            *({"text_vertices": 300}, {"text_relief": 0.02}, {"text_crops": 3}, {"text_crop_area": 0.3}),
            *({"text_tilt": 0.3}, {"text_whole_weight": 2.0}, {"text_close_weight": 0.0}),
            *({"text_background": 0.5}, {"text_each": True}),
            *({"text_relief_weight": 1.0}, {"text_relief_crop_area": 0.5}, *own),
        ):
            assert value(**options) != plain, options

    def test_the_prompt_speaks_of_the_object(self, name):
        prompt = "{object} of {text}"
        assert tiny(name, text_prompt=prompt).prompt == f"an {BALL.name} of red"
        assert tiny(name, text_prompt=prompt, text_object="cup").prompt == "a cup of red"

    def test_offsets_stay_within_their_bound(self, name):
        task = shaken(tiny(name), 1e3)
        colours, offsets = task.style()
        lengths = offsets.norm(dim=1)
        assert lengths.max() <= 0.1 + 1e-6 and lengths.max() > 0.09
        assert colours.min() >= 0 and colours.max() <= 1
        assert torch.equal(shaken(tiny(name, text_relief=0.0)).style()[1].abs().max(), torch.tensor(0.0))
        along = torch.linalg.cross(offsets, task.normals).norm(dim=1).max()
        assert (along < 1e-6) == (name == "text2mesh")

    def test_the_start_is_grey_and_nothing_is_moved(self, name):
        colours, offsets = tiny(name).style()
        assert torch.equal(colours, torch.full_like(colours, 0.5)) and not offsets.any()


@pytest.mark.parametrize("each", [False, True])
def test_the_loss_by_hand(each):
    """Each term from the pictures one by one, with the squares that the generator draws."""
    task = shaken(tiny("text2mesh", text_whole_weight=3.0, text_each=each, text_relief_crop_area=0.4))
    step, generator = task.loss(0, torch.Generator().manual_seed(2)), torch.Generator().manual_seed(2)
    cameras = cameras_of(task.config, generator)
    whole = Augmentation.draw(generator, 2, tilt=0.0)
    close = Augmentation.draw(generator, 2, 2, 0.15, 0.0)
    grey = Augmentation.draw(generator, 2, 2, 0.4, 0.0)
    colours, offsets = task.style()
    coloured, plain = task.figure.pictures(cameras, task.points + offsets, colours)

    def distance(pictures, augmentation) -> float:
        squares = augmentation(pictures, 16)
        rows = [task.model.encode_images(one[None])[0] for one in squares]
        if not each:  # the n-th squares of the two views have one embedding
            count = len(rows) // 2
            rows = [rows[n] + rows[count + n] for n in range(count)]
        cosines = [row @ task.text[0] / row.norm() / task.text[0].norm() for row in rows]
        return 1 - torch.stack(cosines).mean().item()

    terms = {"whole": 3 * distance(coloured, whole), "close": distance(coloured, close)}
    terms["relief"] = 0.5 * distance(plain, grey)
    assert step.metrics == pytest.approx(terms, abs=1e-5)
    assert step.value.item() == pytest.approx(sum(terms.values()), abs=1e-5)


@names
def test_a_colour_is_learned(name):
    for text, channel in (("red", 0), ("green", 1)):
        task = tiny(name, text=text, steps=25, text_relief_weight=0.0)
        train(task, task.config, None, lr=task.config.lr)
        change = (task.style()[0].mean(0) - 0.5).tolist()
        assert change[channel] > 0.05 + max(change[k] for k in range(3) if k != channel), (text, change)


@names
def test_the_exported_mesh_is_the_one_that_was_trained(name, tmp_path, monkeypatch):
    """Through run folder and GLB, in the units of the given mesh, wherever that is."""
    mesh = icosphere(2)
    mesh = mesh.with_vertices(3 * mesh.vertices + np.array([5, 0, -2], np.float32))
    tasks = []
    trained = "mitex.methods.neural_style.fitting.text_image_model"
    monkeypatch.setattr(trained, lambda clip: MeanColour())
    initial = KINDS[name][1].initial

    def kept(task, generator):
        tasks.append(task)
        return initial(task, generator)

    monkeypatch.setattr(KINDS[name][1], "initial", kept)
    FITS[name]("red", mesh, tmp_path / "run", clip="words", set=WORDS | {"lr": 0.05}, steps=4)
    task = tasks[0]
    colours, offsets = task.style()
    expected = 3 * (task.points + offsets).detach().numpy() + np.array([5, 0, -2])
    texture = load(tmp_path / "run")
    assert isinstance(texture, StyledMesh)
    assert texture.about["text"] == "red" and texture.about["mesh"] == mesh.name
    assert texture.image.shape == (32, 32, 3)
    asset = texture.apply(mesh)
    assert isinstance(asset, Asset)
    np.testing.assert_allclose(asset.mesh.vertices, expected, atol=1e-4)
    assert np.abs(expected - task.fine.vertices).max() > 0.01 and len(expected) == 162
    again = Asset.load(asset.export(tmp_path / "ball.glb")).mesh
    for one, other in ((again.vertices, expected), (expected, again.vertices)):  # the file splits seams
        assert KDTree(one).query(other)[0].max() < 1e-4
    albedo = texture.image[task.baked().std(2) > 0].mean(0)
    np.testing.assert_allclose(albedo, colours.detach().mean(0), atol=0.03)
    with pytest.raises(ConfigError, match="belongs to mesh"):
        texture.apply(icosphere(3))


@names
def test_resuming_changes_nothing(name, tmp_path):
    threads(1)
    FITS[name]("red", BALL, tmp_path / "whole", clip="words", set=WORDS, steps=4)
    FITS[name]("red", BALL, tmp_path / "part", clip="words", set=WORDS, steps=2)
    FITS[name]("red", BALL, tmp_path / "part", steps=4, resume=True)
    assert_same_checkpoint(tmp_path / "whole", tmp_path / "part")
    for text, mesh, problem in (("green", BALL, "exemplar"), ("red", icosphere(3), "mesh")):
        with pytest.raises((CheckpointError, ConfigError), match=problem):
            FITS[name](text, mesh, tmp_path / "part", steps=6, resume=True)


@names
class TestRefused:
    @pytest.mark.parametrize(
        ("text", "clip", "error", "problem"),
        [
            ("crimson frobs", "words", ConfigError, "does not know the word 'frobs'"),
            (" ", "words", ConfigError, "the text is empty"),
            ("red", "no/such/folder", WeightsError, "no/such/folder"),
        ],
    )
    def test_words_and_models(self, name, text, clip, error, problem, tmp_path):
        with pytest.raises(error, match=problem):
            FITS[name](text, BALL, tmp_path / "run", clip=clip, set={"text_prompt": "{text}"})
        assert not (tmp_path / "run").exists()

    def test_a_prompt_without_the_text(self, name):
        with pytest.raises(ConfigError, match="leaves out the text"):
            tiny(name, text_prompt="a stone")

    def test_a_loss_of_nothing(self, name):
        with pytest.raises(ConfigError, match="are all 0; let one count"):
            tiny(name, text_whole_weight=0.0, text_close_weight=0.0, text_relief_weight=0.0)
