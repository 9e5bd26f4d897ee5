"""Which commands there are, and which one a command line asks for; methods bring their own."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mitex.cli.usage import UsageError, refuse_unknown_options
from mitex.lazy import load
from mitex.methods.registry import method_of, methods
from mitex.suggestions import suggestion

# Word -> dataclass of the command, and its line in the overview. Only the called one is imported.
COMMANDS = {
    "doctor": ("mitex.cli.doctor:Doctor", "check that everything Mitex needs works here"),
    "demo": ("mitex.demo:Demo", "synthesize, grow, render and export textures in a few minutes"),
    "cache": ("mitex.cli.cache:Cache", "show or clear what is kept on disk to save time"),
    "models": ("mitex.cli.models:Models", "list the textures that ship with Mitex"),
    "gallery": ("mitex.cli.gallery:Gallery", "write a page in which each of them grows"),
    "view": ("mitex.cli.view:View", "look at an asset, or at a texture as it grows, in the browser"),
    "batch": ("mitex.cli.batch:Batch", "run a plan of many fits, on one machine or on many"),
    "batch status": ("mitex.cli.batch:Status", "tell how far the jobs of a plan are"),
    "compare": ("mitex.cli.compare:Compare", "compare methods on the same exemplars and meshes, as a report"),
    "compare answers": ("mitex.cli.compare:Answers", "evaluate a blind test of preference"),
    "evaluate": (
        "mitex.cli.evaluate:Evaluate",
        "measure how near a texture comes to its exemplar, or to words",
    ),
    "render": ("mitex.cli.render:Render", "path-trace an asset: a still or a turntable"),
}
# Commands whose options are those of the model's method.
OF_MODELS = {
    "apply": "put a learned texture on a mesh",
    "animate": "film how a texture grows or changes",
}
HELP = frozenset({"-h", "--help"})


@dataclass(frozen=True)
class Call:
    """A command that was asked for.

    Attributes:
        program: its words, as its help shows them.
        command: the dataclass of its options.
        words: what follows.
    """

    program: str
    command: type
    words: list[str]


def lines(group: str = "") -> dict[str, str]:
    """Commands and their lines in the overview, or those of a group of two words."""
    fits = {f"fit {method.name}": method.title for method in methods().values()}
    if group:
        return {name: line for name, line in fits.items() if name.startswith(f"{group} ")}
    doctor, demo, *others = [(word, line) for word, (_, line) in COMMANDS.items()]
    own = {word: line for word, (_, line) in of_methods().items()}
    return dict([doctor, demo, *fits.items(), *OF_MODELS.items(), *own.items(), *others])


def of_methods() -> dict[str, tuple[str, str]]:
    """The further commands of all methods, as of `Method.commands`; none has the name of a shared one."""
    own = {word: command for method in methods().values() for word, command in method.commands.items()}
    return {word: command for word, command in own.items() if word not in (*COMMANDS, *OF_MODELS, "fit")}


def find(words: Sequence[str]) -> Call:
    """The command that the words ask for.

    Raises:
        UsageError: there is none, or an option is not one of its method's.
        CheckpointError: the model of `apply` or `animate` does not exist.
    """
    word, rest = words[0], list(words[1:])
    if word in OF_MODELS:
        return _of_model(word, rest)
    single = COMMANDS | of_methods()
    if (two := " ".join(words[:2])) in single:
        word, rest = two, rest[1:]
    if word in single:
        call = Call(f"mitex {word}", load(single[word][0]), rest)
    elif word == "fit" and rest and rest[0] in methods():
        method = methods()[rest[0]]
        call = Call(f"mitex fit {method.name}", method.load_fit(), rest[1:])
    else:
        raise _no_such_command(words)
    refuse_unknown_options(call.command, call.words, f"`{call.program}`", f"see `{call.program} --help`")
    return call


def _of_model(word: str, words: list[str]) -> Call:
    """A command on a model: the options are those of the model's method."""
    model = _model(words)
    if model is None:
        raise UsageError("RUN|MODEL is missing", f"see `mitex {word} --help`")
    method = method_of(model)
    reference = getattr(method, word)
    if reference is None:
        able = [m.name for m in methods().values() if getattr(m, word)]
        raise UsageError(
            f"`mitex {word}` takes no {method.name} textures", f"name a run of {' or '.join(able)}"
        )
    command = load(reference)
    whose, remedy = f"{method.name} textures in `mitex {word}`", f"see `mitex {word} {model} --help`"
    refuse_unknown_options(command, words, whose, remedy)
    return Call(f"mitex {word}", command, words)


def _model(words: list[str]) -> str | None:
    """The word that names the model: the first that is neither an option nor an option's value."""
    free = [k for k, word in enumerate(words) if not word.startswith("-")]
    alone = [k for k in free if k == 0 or not words[k - 1].startswith("--") or "=" in words[k - 1]]
    return next((words[k] for k in alone or free), None)


def _no_such_command(words: Sequence[str]) -> UsageError:
    group = list(lines(words[0]))
    if group and not words[1:]:
        return UsageError(f"`mitex {words[0]}` needs a method", f"try `mitex {group[0]} --help`")
    if group:
        names = [name.partition(" ")[2] for name in group]
        return UsageError(f"`mitex {words[0]}` knows no method '{words[1]}'", suggestion(words[1], names))
    names = list(dict.fromkeys(name.partition(" ")[0] for name in lines()))
    return UsageError(f"there is no command '{words[0]}'", suggestion(words[0], names))
