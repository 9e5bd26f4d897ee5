"""Whether a run that is resumed gets the inputs that it began with.

A task's metadata may hold a hash of each input's content beside its name: `exemplar` and `exemplar_key`.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from mitex.errors import CheckpointError
from mitex.training.locate import checkpoints, header

KEY = "_key"


def check_inputs(folder: Path, metadata: Mapping[str, str]) -> None:
    """Compares inputs with those that a run folder's checkpoint was made with, before any long work.

    Args:
        folder: of the run; one without a checkpoint that can be read passes.
        metadata: of the task to be, or the part of it that is known.

    Raises:
        CheckpointError: as `refuse_other_inputs`.
    """
    for path in checkpoints(folder):
        if head := header(path):
            _, texts = head
            start = "task."
            return refuse_other_inputs(
                {key.removeprefix(start): text for key, text in texts.items() if key.startswith(start)},
                metadata,
            )


def refuse_other_inputs(old: Mapping[str, str], new: Mapping[str, str]) -> None:
    """Compares the hashes of contents in the metadata of two tasks, as far as both have them.

    Raises:
        CheckpointError: an input differs; it is named.
    """
    for key in sorted(old.keys() & new.keys()):
        if key.endswith(KEY) and old[key] != new[key]:
            what = key.removesuffix(KEY)
            name = f" '{new[what]}'" if what in new else ""
            raise CheckpointError(
                f"the {what}{name} is not the one that the run began with",
                "resume with the same one, or start a run in another folder",
            )
