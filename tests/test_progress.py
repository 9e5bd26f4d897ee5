"""Work that is announced is heard by who listens in the thread, and by nobody else."""

import threading

from mitex.progress import announce, counted, listening


def heard(function) -> list[tuple[str, int, int]]:
    calls = []
    with listening(lambda *call: calls.append(call)):
        function()
    return calls


def test_announcements_are_heard_within_the_context_only():
    announce("before")
    assert heard(lambda: announce("work", 2, 5)) == [("work", 2, 5)]
    announce("after")


def test_other_threads_are_not_heard():
    def elsewhere():
        thread = threading.Thread(target=announce, args=("work",))
        thread.start()
        thread.join()

    assert heard(elsewhere) == []


def test_counting_tells_of_the_whole_and_not_of_its_parts():
    def frames():
        for k in range(2):
            announce("rendering a frame")
            yield k

    def count():
        assert list(counted("rendering frames", frames(), 2)) == [0, 1]
        announce("writing")

    assert heard(count) == [*(("rendering frames", k, 2) for k in range(3)), ("writing", 0, 0)]
