"""The contract of `main`: exit codes, one line for every complaint, help, warnings, and a quick start."""

import os
import re
import subprocess
import sys
import types
import warnings
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, ClassVar

import pytest

import mitex
from mitex.cli import commands, main
from mitex.errors import ConfigError, MeshWarning
from mitex.training.errors import Interrupted
from mitex.training.locate import bundled_files


@pytest.fixture
def command(monkeypatch):
    """A command `mitex try` whose run is replaced by `command.run = ...`."""

    @dataclass
    class Try:
        """Try something.

        examples:
          mitex try --count 3
        """

        count: int = 1
        """How many."""

        action: ClassVar[Any] = None

        def run(self):
            return Try.action(self)

    module = types.ModuleType("try_it")
    module.__dict__["Try"] = Try
    monkeypatch.setitem(sys.modules, "try_it", module)
    monkeypatch.setitem(commands.COMMANDS, "try", ("try_it:Try", "try something"))
    return Try


def fail(error):
    def action(_):
        raise error

    return action


class TestExitCodes:
    def test_done(self, command):
        command.action = lambda self: None
        assert main(["try"]) == 0

    def test_a_command_may_say_its_own(self, command):
        command.action = lambda self: 1
        assert main(["try"]) == 1

    def test_errors_are_one_line_even_with_line_breaks(self, command, capsys):
        command.action = fail(ConfigError("this\nis  wrong", "do\nthat"))
        assert main(["try"]) == 2
        assert capsys.readouterr() == ("", "error: this is wrong; do that\n")

    def test_arguments_of_python_calls_are_named_as_options(self, command, capsys):
        """Those that the command has; `mitex doctor` and the like stay as they are."""
        command.action = fail(
            ConfigError("`count` is wrong", "give `count=3`, or `resume=True`, or `mitex x`")
        )
        assert main(["try"]) == 2
        words = "--count is wrong; give --count 3, or `resume=True`, or `mitex x`"
        assert capsys.readouterr().err == f"error: {words}\n"

    def test_interrupted(self, command, capsys, tmp_path):
        command.action = fail(Interrupted(tmp_path / "c", 7))
        assert main(["try"]) == 130
        assert "step 7" in capsys.readouterr().err
        command.action = fail(KeyboardInterrupt())
        assert main(["try"]) == 130
        assert capsys.readouterr().err == "interrupted\n"

    def test_interrupted_where_python_executes_a_text(self, tmp_path):
        """As for a dataclass: `python -m` then ends by the signal, unless another text is executed."""
        (tmp_path / "interrupted.py").write_text(
            "import sys\nfrom mitex.cli import entry\n"
            "entry._command = lambda words: exec('raise KeyboardInterrupt')\n"
            "sys.exit(entry.main(['models']))\n"
        )
        environment = os.environ | {
            "PYTHONPATH": os.pathsep.join([str(tmp_path), str(Path(mitex.__file__).parents[1])])
        }
        words = [sys.executable, "-m", "interrupted"]
        done = subprocess.run(words, env=environment, capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (130, "interrupted\n")

    def test_a_bug_shows_itself(self, command):
        command.action = fail(ZeroDivisionError("a bug"))
        with pytest.raises(ZeroDivisionError):
            main(["try"])

    def test_in_a_process(self):
        for words, code in ((["--version"], 0), (["-V"], 0), (["bogus"], 2)):
            done = subprocess.run([sys.executable, "-m", "mitex", *words], capture_output=True, text=True)
            assert done.returncode == code
            assert ("error: " in done.stderr) == (code == 2)
            assert done.stdout == ("" if code else f"mitex {mitex.__version__}\n")

    def test_a_closed_pipe_is_no_error(self):
        line = f"{sys.executable} -m mitex --help | true; exit ${{PIPESTATUS[0]}}"
        done = subprocess.run(["bash", "-c", line], capture_output=True, text=True)
        assert (done.returncode, done.stderr) == (0, "")


class TestWarnings:
    def test_ours_are_lines_said_once_and_others_unseen(self, command, capsys):
        def action(_):
            warnings.warn("the mesh has\na hole", MeshWarning, stacklevel=2)
            warnings.warn("the mesh has\na hole", MeshWarning, stacklevel=2)
            warnings.warn("the mesh is flat", MeshWarning, stacklevel=2)
            warnings.warn("noise of a library", UserWarning, stacklevel=2)

        command.action = action
        before = warnings.showwarning
        assert main(["try"]) == 0
        assert capsys.readouterr().err == "warning: the mesh has a hole\nwarning: the mesh is flat\n"
        assert warnings.showwarning is before
        assert main(["try"]) == 0  # the next command tells anew
        assert "hole" in capsys.readouterr().err


class TestHelp:
    @pytest.mark.parametrize("name", [n for n in commands.lines() if n not in commands.OF_MODELS])
    def test_every_command_has_examples_of_itself(self, name, capsys):
        assert main([*name.split(), "--help"]) == 0
        self.check_examples(name, capsys)

    @pytest.mark.parametrize(
        ("name", "model"),
        [("apply", "waffle"), ("apply", "spikes"), ("animate", "spikes"), ("animate", "waffle")],
    )
    def test_commands_on_models_explain_the_options_of_their_method(self, name, model, capsys):
        assert main([name, model, "--help"]) == 0
        self.check_examples(name, capsys)

    def check_examples(self, name, capsys):
        text = capsys.readouterr().out
        examples = [line for line in text.split("examples:")[1].splitlines() if line.startswith("  ")]
        assert examples[0].strip().startswith(f"mitex {name}") and "--help" in text
        words = " ".join(re.sub("[│─╭╮╰╯]", " ", text).split())  # without the frames, and line breaks
        assert not re.findall(r"\S*\{None\}\S*|.{60}\(default: (?:None)?\)", words)

    def test_overview_lists_every_command(self, capsys):
        for words in (["--help"], ["-h"], ["help"]):
            assert main(words) == 0
            text = capsys.readouterr().out
            assert all(f"  {name} " in text for name in commands.lines())

    def test_group(self, capsys):
        assert main(["fit", "--help"]) == 0
        text = capsys.readouterr().out
        assert "fit nca" in text and "render" not in text

    def test_apply_lists_the_options_of_every_method(self, capsys):
        assert main(["apply", "--help"]) == 0
        rows = dict(line.strip().split("  ", 1) for line in capsys.readouterr().out.splitlines()[4:-2])
        assert "--end-level" in rows["geometric"] and "--orientation" not in rows["geometric"]
        assert "--orientation" in rows["nca"] and "--end-level" not in rows["nca"]

    def test_starts_without_heavy_imports(self):
        """torch, Mitsuba and even NumPy stay out until a command runs."""
        code = (
            "import sys; from mitex.cli import main; main(['--help']); main(['apply', '--help']);"
            "print({'torch', 'mitsuba', 'drjit', 'trimesh', 'scipy', 'numpy'} & set(sys.modules))"
        )
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert done.stdout.splitlines()[-1] == "set()"

    def test_long_commands_speak_before_heavy_imports(self):
        """So that the first line comes at once, whatever the command loads then."""
        commands = [
            *("fit nca --exemplar lava", "fit surface --exemplar lava --mesh knot"),
            *("fit geometric --reference craters", "fit nerf --capture photos", "demo"),
            *("apply spikes --mesh vase --out a.glb", "animate spikes --mesh vase --out a.mp4"),
            *("render a.glb --out a.png", "render a.glb --out a.mp4"),
        ]
        code = f"""
import sys
from mitex.cli import display, main

def announce(work):
    print(work, {{'torch', 'mitsuba', 'drjit', 'trimesh', 'scipy', 'PIL'}} & set(sys.modules))
    sys.exit()

display.announce = announce
for command in {commands}:
    try:
        main(command.split())
    except SystemExit:
        pass
"""
        done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
        assert done.stdout.splitlines() == ["starting set()"] * len(commands)


class TestUsage:
    @pytest.mark.parametrize(
        ("words", "message"),
        [
            ([], "no command given; see `mitex --help`"),
            (["modles"], "there is no command 'modles'; did you mean models?"),
            (
                ["xyzzy"],
                "there is no command 'xyzzy'; use one of doctor, demo, fit, apply, animate, graft, capture, "
                "cache, models, gallery, view, batch, compare, evaluate, render, try",
            ),
            (["fit"], "`mitex fit` needs a method; try `mitex fit geometric --help`"),
            (["fit", "nac"], "`mitex fit` knows no method 'nac'; did you mean nca?"),
            (
                ["fit", "--exemplar", "a.png"],
                "`mitex fit` knows no method '--exemplar'; use one of geometric, nca, nerf, relief, surface, "
                "displacement, gatys, image_quilting, multi_view_gram, nerf_tex, plain_field, quilted, "
                "reaction_diffusion, solid_texture, style_mesh, text2mesh, x_mesh",
            ),
            (["fit", "gatys"], "--exemplar is missing; see `mitex fit gatys --help`"),
            (["fit", "surface"], "--exemplar is missing; give --exemplar IMAGE, or --text WORDS"),
            (["apply"], "RUN|MODEL is missing; see `mitex apply --help`"),
            (["apply", "waffle"], "--out is missing; see `mitex apply --help`"),
            (["apply", "spikes"], "--out and --mesh are missing; see `mitex apply --help`"),
            (
                ["apply", "--seed", "3"],
                f"there is no model '3'; use a path, or one of {', '.join(bundled_files())}",
            ),
            (
                ["apply", "--mesh", "vase", "waffle", "--orientatoin=3"],
                "--orientatoin is no option of nca textures in `mitex apply`; did you mean --orientation?",
            ),
            (
                ["apply", "spikes", "--orientation", "3"],
                "--orientation is no option of geometric textures in `mitex apply`; see `mitex apply spikes "
                "--help`",
            ),
            (["animate", "waffle"], "--mesh and --out are missing; see `mitex animate --help`"),
            (
                ["graft", "waffle", "--mash", "x"],
                "--mash is no option of `mitex graft`; did you mean --mesh?",
            ),
            (
                ["fit", "nca", "--exemplr", "x"],
                "--exemplr is no option of `mitex fit nca`; did you mean --exemplar?",
            ),
            (
                ["fit", "nac", "--settings"],
                "there is no method 'nac'; did you mean nca?",
            ),
            (
                ["fit", "nca", "--settings", "--preset", "papr"],
                "there is no preset 'papr'; did you mean paper?",
            ),
            (
                ["fit", "nca", "--settings", "--preset"],
                "--preset needs a name; see `mitex fit METHOD --help`",
            ),
            (["try", "--count", "x"], "--count cannot be 'x'; see `mitex try --help`"),
            (
                ["try", "--count"],
                "missing value for argument '--count'. Expected 1 values; see `mitex try --help`",
            ),
            (["try", "--bogus"], "--bogus is no option of `mitex try`; see `mitex try --help`"),
            (["try", "--cuont", "2"], "--cuont is no option of `mitex try`; did you mean --count?"),
            (["models", "--jsn"], "--jsn is no option of `mitex models`; did you mean --json?"),
            (["render", "a.glb", "--spq=9"], "--spq is no option of `mitex render`; did you mean --spp?"),
            (["try", "more"], "unrecognized options: more; see `mitex try --help`"),
        ],
    )
    def test_complaints(self, command, words, message, capsys):
        assert main(words) == 2
        assert capsys.readouterr() == ("", f"error: {message}\n")

    @pytest.mark.parametrize("encoding", ["ascii", "utf-8"])
    def test_on_any_terminal(self, encoding):
        """tyro draws its boxes with what the terminal has."""
        done = subprocess.run(
            [sys.executable, "-m", "mitex", "render"],
            capture_output=True,
            text=True,
            env=os.environ | {"PYTHONIOENCODING": encoding},
        )
        message = "error: ASSET and --out are missing; see `mitex render --help`\n"
        assert (done.returncode, done.stderr) == (2, message)

    def test_unknown_wording_still_gives_one_line(self):
        from mitex.cli.usage import one_line

        assert (
            one_line("╭─ Odd ──╮\n│ \x1b[31mSomething\x1b[0m\n│   new. │\n│ ────── │\n│ help   │\n╰───╯")
            == "something new"
        )
        assert one_line("") == "this command line is not understood"


class TestSettings:
    def test_every_key_is_listed_with_the_preset_s_value(self, capsys):
        from mitex.methods.nca import PRESETS

        assert main(["fit", "nca", "--settings", "--preset", "paper"]) == 0
        rows = dict(line.split(" = ", 1) for line in capsys.readouterr().out.splitlines() if " = " in line)
        assert list(rows) == [field.name for field in fields(PRESETS["paper"])]
        assert rows["frequency"].startswith("64 ") and "from 1 to 4096" in rows["frequency"]

    def test_the_first_preset_is_shown_and_the_others_are_named(self, capsys):
        assert main(["fit", "geometric", "--settings"]) == 0
        text = capsys.readouterr().out
        assert text.startswith("preset = fast ") and text.endswith("further presets: paper, fine, finest\n")


def test_the_command_line_knows_no_method_by_name():
    """Methods bring their own options; nothing in `mitex/cli` is about one of them."""
    pattern = re.compile(r"\b(nca|nerf|geometric)\b|[\"'`.]surface\b|fit surface", re.IGNORECASE)
    for file in Path(commands.__file__).parent.glob("*.py"):
        assert not pattern.findall(file.read_text()), file
