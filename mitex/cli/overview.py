"""The texts of `mitex --help` and of the help of commands that depend on a method."""

from __future__ import annotations

from dataclasses import fields

from mitex.cli.commands import OF_MODELS, lines
from mitex.lazy import load
from mitex.methods.registry import methods

OVERVIEW = """usage: mitex COMMAND [OPTIONS]

Texture synthesis on meshes.

commands:
{commands}

examples:
  mitex doctor
  mitex demo --out demo
  mitex {fit} --help
  mitex apply runs/pebbles --mesh bunny.obj --out bunny.glb
  mitex render bunny.glb --out bunny.png

`mitex COMMAND --help` tells more, and `mitex --version` which version this is."""


def overview() -> str:
    """The text of `mitex --help`."""
    commands = lines()
    return OVERVIEW.format(commands=_listed(commands), fit=next(name for name in commands if " " in name))


def group_help(group: str) -> str:
    """The text of `mitex GROUP --help`, for commands of two words."""
    usage = f"mitex {group} METHOD"
    return f"usage: {usage} [OPTIONS]\n\n{_listed(lines(group))}\n\n`{usage} --help` tells more."


def model_help(word: str) -> str:
    """The text of `mitex WORD --help`, for a command whose options depend on the model."""
    options = {}
    for method in methods().values():
        if reference := getattr(method, word):
            names = [f.name.replace("_", "-") for f in fields(load(reference)) if f.name != "model"]
            options[method.name] = " ".join(f"--{name}" for name in names)
    title = OF_MODELS[word]
    return (
        f"usage: mitex {word} RUN|MODEL --out FILE [OPTIONS]\n\n{title[0].upper()}{title[1:]}. "
        f"The options are those of the model's method:\n\n{_listed(options)}\n\n"
        f"`mitex {word} RUN|MODEL --help` explains them; `mitex models` lists the models."
    )


def _listed(rows: dict[str, str]) -> str:
    width = max(map(len, rows))
    return "\n".join(f"  {name:{width}}  {line}" for name, line in rows.items())
