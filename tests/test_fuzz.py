"""The search for faults by random cases: what it reports, and that a seed repeats it."""

import time
from types import SimpleNamespace

import pytest

from .fuzz import __main__ as fuzz


def check(rng):
    """A kind that finds a fault in one case of four."""
    number = rng.integers(4)
    if number == 3:
        raise ValueError(f"three of {rng.random()}")
    return f"drew {number}"


@pytest.fixture
def kinds(monkeypatch):
    found = {"dice": SimpleNamespace(check=check), "fine": SimpleNamespace(check=lambda _: "fine")}
    monkeypatch.setattr(fuzz, "KINDS", found)
    return found


def test_findings_are_reported_with_a_seed_that_repeats_them(kinds, capsys):
    assert fuzz.main(["--seed", "5", "--count", "40"]) == 1
    first = capsys.readouterr().out
    assert "fine: 40 cases" in first and "40 fine" in first
    lines = first.splitlines()
    number = next(k for k, line in enumerate(lines) if line.startswith("FINDING ValueError: three"))
    assert "test_fuzz.py, line " in lines[number]
    command = lines[number + 1].split()
    assert command[:3] == ["python", "-m", "tests.fuzz"]
    assert fuzz.main(command[3:]) == 1
    again = capsys.readouterr().out.splitlines()
    assert lines[number] in again
    assert fuzz.main(["--seed", "5", "--count", "40"]) == 1

    def outcomes(text):
        return [line for line in text.splitlines() if "cases in" not in line]

    assert outcomes(capsys.readouterr().out) == outcomes(first)


def test_no_finding(kinds, capsys):
    assert fuzz.main(["--kind", "fine", "--seed", "1", "--count", "3"]) == 0
    assert "dice" not in capsys.readouterr().out


def test_the_kinds_share_the_time(kinds, capsys):
    kinds["dice"].check = lambda _: time.sleep(0.01)
    kinds["fine"].check = lambda _: time.sleep(0.001)
    fuzz.main(["--seed", "0", "--minutes", "0.01"])
    numbers = [int(line.split()[1]) for line in capsys.readouterr().out.splitlines()[1:]]
    assert 0 < numbers[0] < numbers[1]


def test_a_case_that_takes_too_long_is_a_finding(kinds, capsys):
    def spin(_):
        while True:
            pass

    kinds["dice"] = SimpleNamespace(check=spin, LIMIT=0.05)
    assert fuzz.main(["--kind", "dice", "--seed", "0", "--count", "1"]) == 1
    assert "TimeoutError: took more than 0.05 s" in capsys.readouterr().out


def test_a_seed_says_the_case():
    """Two cases of each kind, twice; whether they find something is not asked here."""
    for kind in fuzz.KINDS:
        once, twice = ([fuzz.case(kind, seed) for seed in (1, 2)] for _ in range(2))
        assert [(how, str(error)) for how, error in once] == [
            (how, str(error)) for how, error in twice
        ]


def test_it_asks_for_an_end(capsys):
    with pytest.raises(SystemExit):
        fuzz.main([])
    assert "give --minutes or --count" in capsys.readouterr().err
