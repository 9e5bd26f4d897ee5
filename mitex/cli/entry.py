"""`main`: finds the command, runs it, and keeps the contract of exit codes.

0 done; 2 bad input or usage, with one line `error: what is wrong; what to do` on stderr; 130 interrupted,
with what could be saved saved; anything else that escapes is a bug and shows its traceback (exit code 1).
"""

from __future__ import annotations

import difflib
import os
import sys
import warnings
from collections.abc import Sequence
from importlib import import_module

import mitex
from mitex.cli.usage import UsageError, parse
from mitex.errors import MitexError, MitexWarning

# Words -> module and class of the command, and its line in the overview. Only the called one is imported.
COMMANDS = {
    "doctor": ("doctor:Doctor", "check that everything Mitex needs works here"),
    "demo": ("demo:Demo", "learn, apply, render and export a texture in a few minutes"),
    "fit nca": ("fit_nca:FitNca", "learn a living texture from an image or PBR maps (MeshNCA)"),
    "fit surface": ("fit_surface:FitSurface", "synthesize a texture on one mesh (tangent-space CNN)"),
    "fit geometric": ("fit_geometric:FitGeometric", "learn the relief of a mesh (face-convolution GAN)"),
    "fit nerf": ("fit_nerf:FitNerf", "capture a texture with its meso-structure from photos (NeRF-Texture)"),
    "apply": ("apply:Apply", "put a learned texture on a mesh"),
    "animate": ("animate:Animate", "film how a geometric texture grows or changes"),
    "render": ("render:Render", "path-trace an asset: a still or a turntable"),
    "models": ("models:Models", "list the textures that ship with Mitex"),
}

OVERVIEW = """usage: mitex COMMAND [OPTIONS]

Texture synthesis on meshes.

commands:
{commands}

examples:
  mitex doctor
  mitex demo --out demo
  mitex fit nca --exemplar pebbles.png --out runs/pebbles
  mitex apply runs/pebbles --mesh bunny.obj --out bunny.glb
  mitex render bunny.glb --out bunny.png

`mitex COMMAND --help` tells more."""


def main(argv: Sequence[str] | None = None) -> int:
    """Runs one command.

    Args:
        argv: Words after `mitex`; the process's own when None.

    Returns:
        The exit code: 0, 2 or 130, or what the command says (`doctor`: 1 if something is missing).
    """
    words = list(sys.argv[1:] if argv is None else argv)
    with warnings.catch_warnings():
        _route_warnings()
        try:
            code = _run(words)
            sys.stdout.flush()
            return code
        except MitexError as e:
            _say(f"error: {e}")
            return 2
        except KeyboardInterrupt as e:
            _say(str(e) or "interrupted")
            return 130
        except BrokenPipeError:  # `mitex models | head`: nobody reads on, which is no error
            os.dup2(os.open(os.devnull, os.O_WRONLY), sys.stdout.fileno())
            return 0


def _run(words: list[str]) -> int:
    if not words:
        raise UsageError("no command given", "see `mitex --help`")
    if words[0] in ("-h", "--help", "help"):
        print(overview())
        return 0
    if words[0] == "--version":
        print(f"mitex {mitex.__version__}")
        return 0
    if words[1:] and set(words[1:]) <= {"-h", "--help"} and _group(words[0]):
        print(overview(words[0]))
        return 0
    name, rest = _find(words)
    module, _, attribute = COMMANDS[name][0].partition(":")
    command = getattr(import_module(f"mitex.cli.{module}"), attribute)
    call = parse(command, rest, f"mitex {name}")
    return 0 if call is None else call.run() or 0


def _find(words: list[str]) -> tuple[str, list[str]]:
    """The command that the words start with, and the words after it."""
    for count in (2, 1):
        name = " ".join(words[:count])
        if name in COMMANDS:
            return name, words[count:]
    group = _group(words[0])
    if group and not words[1:]:
        raise UsageError(f"`mitex {words[0]}` needs a method", f"try `mitex {group[0]} --help`")
    given = " ".join(words[:2]) if group else words[0]
    close = difflib.get_close_matches(given, group or COMMANDS, 1)
    remedy = f"try `mitex {close[0]}`" if close else "see `mitex --help`"
    raise UsageError(f"there is no command '{given}'", remedy)


def _group(word: str) -> list[str]:
    """Commands of two words that begin with this one."""
    return [name for name in COMMANDS if name.startswith(f"{word} ")]


def overview(group: str = "") -> str:
    """The text of `mitex --help`, or the commands of one group."""
    shown = {name: line for name, (_, line) in COMMANDS.items() if not group or name in _group(group)}
    width = max(map(len, shown))
    commands = "\n".join(f"  {name:{width}}  {line}" for name, line in shown.items())
    if group:
        usage = f"mitex {group} METHOD"
        return f"usage: {usage} [OPTIONS]\n\n{commands}\n\n`{usage} --help` tells more."
    return OVERVIEW.format(commands=commands)


def _route_warnings() -> None:
    """Mitex's warnings become lines on stderr; those of libraries are dropped (python -W shows them)."""
    if not sys.warnoptions:
        warnings.simplefilter("ignore")
    warnings.simplefilter("always", MitexWarning)
    others = warnings.showwarning

    def show(message, category, filename, lineno, file=None, line=None):
        if issubclass(category, MitexWarning):
            _say(f"warning: {message}")
        else:
            others(message, category, filename, lineno, file, line)

    warnings.showwarning = show


def _say(text: str) -> None:
    print(" ".join(text.split()), file=sys.stderr, flush=True)
