"""What a synthesis starts from: patches of the exemplar, laid as the taps lie."""

import numpy as np
import pytest

from mitex.exemplar import Exemplar
from mitex.methods.surface.config import PRESETS
from mitex.methods.surface.domain import SurfaceDomain
from mitex.methods.surface.patches import joined_patches, patch_side
from mitex.methods.surface.scale_map import ScaleMap
from mitex.methods.surface.tile import TileDomain
from mitex.quilting.target import TileTarget
from mitex.training import resolve
from mitex.triples import map_layout
from tests.methods.surface.grids import flat_square

SIDE, PERIODS = 64, 8  # stripes along the exemplar
COLUMNS = 16  # of faces, where sizes do not vary
SETTINGS = [f"resolution={SIDE}", f"exemplar_size={SIDE}", "scales=0"]


def config(*settings: str):
    return resolve(PRESETS, None, None, [*SETTINGS, *settings])


def stripes() -> Exemplar:
    """Upright stripes, and a height that follows them."""
    wave = 0.5 + 0.4 * np.sin(2 * np.pi * PERIODS * (np.arange(SIDE) + 0.5) / SIDE)
    image = np.tile(wave.astype(np.float32)[None, :, None], (SIDE, 1, 1))
    return Exemplar({"albedo": np.tile(image, (1, 1, 3)), "height": image}, "stripes")


def frequencies(image: np.ndarray) -> tuple[int, int]:
    """Of the strongest wave in a picture (S, S), [waves along a row, along a column]."""
    spectrum = np.abs(np.fft.rfft2(image - image.mean()))
    down, along = np.unravel_index(spectrum.argmax(), spectrum.shape)
    return int(along), min(int(down), len(image) - int(down))


def image_of(domain: SurfaceDomain, settings) -> np.ndarray:
    values = joined_patches(stripes(), map_layout(["albedo", "height"]), domain, settings)
    assert values.shape == (len(domain.texels.index), 4) and values.dtype == np.float32
    np.testing.assert_allclose(values[:, 0], values[:, 3], atol=1e-6)  # maps stay together
    image = np.full(domain.resolution**2, values[:, 0].mean())
    image[domain.texels.index] = values[:, 0]
    return image.reshape(domain.resolution, domain.resolution)


@pytest.mark.parametrize(
    ("settings", "waves"),
    [((), (8, 0)), (("angle=90",), (0, 8)), (("scale=2",), (4, 0)), (("patch=0.5",), (8, 0))],
    ids=["as it is", "turned", "larger", "larger patches"],
)
def test_stripes_lie_as_the_settings_say(settings, waves):
    """On a square as wide as the exemplar at scale 1."""
    chosen = config(*settings)
    image = image_of(SurfaceDomain.of(flat_square(COLUMNS), chosen, keep=False), chosen)
    assert np.abs(np.subtract(frequencies(image), waves)).max() <= 1  # patches need not fit exactly
    assert image.std() > 0.9 * stripes().maps["albedo"].std()


def test_stripes_follow_a_field_and_a_map_of_sizes():
    mesh, chosen = flat_square(SIDE), config()
    left = np.tile(np.array([-1.0, 0.0, 0.0], np.float32), (len(mesh.vertices), 1))  # where up shall point
    along, down = frequencies(image_of(SurfaceDomain.of(mesh, chosen, left, keep=False), chosen))
    assert along <= 1 and abs(down - PERIODS) <= 1
    factors = np.where(mesh.vertices[:, 1] > mesh.vertices[:, 1].mean(), 2.0, 0.5)
    domain = SurfaceDomain.of(mesh, chosen, None, ScaleMap(factors), keep=False)
    image = image_of(domain, chosen)
    upper, lower = (frequencies(part)[0] for part in (image[: SIDE // 4], image[-SIDE // 4 :]))
    assert abs(upper - PERIODS / 2) <= 1 and abs(lower - PERIODS * 2) <= 2


def test_enlarged_patches_have_no_blocks():
    """Pixels of the exemplar are two texels wide in the upper half, and half a texel in the lower one."""
    noise = Exemplar({"albedo": np.random.default_rng(0).random((SIDE, SIDE, 3), np.float32)}, "noise")
    mesh, chosen = flat_square(SIDE), config()
    factors = np.where(mesh.vertices[:, 1] > 0.5, 2.0, 0.5)
    domain = SurfaceDomain.of(mesh, chosen, None, ScaleMap(factors), keep=False)
    values = joined_patches(noise, map_layout(["albedo"]), domain, chosen)
    upper = domain.texels.image(values)[4 : SIDE // 2 - 8]
    assert (np.diff(upper, axis=1) == 0).mean() < 0.05


class TurnedTarget(TileTarget):
    """As if the texels' right were the patches' down."""

    def around(self, texel: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        texels, place, _ = super().around(texel)
        return texels, place, np.full(len(texels), np.pi / 2)


def test_normals_are_turned_as_patches_lie(monkeypatch):
    chosen, layout = config(), map_layout(["height", "normal"])
    leaning = np.tile(np.array([0.8, 0.5, 0.9], np.float32), (SIDE, SIDE, 1))  # to the right
    exemplar = Exemplar({"height": stripes().maps["height"], "normal": leaning})
    monkeypatch.setattr(TileDomain, "target", lambda domain, patch: TurnedTarget(domain.resolution, patch))
    values = joined_patches(exemplar, layout, TileDomain.flat(chosen), chosen)
    np.testing.assert_allclose(
        values[:, list(layout["normal"])], np.tile([0.5, 0.8, 0.9], (len(values), 1)), atol=1e-6
    )
    assert np.isin(values[:, 0], exemplar.maps["height"]).mean() > 0.4  # other maps stay as they are


def test_a_tile_repeats():
    chosen = config()
    image = image_of(TileDomain.flat(chosen), chosen)
    assert np.abs(np.subtract(frequencies(image), (PERIODS, 0))).max() <= 1
    assert np.abs(image[:, 0] - image[:, -1]).mean() < 1.5 * np.abs(np.diff(image, axis=1)).mean()


def test_chance_follows_the_seed():
    rng = np.random.default_rng(0)
    noise = Exemplar({"albedo": rng.random((SIDE, SIDE, 3), np.float32)}, "noise")
    domain = SurfaceDomain.of(flat_square(COLUMNS), config(), keep=False)
    first, same, other = (
        joined_patches(noise, map_layout(["albedo"]), domain, config(f"seed={seed}")) for seed in (0, 0, 1)
    )
    assert np.array_equal(first, same) and not np.array_equal(first, other)
    # Colours are the exemplar's own, but where a seam is averaged.
    assert np.isin(first, noise.maps["albedo"]).mean() > 0.4


def test_sides_of_patches():
    assert patch_side(0.25, 256, 512) == 64
    assert patch_side(0.25, 16, 512) == 8  # at least
    assert patch_side(1.0, 250, 512) == 248  # a multiple of 8 within the exemplar
    assert patch_side(0.5, 512, 48) == 48  # within the texture
    assert patch_side(0.5, 64, 1) == 8
