"""Which processor torch works on."""

from mitex.errors import ConfigError


def available_device(name: str) -> str:
    """The name, of a device that torch can use: "cpu", or "cuda" for the first CUDA graphics card.

    Raises:
        ConfigError: There is no such device here.
    """
    import torch

    if name == "cuda" and not torch.cuda.is_available():
        raise ConfigError("torch finds no CUDA graphics card here", "leave out the device, or set it to cpu")
    return name
