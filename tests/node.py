"""Running npm packages that serve as references; without them, or without node, a test says why it skips."""

import json
import os
import shutil
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest

VALIDATE = """
const validator = require('gltf-validator'), fs = require('fs');
Promise.all(process.argv.slice(1).map(path => validator.validateBytes(new Uint8Array(fs.readFileSync(path)))))
  .then(reports => console.log(JSON.stringify(reports)));
"""


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


def khronos_reports(paths: Sequence[Path]) -> list[dict[str, Any]]:
    """The Khronos validator's reports on GLB files; skips as `run_node` does."""
    return json.loads(run_node("gltf-validator", VALIDATE, *paths))
