"""What `mitex fit METHOD --settings` prints."""

from __future__ import annotations

from collections.abc import Sequence

from mitex.cli.usage import UsageError
from mitex.methods.registry import methods
from mitex.suggestions import suggestion


def settings_text(words: Sequence[str]) -> str:
    """Every key of a method's settings, with its value in a preset, its range and its meaning.

    Args:
        words: after `mitex fit`: the method, and --preset NAME if it is not the default one.

    Raises:
        UsageError: there is no such method, or --preset has no value.
        ConfigError: there is no such preset.
    """
    from mitex.training.config import resolve
    from mitex.training.settings import table

    if words[0] not in methods():
        raise UsageError(f"there is no method '{words[0]}'", suggestion(words[0], methods()))
    presets = methods()[words[0]].load_presets()
    config = resolve(presets, _preset(words))
    others = [name for name in presets if name != config.preset]
    also = f"\n\nfurther presets: {', '.join(others)}" if others else ""
    return f"{table(config)}{also}"


def _preset(words: Sequence[str]) -> str | None:
    for word, value in zip(words, [*words[1:], None], strict=True):
        name, equals, text = word.partition("=")
        if name == "--preset":
            if not equals and value is None:
                raise UsageError("--preset needs a name", "see `mitex fit METHOD --help`")
            return text if equals else value
    return None
