"""Where torch meets Dr.Jit: torch tensors go in and come out, with their gradients."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, cast

import numpy as np
import torch
from torch.autograd.function import once_differentiable

from mitex.errors import ConfigError
from mitex.integrators.feature import FeatureIntegrator
from mitex.runtime import raise_causes
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import tensor_with_room, upload
from mitex.scenes.stage import Visibility, background_values
from mitex.sparse import transposed_product
from mitex.suggestions import suggestion
from mitex.textures.field import Field
from mitex.textures.variant import on_llvm, require_variant


def lookup(
    field: torch.Tensor, visibility: Visibility, background: Sequence[float] | float = 0.0
) -> torch.Tensor:
    """Images of a per-vertex field: each pixel interpolates the vertices of the triangle that it sees.

    The visibility is constant; the gradient to `field` is exact (the transposed weights). Second
    derivatives are an error.

    Args:
        field: (V, C) float32, attached or not.
        visibility: what the cameras see, from `Stage.visibility`, on the device of `field`.
        background: value of pixels that see nothing, one number or C of them.

    Returns:
        (K, H, W, C) float32, in the units of the field (sRGB stays sRGB).

    Raises:
        ConfigError: if the field is not a (V, C) float32 tensor for the visibility's mesh and device.
    """
    _check_field(field, visibility)
    values = background_values(background, field.shape[1])
    image = _Lookup.apply(field, visibility).view(*visibility.shape, field.shape[1])
    if any(values):
        image = image + (1 - visibility.coverage)[..., None] * image.new_tensor(values)
    return image


def render(
    scene: mi.Scene,
    values: torch.Tensor | Mapping[str, torch.Tensor],
    sensor: mi.Sensor | int = 0,
    integrator: mi.Integrator | None = None,
    spp: int = 0,
    seed: int = 0,
) -> torch.Tensor:
    """An image of a scene, attached to the parameters that are given as tensors.

    The general way, for any sensor and any scene: by the `feature` integrator, without light, or by one of
    Mitsuba's that traces it, best one that computes gradients by replaying its paths (`prb`). For a field on
    one mesh without light, `lookup` is several times faster. The scene keeps the values, detached.

    Args:
        scene: an `mi.Scene`.
        values: float32 CPU tensors by parameter name as in `mi.traverse(scene)` (the integrator's own are
            called `integrator.*` there, also when it is passed here), or one tensor, the `data` of the field,
            if the `feature` integrator images exactly one of Mitex.
        sensor: index of a sensor of the scene, or an `mi.Sensor`; `batch` sensors put their views side by
            side.
        integrator: if not the scene's.
        spp: samples per pixel, a square number for `feature`; 0 for the scene's own setting.
        seed: of the paths; another one, another noise. `feature` has none.

    Returns:
        (H, W, C) float32; linear radiance where light is traced. Gradients to every tensor are exact for
        `feature`, and estimates without bias, from as many other paths, where light is traced. They are those
        of the image, whatever parameters of the scene have been set since, its cameras' among them. There
        are none to geometry and cameras, and no second derivatives (torch says so).

    Raises:
        ConfigError: for an unknown parameter, one of the wrong size, and a tensor that is not float32 on the
            CPU.
    """
    renderer: Any = integrator or scene.integrator()
    by_feature = hasattr(renderer, "fields")
    if isinstance(values, torch.Tensor):
        if not by_feature:
            raise ConfigError(
                "one tensor for a scene whose light is traced", "give tensors by parameter name"
            )
        targets, tensors = [_only_field(scene, renderer)], [values]
    else:
        table = _parameters(scene, renderer)
        targets, tensors = [_parameter(table, name) for name in values], list(values.values())
    for target, tensor in zip(targets, tensors, strict=True):
        target.check(tensor)

    if not by_feature:
        image = _Image(scene, _parts(scene, sensor, renderer), targets, sensor, renderer, spp, seed)
        return cast(torch.Tensor, _Traced.apply(image, *tensors))

    def attached(*arrays: mi.TensorXf) -> mi.TensorXf:
        try:
            for target, array in zip(targets, arrays, strict=True):
                target.assign(array)
            return renderer.render(scene, sensor, spp=spp)
        finally:
            # What stays in the scene must not keep this image's graph alive.
            for target, array in zip(targets, arrays, strict=True):
                target.assign(dr.detach(array))

    return call(attached, *tensors)


def call(function: Callable[..., Any], *tensors: torch.Tensor) -> Any:
    """The result of a pure Dr.Jit function of tensors, attached to those that need a gradient.

    Args:
        function: of `mi.TensorXf` (float32) or other Dr.Jit tensors, one for each of `tensors`; returns such
            a tensor or a tuple of them.
        tensors: on the CPU.

    Returns:
        The same as torch tensors; no second derivatives.

    Raises:
        ConfigError: the variant is no llvm one: Dr.Jit takes a tensor on the CPU for one of LLVM's arrays.
        Exception: what the function raises, also inside Dr.Jit's custom operations and loops.
    """
    require_variant("torch's gradients through Dr.Jit", on_llvm(), "an llvm one")
    # Dr.Jit does not convert an nn.Parameter, a view of it is a plain tensor with the same gradient.
    views = (tensor_with_room(tensor) for tensor in tensors)
    with raise_causes():
        return dr.wrap(source="torch", target="drjit")(function)(*views)


@dataclass(frozen=True)
class _Target:
    """One parameter of a scene, by its key in `mi.SceneParameters`."""

    params: mi.SceneParameters
    key: str
    name: str

    def check(self, tensor: Any) -> None:
        """Refuses a tensor that cannot become this parameter's value."""
        current = self.params[self.key]
        if self.params.flags(self.key) & mi.ParamFlags.NonDifferentiable or not dr.is_float_v(current):
            raise ConfigError(
                f"'{self.name}' is not a differentiable parameter", "set it through mi.traverse(scene)"
            )
        if not isinstance(tensor, torch.Tensor):
            raise ConfigError(f"'{self.name}' is a {type(tensor).__name__}", "give a torch tensor")
        if tensor.dtype != torch.float32 or tensor.device.type != "cpu":
            raise ConfigError(
                f"'{self.name}' is a tensor of {tensor.dtype} on {tensor.device}",
                "convert it with .float().cpu()",
            )
        shape = dr.shape(current) if dr.is_tensor_v(current) else (dr.width(dr.ravel(current)),)
        if tuple(tensor.shape) != tuple(shape):
            raise ConfigError(
                f"'{self.name}' has shape {tuple(tensor.shape)}", f"give a tensor of shape {shape}"
            )

    def assign(self, array: mi.TensorXf) -> None:
        """Sets the parameter from an `mi.TensorXf`."""
        array_type: Any = type(self.params[self.key])
        if dr.depth_v(array_type) > 1:
            array = dr.unravel(array_type, array.array)
        elif not dr.is_tensor_v(array_type):
            array = array_type(array.array)
        self.params[self.key] = array
        self.params.update()


