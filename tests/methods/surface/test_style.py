"""Style transfer: the structure of a content in the colours of an exemplar."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from mitex.errors import ConfigError, ImageError
from mitex.exemplar import Exemplar
from mitex.images import write_image
from mitex.mesh import torus
from mitex.methods import surface
from mitex.methods.baselines import multi_view_gram
from mitex.methods.surface.content import content_colours, content_picture
from mitex.methods.surface.domain import SurfaceDomain
from tests.methods.surface.grids import flat_square
from tests.methods.surface.small import SMALL

pytestmark = pytest.mark.usefixtures("own_cache", "known_exemplars")


class TestStyleTransfer:
    STYLE = [*SMALL, "steps=20"]

    def test_ambient_occlusion_keeps_its_structure(self, exemplar, tmp_path):
        """The result still follows the content, in the exemplar's colours."""
        mesh = torus(32, 16)
        image = Exemplar({"albedo": exemplar.maps["albedo"]})
        texture = surface.fit(image, mesh, tmp_path / "run", content="ao", set=self.STYLE)
        content = content_colours(None, texture.domain)
        assert content.std() > 0.05 and content.min() >= 0 and content.max() <= 1
        assert np.corrcoef(content.mean(1), texture.values.mean(1))[0, 1] > 0.35
        assert np.abs(texture.values - content).mean() > 0.02

    def test_without_style_nothing_changes(self, mesh, exemplar, tmp_path):
        """All weight on the content: its texture is the optimum from the start."""
        image = Exemplar({"albedo": exemplar.maps["albedo"]})
        overrides = [*self.STYLE, "content_weight=1e12", "lr=0.001", "steps=2"]
        texture = surface.fit(image, mesh, tmp_path / "run", content="ao", set=overrides)
        assert np.abs(texture.values - content_colours(None, texture.domain)).max() < 0.02

    def test_images_are_read_on_the_meshs_own_uvs(self, tmp_path):
        """A ramp in u and v; every texel gets its own uv as colour."""
        square = flat_square(4)
        u, v = np.meshgrid((np.arange(256) + 0.5) / 256, 1 - (np.arange(256) + 0.5) / 256)
        write_image(tmp_path / "ramp.png", np.stack([u, v, 0 * u], -1))
        domain = SurfaceDomain(square, 32)
        colours = content_colours(content_picture(tmp_path / "ramp.png"), domain)
        assert np.abs(colours[:, :2] - domain.texels.position[:, :2]).max() < 0.01 and not colours[:, 2].any()

    def test_an_image_needs_uvs(self, mesh, exemplar, tmp_path):
        """What is said is about the content, not about `keep_uvs`, which nobody gave."""
        square, picture = flat_square(4), write_image(tmp_path / "a.png", np.ones((4, 4, 3)))
        assert square.uv is not None
        folded = replace(square, uv=np.concatenate([square.uv[:16], square.uv[:16]]))
        fit = partial(surface.fit, Exemplar({"albedo": exemplar.maps["albedo"]}), set=self.STYLE)
        for method in (fit, partial(multi_view_gram.fit, exemplar)):
            for given, problem in ((mesh, "has no UVs for the content picture"), (folded, "overlap")):
                with pytest.raises(ConfigError, match=f"{problem}.*; give a mesh with usable UVs") as error:
                    method(given, content=picture)
                assert ("`content=ao`" in str(error.value)) == (method is fit)
            with pytest.raises(ImageError, match="does not exist"):
                method(mesh, content=tmp_path / "no.png")

    def test_one_image_is_transferred(self, mesh, exemplar, tmp_path):
        with pytest.raises(ConfigError, match="one image"):
            surface.fit(exemplar, mesh, tmp_path / "run", content="ao", set=self.STYLE)
        assert not (tmp_path / "run").exists()
