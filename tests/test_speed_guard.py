"""The benchmarks that asv runs all run, and their trend is drawn from what is stored."""

import importlib
import itertools
import json
import pkgutil
from pathlib import Path

import numpy as np
import pytest

from .benchmarks import guard, timed, trend

CONFIGURATION = Path(__file__).parent / "benchmarks" / "asv.conf.json"
TRACK = "track_"


def modules():
    names = [found.name for found in pkgutil.iter_modules(guard.__path__)]
    return [importlib.import_module(f"{guard.__name__}.{name}") for name in names]


def benchmarks():
    """As asv finds them: name in its results -> class and function, with each of its parameters."""
    for module in modules():
        for kind in vars(module).values():
            if not isinstance(kind, type) or kind.__module__ != module.__name__:
                continue
            params = kind.params if isinstance(kind.params[0], list) else [kind.params]
            for track in (name for name in dir(kind) if name.startswith(TRACK)):
                name = f"{module.__name__.rpartition('.')[2]}.{kind.__name__}.{track}"
                yield name, kind, track, list(itertools.product(*params))


BENCHMARKS = {name: rest for name, *rest in benchmarks()}


@pytest.mark.parametrize("name", BENCHMARKS)
def test_every_benchmark_measures_its_small_cases(name, monkeypatch):
    for module in modules():
        for many, few in {"ROUNDS": 1, "MANY": 1, "ENOUGH": 0.0}.items():
            if hasattr(module, many):
                monkeypatch.setattr(module, many, few)
    kind, track, cases = BENCHMARKS[name]
    measured = 0
    for case in cases:
        if any(model in str(case) for model in timed.SETUPS):
            continue
        benchmark = kind()
        try:
            benchmark.setup(*case)
        except NotImplementedError:  # asv leaves it out
            continue
        assert 0.0 < getattr(benchmark, track)(*case) < 60.0
        measured += 1
    assert measured


def test_what_is_not_beside_the_repository_is_left_out(monkeypatch, tmp_path):
    cases = importlib.import_module(f"{guard.__name__}.cases")
    monkeypatch.setattr(cases, "ROOT", tmp_path)
    cases.needs(timed.PENDULUM)
    with pytest.raises(NotImplementedError, match="gait2354"):
        cases.needs("gait2354")


def test_the_configuration_finds_benchmarks_and_results():
    configuration = json.loads(CONFIGURATION.read_text())
    folder = CONFIGURATION.parent
    assert folder / configuration["benchmark_dir"] == Path(guard.__path__[0])
    assert folder / configuration["results_dir"] == trend.RESULTS.parent
    assert (folder / configuration["repo"] / "pyproject.toml").is_file()


def test_the_trend_draws_what_is_measured():
    drawn = {trend.RUNS, trend.WHOLE} | {trend.PARTS + part for part in trend.STACK}
    assert drawn <= set(BENCHMARKS)
    pairs = set(itertools.product(trend.MODELS, trend.LINES))
    assert pairs == set(BENCHMARKS[trend.RUNS][2])
    assert (trend.MODEL,) in BENCHMARKS[trend.WHOLE][2]


def test_stored_results_name_no_machine():
    for file in trend.RESULTS.glob("*.json"):
        text = file.read_text()
        assert "/" not in text and "\\" not in text.replace('\\"', "")
        stored = json.loads(text)
        about = stored.get("params", stored)
        assert about["machine"] == trend.RESULTS.name
        assert not about["cpu"] and not about["ram"]
        assert not about.get("num_cpu")


def test_the_picture_shows_the_stored_numbers():
    versions = trend.read()
    assert len(versions) > 1
    runs, parts = trend.draw(versions).axes
    for line in runs.get_lines():
        model, _, method = line.get_label().partition(", ")
        expected = [each.measured.get((trend.RUNS, model, method), np.nan) for each in versions]
        np.testing.assert_array_equal(line.get_ydata(), expected)
    for container, part in zip(parts.containers, trend.STACK, strict=True):
        heights = [bar.get_height() for bar in container]
        key = trend.PARTS + part, trend.MODEL
        np.testing.assert_array_equal(heights, [each.measured.get(key, 0.0) for each in versions])


def test_what_failed_or_was_left_out_is_a_gap(tmp_path):
    parameters = [["'pendulum'", "'gait2354'"], ["'CSF'"]]
    for k, values in enumerate(([0.2, float("nan")], None, [0.1, 0.3])):
        stored = {
            "commit_hash": f"{k}" * 40,
            "date": 1e12 - 1e9 * k,
            "results": {trend.RUNS: [values, parameters, "version"]},
        }
        (tmp_path / f"{k}-env.json").write_text(json.dumps(stored))
    newest_last = [version.measured for version in trend.read(tmp_path)]
    assert newest_last == [
        {(trend.RUNS, "pendulum", "CSF"): 0.1, (trend.RUNS, "gait2354", "CSF"): 0.3},
        {},
        {(trend.RUNS, "pendulum", "CSF"): 0.2},
    ]
