"""Names of the version before: they are there, and warn of the new ones."""

import pytest

import exudyn_muscles as em

SETTINGS = ["CMC", "Cosimulation", "Forward", "Static"]
STORAGE = {
    "Storage": em.Storage,
    "read_storage": em.read_storage,
    "write_results": em.opensim.write_results,
    **{
        name: getattr(em.opensim.result_files, name)
        for name in ("states", "kinematics", "controls", "forces", "tracking_errors")
    },
}


@pytest.mark.parametrize("name", SETTINGS)
def test_settings(name):
    with pytest.warns(DeprecationWarning, match=rf"exudyn_muscles\.{name} is now {name}Settings"):
        assert getattr(em, name) is getattr(em, f"{name}Settings")


@pytest.mark.parametrize("name", STORAGE)
def test_storage(name):
    with pytest.warns(
        DeprecationWarning, match=rf"storage\.{name} is now exudyn_muscles.*\.{name}"
    ):
        assert getattr(em.storage, name) is STORAGE[name]


@pytest.mark.parametrize("module", [em, em.storage])
def test_others_are_errors_as_ever(module):
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        module.nothing  # noqa: B018
