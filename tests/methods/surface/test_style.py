"""Style transfer: the structure of a content in the colours of an exemplar."""

import numpy as np
import pytest

from mitex.errors import ConfigError
from mitex.exemplar import Exemplar
from mitex.images import write_image
from mitex.mesh import embedded
from mitex.methods import surface
from mitex.methods.surface.content import content_colours
from mitex.methods.surface.domain import SurfaceDomain
from tests.methods.surface.grids import flat_square
from tests.methods.surface.small import SMALL

pytestmark = pytest.mark.usefixtures("own_cache", "known_exemplars")


class TestStyleTransfer:
    STYLE = [*SMALL, "steps=20"]

    def test_ambient_occlusion_keeps_its_structure(self, exemplar, tmp_path):
        """The result still follows the content, in the exemplar's colours."""
        mesh = embedded("mushrooms")
        image = Exemplar({"albedo": exemplar.maps["albedo"]})
        texture = surface.fit(image, mesh, tmp_path / "run", content="ao", set=self.STYLE)
        content = content_colours("ao", texture.domain)
        assert content.std() > 0.05 and content.min() >= 0 and content.max() <= 1
        assert np.corrcoef(content.mean(1), texture.values.mean(1))[0, 1] > 0.3
        assert np.abs(texture.values - content).mean() > 0.02

    def test_without_style_nothing_changes(self, mesh, exemplar, tmp_path):
        """All weight on the content: its texture is the optimum from the start."""
        image = Exemplar({"albedo": exemplar.maps["albedo"]})
        overrides = [*self.STYLE, "content_weight=1e12", "lr=0.001", "steps=2"]
        texture = surface.fit(image, mesh, tmp_path / "run", content="ao", set=overrides)
        assert np.abs(texture.values - content_colours("ao", texture.domain)).max() < 0.02

    def test_images_are_read_on_the_meshs_own_uvs(self, tmp_path):
        """A ramp in u and v; every texel gets its own uv as colour."""
        square = flat_square(4)
        u, v = np.meshgrid((np.arange(256) + 0.5) / 256, 1 - (np.arange(256) + 0.5) / 256)
        write_image(tmp_path / "ramp.png", np.stack([u, v, 0 * u], -1))
        domain = SurfaceDomain(square, 32)
        colours = content_colours(tmp_path / "ramp.png", domain)
        assert np.abs(colours[:, :2] - domain.texels.position[:, :2]).max() < 0.01 and not colours[:, 2].any()

    def test_an_image_needs_uvs(self, mesh, exemplar, tmp_path):
        image = Exemplar({"albedo": exemplar.maps["albedo"]})
        with pytest.raises(ConfigError, match="no UVs"):
            surface.fit(image, mesh, tmp_path / "run", content="a.png", set=self.STYLE)

    def test_one_image_is_transferred(self, mesh, exemplar, tmp_path):
        with pytest.raises(ConfigError, match="one image"):
            surface.fit(exemplar, mesh, tmp_path / "run", content="ao", set=self.STYLE)
        assert not (tmp_path / "run").exists()
