"""Errors inside custom operations and loops of Dr.Jit are raised as they are."""

import pytest

from mitex.errors import ConfigError
from mitex.runtime.causes import raise_causes


def test_the_error_of_a_custom_operation_in_a_loop_is_raised(mi):
    from mitex.runtime.jit import dr

    class Broken(dr.CustomOp):
        def eval(self, value):
            raise ConfigError("a problem", "a remedy")

    def body(value):
        return (dr.custom(Broken, value),)

    def loop():
        dr.while_loop((mi.Float(1),), lambda value: value > 0, body)

    with pytest.raises(RuntimeError, match="see above"):
        loop()
    with pytest.raises(ConfigError, match="a problem; a remedy"), raise_causes():
        loop()


def test_other_errors_stay():
    error = RuntimeError("plain")
    error.__cause__ = ValueError("why")
    with pytest.raises(RuntimeError, match="plain"), raise_causes():
        raise error
    with pytest.raises(KeyError), raise_causes():
        raise KeyError("key")
