"""A page that follows a run: newer weights and the curve of the loss, while the training goes on."""

from threading import Thread

import numpy as np
import pytest
import trimesh

from mitex.cli.view import View
from mitex.exemplar import Exemplar
from mitex.methods import nca
from mitex.methods.nca import NcaTexture
from mitex.page.server import PageServer
from tests.methods.nca.tiny import SETTINGS


@pytest.mark.slow
@pytest.mark.usefixtures("quick_settling")
def test_a_page_follows_a_training(browser, tmp_path):
    exemplar = Exemplar({"albedo": Exemplar.load("lava").maps["albedo"]}, "lava")
    run, mesh = tmp_path / "run", tmp_path / "ball.ply"
    trimesh.creation.icosphere(2).export(mesh)
    nca.fit(exemplar, run, set=[*SETTINGS, "steps=2", "checkpoint_every=1"])
    (run / "texture.safetensors").unlink()  # as of a run that is not at its end
    content, news = View(source=str(run), mesh=str(mesh)).content()
    with PageServer(lambda: content().html(), news) as server:
        thread = Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        tab = browser.open(server.url, 64, steps="auto")
        assert tab.run("return page.device instanceof GPUDevice")  # the faster one where a processor draws
        names = tab.run("return [page.surface.mesh.name, ...page.data.meshes.map(({ name }) => name)]")
        assert names == ["ball", "ball", "icosphere32"]
        assert tab.page.locator(".chart p").inner_text().startswith("step 2, ")
        tab.run("await page.step(5)")
        before = tab.array("page.looks[0].weight1").copy(), tab.picture()
        nca.fit(exemplar, run, set=["steps=4"], resume=True)
        tab.run("while (page.data.loss.length < 4) await new Promise((done) => setTimeout(done, 20))")
        server.shutdown()
        thread.join()
    weights = NcaTexture.load(run).look.rule.fc1.weight.detach().numpy().ravel()
    assert np.array_equal(tab.array("page.looks[0].weight1"), weights) and (weights != before[0]).any()
    assert tab.page.locator(".chart p").inner_text().startswith("step 4, ")
    assert tab.page.locator(".chart polyline").count() == 1
    assert tab.run("return page.automaton.steps") == 5  # the states go on, in the new look
    assert (tab.picture() != before[1]).any() and tab.errors == []
