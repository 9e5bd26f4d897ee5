"""A texture that is fitted in the light of a scene: a vase on a floor, beside a ball, under a lamp and a sky.

Each step traces paths to one of a few cameras, compares what the picture shows of the vase with an exemplar,
and changes the texels by gradients that went through the light. The loss is one of

- transport: relaxed optimal transport of features (MeshNCA, equation 4),
- gram: Gram matrices of features (Gatys et al. 2015),
- motion: starts from the exemplar laid over the UVs, and fits a picture of the texture a moment later, turned
  about the vase (MeshNCA, equation 13).

Run it as

    python scenes/lit_texture.py [OUT.png] [LOSS]

and look at lit.png: the exemplar, and the scene before and after, in a minute or two.
"""

import argparse
import sys
from collections.abc import Callable

import mitex.plugins  # noqa: F401  # isort: skip  (before Mitsuba: it finds the LLVM that Dr.Jit needs)
import mitsuba as mi
import numpy as np
import torch

from mitex import bridge
from mitex.colour import linear_to_srgb
from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.features.flow import flow_network
from mitex.geometry.tangents import split_at_seams
from mitex.images import resize, write_image
from mitex.losses import gram_loss, gram_matrix, motion_loss, relaxed_transport
from mitex.mesh import Mesh, embedded
from mitex.mesh.fields import vector_field
from mitex.methods.layout import with_layout
from mitex.runtime.upload import upload
from mitex.scenes import mesh_shape
from mitex.texels import Texels

mi.set_variant("llvm_ad_rgb")

TEXTURE = "vase.bsdf.base_color.data"
LAYERS = ("relu1_1", "relu2_1", "relu3_1", "relu4_1")
LOSSES = ("transport", "gram", "motion")
VIEWS = 4
PIXELS = 1.0  # that the texture shall move

Loss = Callable[[torch.Tensor, int], torch.Tensor]  # of an sRGB picture (S, S, 3) of a view


def load_scene(vase: Mesh, resolution: int, side: int) -> mi.Scene:
    """The vase with a grey texture, lit; `prb` traces paths, and replays them for gradients."""
    assert vase.uv is not None
    texels = Texels.rasterize(vase, vase.uv, resolution)
    charts = texels.image(texels.chart[texels.face][:, None], -1)[..., 0]
    texture = {
        "type": "texel_field",
        "data": upload(mi.TensorXf, np.full((resolution, resolution, 3), 0.5, np.float32)),
        "charts": upload(mi.TensorXf, charts.astype(np.float32)),
    }
    shape = mesh_shape(
        vase,
        {"type": "principled", "base_color": texture, "roughness": 0.6},
        smooth=True,
        split=split_at_seams(vase, vase.uv),
    )
    shape.add_attribute("vertex_motion", 3, np.zeros(3 * shape.vertex_count()).tolist())
    transform = mi.ScalarTransform4f
    lamp = transform().look_at([-2.5, 3, 2.5], [0, 0, 0], [0, 1, 0])
    floor = transform().translate([0, -1, 0]).rotate([1, 0, 0], -90).scale(20)
    scene = {
        "type": "scene",
        "integrator": {"type": "prb", "max_depth": 4},
        "vase": shape,
        "ball": {
            "type": "sphere",
            "center": [0.9, -0.7, 0.5],
            "radius": 0.3,
            "bsdf": {"type": "roughconductor", "alpha": 0.1, "material": "Au"},
        },
        "floor": {
            "type": "rectangle",
            "to_world": floor,
            "bsdf": {"type": "diffuse", "reflectance": 0.4},
        },
        "lamp": {
            "type": "rectangle",
            "to_world": lamp @ transform().scale(1.0),
            "emitter": {"type": "area", "radiance": 20.0},
        },
        "sky": {"type": "constant", "radiance": 0.6},
    }
    film = {"type": "hdrfilm", "width": side, "height": side, "rfilter": {"type": "box"}}
    for view in range(VIEWS):
        turn = 2 * np.pi * view / VIEWS + 0.6
        eye = [2.6 * np.sin(turn), 0.5, 2.6 * np.cos(turn)]
        place = transform().look_at(eye, [0, -0.1, 0], [0, 1, 0])
        scene[f"view{view}"] = {"type": "perspective", "fov": 45, "to_world": place, "film": film}
    return mi.load_dict(scene)


def srgb(radiance: torch.Tensor) -> torch.Tensor:
    return linear_to_srgb(radiance.clamp(1e-4, 1))


def features_inside(picture: torch.Tensor, mask: torch.Tensor, network: Vgg16) -> dict[str, torch.Tensor]:
    """Layer -> (1, n, C) vectors of a picture (S, S, 3) where the mask (S, S) is 1 all around."""
    vectors = {}
    for layer, values in network.features(picture[None], LAYERS).items():
        inside = (
            torch.nn.functional.adaptive_avg_pool2d(mask[None], (values.shape[1], values.shape[2]))[0] > 0.99
        )
        vectors[layer] = values[0][inside][None]
    return vectors


