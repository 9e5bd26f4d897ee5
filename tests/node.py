"""Running npm packages that serve as references; without them, or without node, a test says why it skips."""

import os
import shutil
import subprocess

import pytest


def run_node(package: str, script: str, *arguments: object) -> str:
    """What a script prints that requires `package`; MITEX_REQUIRE_NPM makes its absence a failure."""
    node = shutil.which("node")
    missing = "no node" if node is None else ""
    if node and subprocess.run([node, "-e", f"require('{package}')"], capture_output=True).returncode:
        missing = f"no npm package {package} on NODE_PATH"
    if missing and os.environ.get("MITEX_REQUIRE_NPM"):
        pytest.fail(missing)
    if not node or missing:
        pytest.skip(f"{missing}: there is nothing to compare with")
    command = [node, "-e", script, *map(str, arguments)]
    return subprocess.run(command, capture_output=True, text=True, check=True).stdout
