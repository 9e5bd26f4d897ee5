"""Stopping on signals."""

import os
import signal
import subprocess
import sys
import threading

import pytest

from mitex.runtime.signals import StopSignals, deferred, signal_name, terminable


@pytest.fixture(autouse=True)
def _own_handlers():
    before = {n: signal.signal(n, signal.default_int_handler) for n in (signal.SIGINT, signal.SIGTERM)}
    yield
    for number, handler in before.items():
        signal.signal(number, handler)


@pytest.mark.parametrize("first", [signal.SIGINT, signal.SIGTERM])
@pytest.mark.parametrize("second", [signal.SIGINT, signal.SIGTERM])
def test_the_first_asks_and_the_second_forces(first, second):
    with StopSignals() as stop:
        assert not stop.requested
        os.kill(os.getpid(), first)
        assert stop.requested
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), second)
    assert signal.getsignal(first) is signal.default_int_handler
    assert signal.getsignal(second) is signal.default_int_handler


def test_where_many_may_ask_the_second_changes_nothing(monkeypatch):
    monkeypatch.setattr(StopSignals, "second_raises", False)
    with StopSignals() as stop:
        for _ in range(3):
            os.kill(os.getpid(), signal.SIGTERM)
        assert stop.requested


def test_handlers_come_back_after_an_error():
    with pytest.raises(RuntimeError), StopSignals():
        raise RuntimeError
    assert signal.getsignal(signal.SIGTERM) is signal.default_int_handler


def test_an_ignored_signal_stays_ignored():
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    with StopSignals() as stop:
        os.kill(os.getpid(), signal.SIGINT)
        assert not stop.requested


def test_other_threads_change_no_handler():
    states = []

    def work():
        with StopSignals() as stop:
            states.append((signal.getsignal(signal.SIGINT), stop.requested))

    thread = threading.Thread(target=work)
    thread.start()
    thread.join()
    assert states == [(signal.default_int_handler, False)]


def test_the_first_signal_is_answered_in_the_log(caplog):
    with caplog.at_level("INFO", "mitex"), StopSignals():
        os.kill(os.getpid(), signal.SIGTERM)
    assert "stopping after this step" in caplog.text


class TestDeferred:
    @pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
    def test_what_comes_within_arrives_at_the_end(self, number):
        steps = []
        with pytest.raises(KeyboardInterrupt), deferred():
            for _ in range(2):
                os.kill(os.getpid(), number)
            steps.append("loaded")
        assert steps == ["loaded"]
        assert signal.getsignal(number) is signal.default_int_handler

    def test_without_a_signal_nothing_happens(self):
        with deferred():
            pass
        assert signal.getsignal(signal.SIGINT) is signal.default_int_handler

    def test_an_ignored_signal_stays_ignored(self):
        signal.signal(signal.SIGINT, signal.SIG_IGN)
        with deferred():
            os.kill(os.getpid(), signal.SIGINT)
        assert signal.getsignal(signal.SIGINT) is signal.SIG_IGN

    def test_an_extension_that_is_interrupted_while_it_is_loaded(self):
        """Dr.Jit asks `typing` for names while it starts; not deferred, that would end with a NameError."""
        code = (
            "import os, signal, typing\n"
            "from mitex.runtime import init\n"
            "get = typing.TypeVar.__init__\n"
            "def interrupted(*a, **k):\n"
            "    os.kill(os.getpid(), signal.SIGINT)\n"
            "    return get(*a, **k)\n"
            "typing.TypeVar.__init__ = interrupted\n"
            "try:\n"
            "    init()\n"
            "except KeyboardInterrupt:\n"
            "    raise SystemExit(130)\n"
        )
        assert subprocess.run([sys.executable, "-c", code], timeout=120).returncode == 130


class TestTerminable:
    def test_sigterm_interrupts_as_ctrl_c_does(self):
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        with pytest.raises(KeyboardInterrupt), terminable():
            os.kill(os.getpid(), signal.SIGTERM)
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_DFL

    def test_within_it_a_training_still_ends_its_step(self):
        signal.signal(signal.SIGTERM, signal.SIG_DFL)
        with terminable(), StopSignals() as stop:
            os.kill(os.getpid(), signal.SIGTERM)
            assert stop.requested

    def test_handlers_of_others_stay(self):
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        with terminable():
            os.kill(os.getpid(), signal.SIGTERM)
            assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN
        assert signal.getsignal(signal.SIGTERM) is signal.SIG_IGN


def test_names_of_signals():
    assert [signal_name(number) for number in (9, 15, 250)] == ["SIGKILL", "SIGTERM", "signal 250"]