@dataclass(frozen=True)
class _Image:
    """What is rendered: parameters of a scene whose light is traced, and how.

    Attributes:
        parts: all parameters of the scene, and of a sensor and an integrator that are not its own.
        targets: the parameters that are given as tensors.
    """

    scene: mi.Scene
    parts: Sequence[mi.SceneParameters]
    targets: Sequence[_Target]
    sensor: mi.Sensor | int
    integrator: mi.Integrator
    spp: int
    seed: int

    def assign(self, tensors: Sequence[torch.Tensor], attached: bool = False) -> list[mi.TensorXf]:
        """Sets the parameters, and returns what their gradients are collected in."""
        arrays = [upload(mi.TensorXf, tensor.detach().numpy()) for tensor in tensors]
        for target, array in zip(self.targets, arrays, strict=True):
            if attached:
                dr.enable_grad(array)
            target.assign(array)
        return arrays

    def state(self) -> list[dict[str, Any]]:
        """The values of all parameters as they are, for each of the parts."""
        return [{key: _copy(part[key]) for key in part.keys()} for part in self.parts]  # noqa: SIM118

    def restore(self, state: Sequence[Mapping[str, Any]]) -> None:
        """Sets those parameters that have other values now."""
        for part, values in zip(self.parts, state, strict=True):
            for key, value in values.items():
                if not _same(part[key], value):
                    part[key] = _copy(value)
            part.update()


class _Traced(torch.autograd.Function):
    """An image of traced light. Its integrator computes gradients itself, when they are asked for.

    Dr.Jit's graph of an image would refer to the scene as it is then, and not as it was.
    """

    @staticmethod
    def forward(ctx: Any, image: _Image, *tensors: torch.Tensor) -> torch.Tensor:
        ctx.image = image
        ctx.save_for_backward(*tensors)
        image.assign(tensors)
        ctx.state = image.state()
        with dr.suspend_grad(), raise_causes():
            traced = image.integrator.render(image.scene, image.sensor, seed=image.seed, spp=image.spp)
            return torch.from_numpy(np.array(traced))

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, grad: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        image: _Image = ctx.image
        other = mi.sample_tea_32(image.seed, 1)[0]
        now = image.state()
        try:
            with raise_causes():
                image.restore(ctx.state)
                arrays = image.assign(ctx.saved_tensors, attached=True)
                upstream = upload(mi.TensorXf, grad.contiguous().numpy())
                image.integrator.render_backward(
                    image.scene, image.parts[0], upstream, image.sensor, seed=other, spp=image.spp
                )
                gradients = [torch.from_numpy(np.array(dr.grad(array))) for array in arrays]
        finally:
            image.restore(now)
        return (None, *gradients)