def look_loss(name: str, exemplar: Exemplar, masks: list[torch.Tensor]) -> Loss:
    """How far what is seen of the vase is from the exemplar."""
    network = Vgg16()
    albedo = torch.from_numpy(exemplar.resized(len(masks[0])).maps["albedo"])
    target = features_inside(albedo, torch.ones_like(masks[0]), network)
    grams = {layer: gram_matrix(vectors[0]) for layer, vectors in target.items()}

    def loss(picture: torch.Tensor, view: int) -> torch.Tensor:
        vectors = features_inside(picture, masks[view], network)
        if name == "gram":
            return gram_loss(vectors, grams)
        costs = [relaxed_transport(vectors[k], target[k], euclidean=False).sum() for k in LAYERS]
        return torch.stack(costs).sum()

    return loss


def turning_loss(scene: mi.Scene, vase: Mesh, start: list[torch.Tensor], masks: list[torch.Tensor]) -> Loss:
    """How far the motion since the first pictures is from a turn about the vase's axis."""
    field = vector_field(vase, "about-y")
    assert vase.uv is not None
    split = split_at_seams(vase, vase.uv)
    params = mi.traverse(scene)
    params["vase.vertex_motion"] = upload(mi.Float, np.asarray(field, np.float32)[split.source].ravel())
    params.update()
    integrator = mi.load_dict({"type": "motion", "antialias": 1})
    pictures = [mi.render(scene, sensor=view, integrator=integrator) for view in range(VIEWS)]
    motions = [torch.from_numpy(np.array(picture)) for picture in pictures]
    network = flow_network()

    def loss(picture: torch.Tensor, view: int) -> torch.Tensor:
        wanted = motions[view][..., :2].movedim(2, 0)[None]
        wanted = PIXELS * wanted / wanted.norm(dim=1)[0][masks[view] > 0].mean()
        flow = network(torch.stack([start[view].mean(2), picture.mean(2)])[None])
        return motion_loss(flow, wanted, masks[view][None] > 0, steps=1, period=1, gamma=0.2).total

    return loss


def main(
    out: str = "lit.png",
    name: str = "transport",
    steps: int = 80,
    side: int = 160,
    resolution: int = 256,
    spp: int = 16,
) -> list[float]:
    """Fits the texture, writes exemplar, start and result side by side, and returns the loss of each step."""
    if name not in LOSSES:
        raise SystemExit(f"error: there is no loss '{name}'; name one of {', '.join(LOSSES)}")
    torch.manual_seed(0)
    exemplar = Exemplar.load("scales" if name == "motion" else "lava")
    vase = with_layout(embedded("vase").normalised()[0], resolution)
    scene = load_scene(vase, resolution, side)
    feature = mi.load_dict({"type": "feature", "name": "base_color", "antialias": 1})
    masks = [
        torch.from_numpy(np.array(mi.render(scene, sensor=k, integrator=feature)))[..., 0].gt(0).float()
        for k in range(VIEWS)
    ]
    if name == "motion":
        row = resize(exemplar.maps["albedo"], resolution // 2, resolution // 2)
        start = torch.from_numpy(np.tile(row, (2, 2, 1)))
    else:
        start = 0.5 + 0.05 * torch.randn(resolution, resolution, 3)
    values = torch.logit(start.clamp(0.02, 0.98)).requires_grad_()

    def picture(view: int, seed: int, samples: int = spp) -> torch.Tensor:
        return srgb(bridge.render(scene, {TEXTURE: values.sigmoid()}, view, spp=samples, seed=seed))

    with torch.no_grad():
        before = [picture(view, 0, 8 * spp) for view in range(VIEWS)]
    loss = turning_loss(scene, vase, before, masks) if name == "motion" else look_loss(name, exemplar, masks)
    optimizer = torch.optim.Adam([values], lr=0.05 if name == "motion" else 0.15)
    losses = []
    for step in range(steps):
        optimizer.zero_grad()
        value = loss(picture(step % VIEWS, step + 1), step % VIEWS)
        value.backward()
        optimizer.step()
        losses.append(value.item())
        print(f"step {step + 1}/{steps}, loss {losses[-1]:.4g}", file=sys.stderr)
    with torch.no_grad():
        after = picture(0, 0, 8 * spp)
    shown = torch.from_numpy(exemplar.resized(side).maps["albedo"])
    write_image(out, torch.hstack([shown, before[0], after]).numpy())
    print(out)
    return losses


if __name__ == "__main__":
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("out", nargs="?", default="lit.png", metavar="OUT.png")
    parser.add_argument("loss", nargs="?", default="transport", choices=LOSSES)
    options = parser.parse_args()
    main(options.out, options.loss)
