"""The progress bar: what it shows, where and when. It looks on, and changes nothing."""

from __future__ import annotations

import re

import pytest

from somatopy.experiment import Description, Session, progress
from somatopy.experiment.progress import ProgressBar


@pytest.fixture
def described() -> Description:
    table = {
        "name": "short",
        "body": {"motion": "kinematic"},
        "eye": {"kind": "geometric"},
        "learner": {"kind": "fixed", "head": [0.6, 0.3]},
        "phases": [{"name": "a", "frames": 60}, {"name": "b", "frames": 40}],
    }
    return Description.model_validate(table)


def watched(described: Description, first: int = 0) -> tuple[Session, float]:
    """A session that ran to its end, shown from some frame on, and its rate of hits."""
    with Session(described) as session:
        while session.done < first:
            next(session)
        with ProgressBar(session):
            for _ in session:
                pass
        return session, session.hits / session.done


def test_it_shows_name_rates_and_hits_on_standard_error(
    described: Description, capsys: pytest.CaptureFixture[str]
) -> None:
    """At the end all frames are done and the hit rate so far is that of the run; standard output is left alone."""
    _, rate = watched(described)
    out, err = capsys.readouterr()
    assert out == "" and 0 < rate < 1
    for word in ("short", "100 %", "frames/s", f"{rate:.1%} so far"):
        assert word in err.replace("\n", " "), err


def test_of_a_resumed_run_it_tells_the_whole_rate(described: Description, capsys: pytest.CaptureFixture[str]) -> None:
    """Frames before it looked on count in the rate so far and in the share that is done."""
    _, rate = watched(described, first=70)
    err = capsys.readouterr().err.replace("\n", " ")
    assert f"{rate:.1%} so far" in err and "100 %" in err


def test_it_is_drawn_now_and_then_and_not_in_each_frame(
    described: Description, monkeypatch: pytest.MonkeyPatch
) -> None:
    """At the end, and whenever the time between two drawings is over: the clock is the test's own."""
    shown: list[int] = []
    clock = iter(range(10**9))
    monkeypatch.setattr(progress, "perf_counter", lambda: float(next(clock)))
    show = ProgressBar._show

    def showing(self: ProgressBar) -> None:
        shown.append(self._session.done)
        show(self)

    monkeypatch.setattr(ProgressBar, "_show", showing)
    monkeypatch.setattr(progress, "_REFRESH_S", 0.5)  # the clock of the bar is a second on whenever it is read
    watched(described)
    assert shown == [*range(1, 101), 100]
    shown.clear()
    monkeypatch.setattr(progress, "_REFRESH_S", 10.0)
    watched(described)
    assert len(shown) < 20 and shown[-1] == 100 and shown == sorted(shown)


def test_a_run_without_frames_has_a_bar(described: Description, capsys: pytest.CaptureFixture[str]) -> None:
    """It says no rate, and divides by nothing."""
    with Session(described.replaced(phases=[{"name": "a", "frames": 0}])) as session, ProgressBar(session):
        assert list(session) == []
    assert "frames/s" not in capsys.readouterr().err


def test_it_looks_on_for_as_long_as_its_context_lasts(described: Description) -> None:
    """After an error, too; the frames are those of a session that nobody watches."""
    with Session(described) as session, Session(described) as alone:
        with pytest.raises(ZeroDivisionError), ProgressBar(session) as bar:
            next(session)
            raise ZeroDivisionError
        with pytest.raises(ValueError):
            session.detach(bar)
        next(alone)
        for seen, unseen in zip(session, alone, strict=True):
            assert (seen.reading.arm == unseen.reading.arm).all() and (seen.gaze == unseen.gaze).all()


@pytest.mark.parametrize("width", [80, 100, 160])
@pytest.mark.parametrize("name", ["short", "an-experiment-with-a-long-name"])
def test_no_time_is_cut(
    width: int, name: str, described: Description, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """In one line, at 80 columns too, also where frames per second have six digits."""
    clock = iter(range(10**9))
    monkeypatch.setattr(progress, "perf_counter", lambda: next(clock) / 200_000)
    monkeypatch.setenv("COLUMNS", str(width))
    watched(described.replaced(name=name))
    (line,) = capsys.readouterr().err.strip().splitlines()
    assert len(line) <= width and re.search(r"\d\d\d,\d\d\d frames/s .*% so far +\d:\d\d:\d\d left \d:\d\d:\d\d$", line)


def test_frames_per_second_are_averaged(
    described: Description, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """After fifty frames in a second one takes 1.04 s: the rate is that of both together."""
    clock = [0.0]
    monkeypatch.setattr(progress, "perf_counter", lambda: clock[0])
    with Session(described) as session:
        with ProgressBar(session):
            for number in range(51):
                clock[0] += 1.04 if number == 50 else 0.02
                next(session)
        session.close()
    assert "25 frames/s" in capsys.readouterr().err
