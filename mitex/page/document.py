"""The HTML document: the page's parts and its data in one file, which loads nothing from elsewhere."""

from __future__ import annotations

import base64
import hashlib
import html
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

PARTS = Path(__file__).parent
# In the order in which each uses only those before it at once.
SCRIPTS = (
    "vectors",
    "bytes",
    "hash",
    "mesh",
    "program",
    "gl",
    "gpu",
    "weights",
    "languages",
    "rule",
    "decoder",
    "surface",
    "automaton",
    "fragment",
    "compute",
    "camera",
    "occlusion",
    "studio",
    "brush",
    "fields",
    "advection",
    "elements",
    "bake",
    "glb",
    "ply",
    "npy",
    "readers",
    "view",
    "page",
    "still",
    "clock",
    "pointer",
    "save",
    "chart",
    "live",
    "panel",
    "keys",
    "start",
)


def document(title: str, data: Mapping[str, Any], picture: bytes) -> str:
    """The page as HTML.

    Nothing in it is fetched: a Content-Security-Policy forbids all but its own script and style, known by
    their hashes, and pictures that the page holds itself. Only one with `live` in its data, which `mitex
    view` serves, may ask its own server for what is new.

    Args:
        title: of the document; any text.
        data: what the scripts read, as JSON values.
        picture: JPEG that is shown where the texture cannot grow; empty for none.
    """
    script, style = _script(), _read("page.css")
    policy = (
        f"default-src 'none'; script-src '{_digest(script)}'; style-src '{_digest(style)}'; "
        "img-src data: blob:; media-src blob:; base-uri 'none'; form-action 'none'"
    )
    if "live" in data:
        policy += "; connect-src 'self'"
    values = {
        "POLICY": policy,
        "TITLE": html.escape(title),
        "STYLE": style,
        "PICTURE": _image(picture, title),
        "DATA": _json(data),
        "SCRIPT": script,
    }
    before, *parts = _read("page.html").split("{{")
    rest = (part.partition("}}") for part in parts)
    return before + "".join(values[name] + after for name, _, after in rest)


def data_url(content: bytes) -> str:
    """A JPEG as an address that holds it."""
    return f"data:image/jpeg;base64,{base64.b64encode(content).decode()}"


def _script() -> str:
    files = [file for folder in ("glsl", "wgsl") for file in sorted((PARTS / folder).iterdir())]
    shaders = {file.name: file.read_text(encoding="utf-8") for file in files}
    code = "\n".join(_read(f"js/{name}.js") for name in SCRIPTS)
    return f'"use strict";\n(() => {{\nconst SHADERS = {_json(shaders)};\n{code}\n}})();'


def _image(picture: bytes, title: str) -> str:
    if not picture:
        return ""
    return f'<img src="{data_url(picture)}" alt="{html.escape(title)}">'


def _json(value: object) -> str:
    """As JSON that no `</script>` or `<!--` in a name ends, and that is JavaScript too."""
    text = json.dumps(value, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")


def _digest(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"


def _read(name: str) -> str:
    return (PARTS / name).read_text(encoding="utf-8")
