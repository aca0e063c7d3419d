"""What of published files can be loaded: every model and set-up of OpenSim's CMC and static
optimization in some folders.

    git clone https://github.com/opensim-org/opensim-models
    git clone https://github.com/opensim-org/opensim-core
    python -m tests.benchmarks.public_models opensim-models opensim-core [--all] [--json FILE]

from the repository's root. Files of the same content count once. Prints what is refused and why, by
count, what models load with a warning, and with `--all` every file; asserts nothing.
"""

import argparse
import hashlib
import json
import re
import warnings
from collections import defaultdict
from pathlib import Path
from typing import NamedTuple

import exudyn_muscles as em
from exudyn_muscles.files.disk import write_file

LARGEST = 100e6  # bytes, as the reader has it


class Found(NamedTuple):
    """One file: what it is, its size if it loads, else why not; and what was warned of."""

    file: str
    kind: str
    size: str
    refused: str
    warned: tuple[str, ...]


def distinct(folders, pattern, marks=b""):
    """Files of a pattern with different contents, which have the marks in them."""
    found = {}
    for folder in folders:
        for file in sorted(folder.rglob(pattern)):
            if file.is_file() and file.stat().st_size < LARGEST:
                content = file.read_bytes()
                if marks in content:
                    found.setdefault(hashlib.sha256(content).digest(), file)
    return list(found.values())


def load(kind, file):
    """Try one file."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        size = refused = ""
        try:
            if kind == "model":
                model = em.opensim.load_model(file)
            else:
                model = em.opensim.load_setup(file).model
            size = f"{len(model.coordinates)} coordinates, {len(model.muscles)} muscles"
            size += f", {len(model.reserves)} actuators"
        except (em.ExudynMusclesError, FileNotFoundError) as error:
            refused = reason(file, error)
    warned = tuple(sorted({reason(file, each.message) for each in caught}))
    return Found(str(file), kind, size, refused, warned)


def reason(file, message):
    """A message without places and names, so that those of one kind are the same."""
    text = str(message).replace(str(file), "")
    text = re.sub(r"^.*?, line \d+: ", "", text)
    text = re.sub(r"\S*/\S+/\S*", "...", text)  # other files
    text = re.sub(r" \(and in \d+ more places\)", "", text)
    return re.sub(r" '[^']*'", "", text)[:200]


def counted(found, what):
    """Lines of reasons with how many files have them, most first, and one file as an example."""
    files = defaultdict(list)
    for each in found:
        for text in what(each):
            files[text].append(each.file)
    for text, names in sorted(files.items(), key=lambda item: (-len(item[1]), item[0])):
        yield f"{len(names):5d}  {text}\n         {names[0]}"


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("folders", metavar="FOLDER", type=Path, nargs="+")
    parser.add_argument("--all", action="store_true", help="a line for every file")
    parser.add_argument("--json", type=Path, metavar="FILE", help="store what was found")
    arguments = parser.parse_args()
    for folder in arguments.folders:
        if not folder.is_dir():
            parser.error(f"no folder {folder}")
    everything = []
    for kind, pattern, marks in (
        ("model", "*.osim", b""),
        ("CMC set-up", "*.xml", b"<CMCTool"),
        ("static optimization set-up", "*.xml", b"<StaticOptimization"),
    ):
        found = [load(kind, file) for file in distinct(arguments.folders, pattern, marks)]
        loaded = [each for each in found if not each.refused]
        print(f"{kind}s: {len(loaded)} of {len(found)} load")
        if arguments.all:
            for each in found:
                print(f"  {each.file}: {each.size or each.refused}")
        print("refused:", *counted(found, lambda each: [each.refused] if each.refused else []),
              sep="\n")  # fmt: skip
        print(
            "warned of, where it loads:", *counted(loaded, lambda each: each.warned), "", sep="\n"
        )
        everything += found
    if arguments.json is not None:
        content = [each._asdict() for each in everything]
        write_file(arguments.json, (json.dumps(content, indent=1) + "\n").encode())


if __name__ == "__main__":
    main()
