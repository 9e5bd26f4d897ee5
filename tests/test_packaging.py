"""The wheel: built from the tree without a network, imported outside the checkout."""

import os
import re
import shutil
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import mitex
from mitex.methods.registry import methods

ROOT = Path(__file__).parents[1]


@pytest.fixture(scope="session")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=300)
    assert done.returncode == 0, done.stdout + done.stderr
    (built,) = folder.glob("mitex-*.whl")
    return built


@pytest.fixture(scope="session")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    target = tmp_path_factory.mktemp("site")
    command = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-index",
        "--no-deps",
        "--target",
        str(target),
    ]
    subprocess.run([*command, str(wheel)], check=True, timeout=300)
    return target


def run_installed(installed: Path, folder: Path, code: str) -> str:
    """Runs code against the installed copy, which comes before any editable install of the checkout."""
    command = [sys.executable, "-P", "-c", code]
    environment = {**os.environ, "PYTHONPATH": str(installed)}
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_everything_in_the_package_is_in_the_wheel_and_nothing_else(wheel: Path):
    listed = subprocess.run(["git", "ls-files", "mitex"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode != 0 or not listed.stdout:
        pytest.skip("not a git checkout")
    tracked = {name for name in listed.stdout.splitlines() if (ROOT / name).exists()}
    names = {name for name in zipfile.ZipFile(wheel).namelist() if not name.endswith("/")}
    assert tracked - names == set()
    assert "mitex/py.typed" in names  # type checkers read the annotations
    assert {name for name in names if not re.match(r"mitex(-[\d.]+\.dist-info)?/", name)} == set()


def test_the_source_archive_has_all_but_the_settings_of_tools():
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode != 0 or not listed.stdout:
        pytest.skip("not a git checkout")
    declared = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["hatch"]["build"]["targets"][
        "sdist"
    ]
    tracked = {name.partition("/")[0] for name in listed.stdout.splitlines()}
    always = {"pyproject.toml", ".gitignore"}
    assert tracked - always - set(declared["include"]) == {".github", ".pre-commit-config.yaml"}


def test_data_comes_with_its_license(wheel: Path):
    names = zipfile.ZipFile(wheel).namelist()
    folders = {name.rsplit("/", 1)[0] for name in names if name.startswith("mitex/data/weights/")}
    assert folders and all(f"{folder}/LICENSE.txt" in names for folder in folders)
    assert any(re.fullmatch(r"mitex-.*\.dist-info/licenses/LICENSE", name) for name in names)


def test_the_installed_copy_works_outside_the_checkout(installed: Path, tmp_path: Path):
    code = (
        "import mitex\n"
        "from mitex.features import weights\n"
        "weights.verify(weights.vgg16_path(), weights.VGG16_SHA256)\n"
        "print(mitex.__file__, mitex.init().variant(), mitex.__version__)"
    )
    place, variant, version = run_installed(installed, tmp_path, code).split()
    assert place == str(installed / "mitex" / "__init__.py") and variant == "llvm_ad_rgb"
    assert (installed / f"mitex-{version}.dist-info").is_dir()


def test_public_names_resolve_in_the_installed_copy(installed: Path, tmp_path: Path):
    code = "import mitex; print(*[type(getattr(mitex, n)).__name__ for n in mitex.__all__])"
    assert len(run_installed(installed, tmp_path, code).split()) == len(mitex.__all__)


def test_the_command_is_there(installed: Path, tmp_path: Path):
    assert "mitex = mitex.cli:main" in (next(installed.glob("*.dist-info")) / "entry_points.txt").read_text()
    assert run_installed(installed, tmp_path, "from mitex.cli import main; print(callable(main))") == "True"


def test_the_citation_is_of_this_version():
    declared = re.search(r'^__version__ = "(.*)"', (ROOT / "mitex" / "__init__.py").read_text(), re.MULTILINE)
    cited = re.search(r"^version: (.*)$", (ROOT / "CITATION.cff").read_text(), re.MULTILINE)
    assert declared and cited and declared[1] == cited[1]


def test_methods_are_cited():
    """All papers that the page of attributions names, and each method but parts of others."""
    page = (ROOT / "docs" / "attributions.md").read_text().partition("## Methods")[2]
    citation = (ROOT / "CITATION.cff").read_text()
    titles = {" ".join(title.split()) for title in re.findall(r"\*(.*?)\*", page, re.DOTALL)}
    assert titles and titles <= set(re.findall(r'^    title: "?(.*?)"?$', citation, re.MULTILINE))
    parts = {"displacement", "plain_field", "quilted"}  # of the papers of `geometric` and `nerf`
    named = {name for name, method in methods().items() if method.presets.startswith("mitex.")} - parts
    assert named <= set(re.findall(r"^- `(\w+)`", page, re.MULTILINE))


@pytest.mark.parametrize(
    ("pythons", "chosen"),
    [
        ({"python3": 11}, "python3"),
        ({"python3": 14}, "python3"),
        ({"python3": 14, "python3.14": 14, "python3.12": 12}, "python3.12"),
        ({"python3": 9, "python3.13": 13, "python3.14": 14}, "python3.13"),
        ({"python3": 9, "python3.14": 14}, "python3.14"),
        ({"python3": 9}, ""),
    ],
)
def test_make_prefers_pythons_that_need_no_compiler(tmp_path: Path, pythons: dict[str, int], chosen: str):
    make = shutil.which("make")
    if make is None:
        pytest.skip("needs make")
    for name, minor in pythons.items():
        script = (
            f"""#!/bin/sh\nexec {sys.executable} -c "import sys; sys.version_info = (3, {minor}); $2"\n"""
        )
        (tmp_path / name).write_text(script)
        (tmp_path / name).chmod(0o755)
    done = subprocess.run(
        [make, "--no-print-directory", "--eval=chosen: ; @: $(info $(PYTHON))", "chosen"],
        cwd=ROOT,
        env={"PATH": str(tmp_path)},
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0 and done.stdout.strip() == chosen, done.stderr


def test_pins_agree_with_the_declared_ranges():
    pins = (ROOT / "constraints.txt").read_text().split()
    assert pins == ["torch==2.13.0"]
    assert f"pip install {pins[0]} " in (ROOT / "CONTRIBUTING.md").read_text()
    assert (
        "torch>=2.13,<2.14" in tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["dependencies"]
    )