def _parts(scene: mi.Scene, sensor: mi.Sensor | int, integrator: mi.Integrator) -> list[mi.SceneParameters]:
    """Parameters of the scene, first, and of the sensor and the integrator if they are no part of it."""
    others = [] if isinstance(sensor, int) else [sensor]
    if scene.integrator() is not integrator:
        others.append(integrator)
    return [mi.traverse(part) for part in (scene, *others)]


def _copy(value: Any) -> Any:
    """A parameter's value, detached, that stays when the parameter gets another one."""
    return dr.detach(type(value)(value))


def _same(a: Any, b: Any) -> bool:
    """Whether two values of a parameter are one variable of Dr.Jit's, or equal numbers; costs nothing."""
    if hasattr(a, "matrix"):
        return _same(a.matrix, b.matrix)
    if dr.is_tensor_v(a):
        return dr.shape(a) == dr.shape(b) and a.array.index == b.array.index
    if dr.is_jit_v(a) and dr.depth_v(a) == 1:
        return a.index == b.index
    if dr.is_array_v(a):
        return all(_same(x, y) for x, y in zip(a, b, strict=True))
    return a == b


def _parameters(scene: mi.Scene, integrator: mi.Integrator) -> dict[str, _Target]:
    """Parameters of the scene, and of the integrator if it is another than the scene's."""
    params = mi.traverse(scene)
    table = {name: _Target(params, name, name) for name in params.keys()}  # noqa: SIM118
    if scene.integrator() is not integrator:
        params = mi.traverse(integrator)
        table |= {f"integrator.{key}": _Target(params, key, f"integrator.{key}") for key in params.keys()}  # noqa: SIM118
    return table


def _parameter(table: Mapping[str, _Target], name: str) -> _Target:
    if name not in table:
        remedy = suggestion(name, table, "print(mi.traverse(scene)) lists all")
        raise ConfigError(f"the scene has no parameter '{name}'", remedy)
    return table[name]


def _only_field(scene: mi.Scene, integrator: FeatureIntegrator) -> _Target:
    textures: list[mi.Texture] = [texture for _, texture in integrator.fields(scene)]
    fields = {id(texture): texture for texture in textures if isinstance(texture, Field)}
    if len(fields) != 1:
        raise ConfigError(
            f"the integrator images {len(fields)} fields, not one",
            "give tensors by parameter name, see mi.traverse(scene)",
        )
    return _Target(mi.traverse(next(iter(fields.values()))), "data", "field")


class _Lookup(torch.autograd.Function):
    """pixels = matrix @ field, and its transpose."""

    @staticmethod
    def forward(ctx: Any, field: torch.Tensor, visibility: Visibility) -> torch.Tensor:
        ctx.visibility = visibility
        return visibility.matrix @ field.contiguous()

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, grad: torch.Tensor) -> tuple[torch.Tensor, None]:
        return _transposed_product(ctx.visibility, grad), None


def _transposed_product(visibility: Visibility, grad: torch.Tensor) -> torch.Tensor:
    """matrix.T @ grad."""
    if grad.device.type != "cpu":
        rows, columns, weight = visibility.pixel, visibility.vertex_index, visibility.weight
        out = grad.new_zeros(visibility.vertices, grad.shape[1])
        for corner in range(3):
            out.index_add_(0, columns[:, corner], weight[:, corner, None] * grad[rows])
        return out
    v = visibility
    return transposed_product(v.indptr, v.indices, v.weights, v.vertices, grad)


def _check_field(field: torch.Tensor, visibility: Visibility) -> None:
    if field.ndim != 2 or field.shape[0] != visibility.vertices:
        raise ConfigError(
            f"a field of shape {tuple(field.shape)} does not fit a mesh of {visibility.vertices} vertices",
            "give a tensor of shape (V, C)",
        )
    if field.dtype != torch.float32:
        raise ConfigError(f"a field of {field.dtype}", "convert it with field.float()")
    if field.device != visibility.weights.device:
        raise ConfigError(
            f"the field is on {field.device}, the visibility on {visibility.weights.device}",
            "move one of them with .to(device)",
        )
