"""The latest state wins, and no stage of a state that is overtaken is shown."""

import threading
import time

import pytest

from copsense.explore import Model, Setting, State
from copsense.explore.worker import Worker


class Slow(Model):
    """A model whose views are cheap and whose stages can be watched."""

    def __init__(self, stance):
        super().__init__(stance)
        self.home = super().view(State(("four_bar",)))
        self.in_stage = None

    def view(self, state, revision=0, last=None):
        from dataclasses import replace

        return replace(self.home, state=state, revision=revision)

    @property
    def stages(self):
        return ((0.1, self._stage), (0.5, self._stage))

    def _stage(self, view, stale):
        from dataclasses import replace

        if self.in_stage is not None:
            self.in_stage()
        return replace(view, notes=(*view.notes, "stage"))


@pytest.fixture(scope="module")
def model(stance_of):
    return Slow(stance_of("four_bar"))


def at(y):
    return State(("four_bar",), {"com_y": Setting(y, "m")})


def test_of_a_hundred_states_the_last_one_is_shown(model):
    shown, now = [], [0.0]
    worker = Worker(model, shown.append, clock=lambda: now[0])
    assert worker.step() is None
    for i in range(100):
        worker.submit(at(i * 1e-3))
    assert worker.step() == 0.0
    assert [view.revision for view in shown] == [100]
    assert shown[0].state == at(0.099)
    assert worker.step() == pytest.approx(0.1)  # the stages wait for rest
    now[0] = 0.2
    assert worker.step() == 0.0
    assert worker.step() == pytest.approx(0.3)
    now[0] = 0.5
    worker.step()
    assert worker.step() is None
    assert [view.notes.count("stage") for view in shown] == [0, 1, 2]


def test_a_stage_of_an_overtaken_state_is_not_shown(model):
    shown, now = [], [0.0]
    worker = Worker(model, shown.append, clock=lambda: now[0])
    worker.submit(at(0.0))
    worker.step()
    now[0] = 1.0
    model.in_stage = lambda: worker.submit(at(0.01))
    try:
        worker.step()
    finally:
        model.in_stage = None
    assert [view.revision for view in shown] == [1]
    worker.step()
    assert shown[-1].revision == 2
    assert not shown[-1].notes
    assert worker.step() == pytest.approx(0.1)  # the new state's own rest


def test_the_thread_answers_and_stops(model):
    seen = threading.Event()
    shown = []
    worker = Worker(model, lambda view: (shown.append(view), view.revision >= 3 and seen.set()))
    worker.start()
    for i in range(3):
        worker.submit(at(i * 1e-3))
    assert seen.wait(20)
    revisions = [view.revision for view in shown]
    assert revisions == sorted(revisions)
    worker.stop()
    count = len(shown)
    worker.submit(at(0.5))
    time.sleep(0.05)
    assert len(shown) == count


def test_a_fault_is_kept_and_the_next_state_answered(model, monkeypatch):
    shown = []
    worker = Worker(model, shown.append)
    monkeypatch.setattr(model, "view", lambda *_: 1 / 0)
    worker.start()
    worker.submit(at(0.0))
    for _ in range(200):
        if worker.error:
            break
        time.sleep(0.02)
    assert "ZeroDivisionError" in worker.error
    monkeypatch.undo()
    worker.submit(at(0.01))
    for _ in range(200):
        if shown:
            break
        time.sleep(0.02)
    worker.stop()
    assert shown[0].state == at(0.01)
