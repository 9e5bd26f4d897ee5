"""Training the generators, level after level, as one task for the loop (Hertz et al. 2020, section 3.3)."""

from __future__ import annotations

import math
from functools import partial

import numpy as np
import torch

from mitex.cache import content_key
from mitex.mesh import Mesh
from mitex.methods.geometric.coarse_relief import Start
from mitex.methods.geometric.config import MAX_LEVELS, GeometricConfig
from mitex.methods.geometric.features import face_features
from mitex.methods.geometric.gan import adversarial_loss, critic_loss, generate
from mitex.methods.geometric.hierarchy import Hierarchy
from mitex.methods.geometric.model import grow, network
from mitex.methods.geometric.portrait import portrait
from mitex.training import Change, Step
from mitex.training.optim import Adam, gradient_norms

FEWEST_FACES = 260  # with how many fewer a step hardly takes less time, measured
QUARTERS = 4  # parts of a level with a learning rate each; the paper's 2,000 steps in intervals of 500


class GeometricTask:
    """Trains the generators that turn the template into the reference, or something like it, on each level.

    A step updates the generator of its level. The critics have optimizers of their own and take their turns
    in `begin`. Generators of lower levels stay as they are.

    Args:
        config: settings.
        hierarchy: of the template, with a level for each training mesh.
        template: (V, 3) its vertices, in units of their mean edge length.
        meshes: vertices of the training mesh of each level.
        reference: what they were fitted to; previews show it.
        source: what the training is of, see `inputs`.
        relief: coarse reliefs on the template, if the training begins with such, see `coarse_relief`.

    Attributes:
        generators, critics: a network for each possible level, so that a resumed run may go on to more.
        fixed: (V, 3) from which the reference shall come: the noise of the first level, 0 on higher ones, or
            the relief.
        started: how many levels have been trained, the one under way included.
    """

    def __init__(
        self,
        config: GeometricConfig,
        hierarchy: Hierarchy,
        template: torch.Tensor,
        meshes: list[torch.Tensor],
        reference: Mesh,
        source: dict[str, str],
        relief: Start | None = None,
    ) -> None:
        self.device = config.device
        self.config, self.hierarchy = config, hierarchy.to(self.device)
        self.template = template.to(self.device)
        self.meshes = [vertices.to(self.device) for vertices in meshes]
        self.reference, self.source = reference, source
        rng = torch.Generator().manual_seed(config.seed)
        directed = hierarchy.graphs[0].directions is not None
        levels = range(config.first_level, config.first_level + MAX_LEVELS)
        self.generators = [network(level, 3, rng, directed).to(self.device) for level in levels]
        self.critics = [network(level, 1, rng, directed).to(self.device) for level in levels]
        if relief is None:
            self.fixed = self.first_noise = self._noise(template, rng)
            self.own, self.starts = self.template, [self.template]
        else:
            self.fixed, self.first_noise = torch.tensor(relief.own).float().to(self.device), 0.0
            self.own = self.template + self.fixed
            self.starts = [torch.tensor(vertices).float().to(self.device) for vertices in relief.laid]
        self.optimizers = [Adam(critic.parameters, betas(config)) for critic in self.critics]
        with torch.no_grad():
            graphs = self.hierarchy.graphs
            self.real = [face_features(v, graph) for v, graph in zip(self.meshes, graphs, strict=True)]
        self.started = 0
        self._start: tuple[int, torch.Tensor] | None = None

    @property
    def parameters(self) -> list[torch.Tensor]:
        return [p for generator in self.generators for p in generator.parameters]

    def level(self, step: int) -> int:
        """Which level a step trains."""
        return min(step // self.config.level_steps, self.config.levels - 1)

    def cost(self, step: int) -> float:
        """Of a step: the faces of its level, and those that would take as long as the rest."""
        return FEWEST_FACES + len(self.hierarchy.graphs[self.level(step)].faces)

    def begin(self, step: int, generator: torch.Generator) -> Change | None:
        """First weights of a new level, and the critic's turns; the metrics are those of its last turn."""
        level, turns = self.level(step), self._critic_turns(step)
        new = level >= self.started
        if not new and not turns:
            return None
        undo = partial(self._restore, level, self.started, _clones(self._level_state(level)))
        if new:
            self._start_level(level)
        metrics: dict[str, float] = {}
        for _ in range(turns):
            metrics = self._train_critic(level, step, generator)
            if not math.isfinite(metrics["critic_gradient"]):
                break
        return Change(undo, metrics)

    def loss(self, step: int, generator: torch.Generator) -> Step:
        """The critic's score of a random mesh, and the distance of the reconstruction (section 3.3)."""
        level = self.level(step)
        graph = self.hierarchy.graphs[level]
        fake = self._sample(level, generator)
        adversarial = adversarial_loss(self.critics[level], fake, graph)
        noise = self.first_noise if level == 0 else 0.0
        start = self._reconstruction_start(level)
        reconstruction = generate(self.generators[level], start, graph, noise, self.config.remeasure)
        error = (reconstruction - self.meshes[level]).square().mean()
        metrics = {"level": level, "adversarial": adversarial.item(), "reconstruction": error.item()}
        return Step(adversarial + self.config.reconstruction * error, metrics)

    def state(self) -> dict[str, torch.Tensor]:
        state = {"started": torch.tensor(self.started)}
        for level in range(MAX_LEVELS):
            state |= {f"{level}/{name}": value for name, value in self._level_state(level).items()}
        return state

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        for level in range(MAX_LEVELS):
            start = f"{level}/"
            own = {k.removeprefix(start): v for k, v in state.items() if k.startswith(start)}
            self._load_level(level, own)
        self.started, self._start = int(state["started"]), None

    def _level_state(self, level: int) -> dict[str, torch.Tensor]:
        """The live tensors of a level: both networks, and the moments of the critic's optimizer."""
        networks = {"generator": self.generators[level], "critic": self.critics[level]}
        state = {
            f"{name}/{k}": p.detach() for name, net in networks.items() for k, p in enumerate(net.parameters)
        }
        return state | {f"optimizer/{k}": v for k, v in self.optimizers[level].state().items()}

    def _load_level(self, level: int, state: dict[str, torch.Tensor]) -> None:
        for name, net in (("generator", self.generators[level]), ("critic", self.critics[level])):
            net.load([state[f"{name}/{k}"] for k in range(len(net.parameters))])
        start = "optimizer/"
        moments = {k.removeprefix(start): v for k, v in state.items() if k.startswith(start)}
        self.optimizers[level].load_state(moments)

    def _restore(self, level: int, started: int, state: dict[str, torch.Tensor]) -> None:
        self._load_level(level, state)
        self.started = started

    def _start_level(self, level: int) -> None:
        """From level `carried` of the training meshes on, the first weights are those of the level before."""
        self.started = level + 1
        if level and level + self.config.first_level >= self.config.carried:
            self.generators[level].load(self.generators[level - 1].parameters)
            self.critics[level].load(self.critics[level - 1].parameters)

    def preview(self, step: int) -> np.ndarray:
        """The reference, the training mesh of the level, its reconstruction, and two random samples."""
        level = self.level(step - 1)
        faces = self.hierarchy.graphs[level].faces.cpu().numpy()
        rng = torch.Generator().manual_seed(self.config.seed)
        with torch.no_grad():
            reconstruction = self._reconstruction(level)
            samples = [self._sample(level, rng) for _ in range(2)]
        portraits = [portrait(v.cpu().numpy(), faces) for v in (self.meshes[level], reconstruction, *samples)]
        return np.hstack([portrait(self.reference.vertices, self.reference.faces), *portraits])

    def metadata(self) -> dict[str, str]:
        return {"method": "geometric"} | self.source

    def _critic_turns(self, step: int) -> int:
        """How many steps of the critic come before a step of the generator: they are spread evenly."""
        critic, own = self.config.critic_steps, self.config.generator_steps
        return (step + 1) * critic // own - step * critic // own

    def _train_critic(self, level: int, step: int, generator: torch.Generator) -> dict[str, float]:
        """One turn; the critic stays as it is when the norm of its gradient is not finite."""
        graph, optimizer = self.hierarchy.graphs[level], self.optimizers[level]
        with torch.no_grad():
            fake = face_features(self._sample(level, generator), graph)
        mix = torch.rand((), generator=generator).to(self.device)
        with torch.enable_grad():
            loss, distance = critic_loss(
                self.critics[level], self.real[level], fake, graph, mix, self.config.penalty
            )
            gradients = torch.autograd.grad(loss, self.critics[level].parameters)
        for parameter, gradient in zip(optimizer.parameters, gradients, strict=True):
            parameter.grad = gradient
        norm = gradient_norms(optimizer.parameters).norm().item()
        if math.isfinite(norm):
            optimizer.step(learning_rate(self.config, step))
        return {"critic": loss.item(), "distance": distance.item(), "critic_gradient": norm}

    def _sample(self, level: int, generator: torch.Generator) -> torch.Tensor:
        """A random mesh of a level; only its own generator has a gradient."""
        vertices = self.starts[0]
        if len(self.starts) > 1:
            vertices = self.starts[int(torch.randint(len(self.starts), (), generator=generator))]
        for k in range(level + 1):
            if k:
                vertices = self.hierarchy.finer(vertices, k - 1)
            noise = self._noise(vertices, generator)
            with torch.set_grad_enabled(k == level and torch.is_grad_enabled()):
                graph = self.hierarchy.graphs[k]
                vertices = generate(self.generators[k], vertices, graph, noise, self.config.remeasure)
        return vertices

    def _noise(self, vertices: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
        """Noise for vertices (V, 3), drawn on the CPU, so that devices agree."""
        return (self.config.noise * torch.randn(vertices.shape, generator=generator)).to(self.device)

    def _reconstruction_start(self, level: int) -> torch.Tensor:
        """Where the reconstruction of a level starts from; the lower levels are finished and stay."""
        if self._start is None or self._start[0] != level:
            start = self.own
            if level:
                with torch.no_grad():
                    below = self._reconstruction(level - 1)
                start = self.hierarchy.finer(below, level - 1)
            self._start = level, start
        return self._start[1]

    def _reconstruction(self, level: int) -> torch.Tensor:
        """The mesh of a level from `fixed`: the reference, once the generators have learned it."""
        noises = [self.first_noise, *[0.0] * level]
        generators = self.generators[: level + 1]
        *_, vertices = grow(generators, self.hierarchy, self.own, noises, self.config.remeasure)
        return vertices


def inputs(reference: Mesh, template: Mesh, field: np.ndarray | None) -> dict[str, str]:
    """The metadata of what a texture is learned from: two `normalised` meshes, and the field of the first."""
    return {
        "reference": reference.name,
        "reference_key": content_key(reference.vertices, reference.faces),
        "template_key": content_key(template.vertices, template.faces),
        "field_key": content_key(*([] if field is None else [field])),
    }


def _clones(state: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    return {name: value.clone() for name, value in state.items()}


def betas(config: GeometricConfig) -> tuple[float, float]:
    """Adam's decays of the first and the second moment."""
    return config.beta1, config.beta2


def learning_rate(config: GeometricConfig, step: int) -> float:
    """The learning rate of a step: halved after each quarter of a level, and whole again on the next."""
    quarter = step % config.level_steps * QUARTERS // config.level_steps
    return config.lr * 0.5**quarter
