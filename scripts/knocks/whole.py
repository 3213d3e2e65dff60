"""Whether a result folder is whole: all files of one run and those of the user."""
import hashlib
from dataclasses import dataclass
from pathlib import Path

import yaml

USER_FILES = {"notes of the user.txt": "mine\n", "sketches/of the user.txt": "mine, too\n"}
JOBS = "jobs"  # trueline-benchmark keeps finished flights here while it runs


@dataclass
class State:
    key: str         # the same for the same result
    fault: str = ""  # what makes the folder not whole


def add_files_of_the_user(folder):
    for name, text in USER_FILES.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)


def digest(path):
    return hashlib.sha256(path.read_bytes()).hexdigest()


def state_of(folder):
    for name, text in USER_FILES.items():
        if not (folder / name).exists() or (folder / name).read_text() != text:
            return State("", f"'{name}' of the user is gone or changed")
    own = {path.name for path in folder.iterdir()
           if path.name != JOBS and path.name not in {Path(n).parts[0] for n in USER_FILES}}
    if "manifest.yaml" in own:
        return state_by_manifest(folder, own - {"manifest.yaml"})
    return State(str(sorted((name, digest(folder / name)) for name in own)))


def state_by_manifest(folder, own):
    """Solve times differ between runs, so a result is known by its files and its log."""
    stated = yaml.safe_load((folder / "manifest.yaml").read_text())["sha256"]
    if set(stated) != own:
        return State("", f"files beside those of the manifest: {sorted(set(stated) ^ own)}")
    wrong = [name for name in own if digest(folder / name) != stated[name]]
    if wrong:
        return State("", f"not the files of the manifest: {wrong}")
    return State(str(sorted(own)) + identity(folder))


def identity(folder):
    """What tells the two inputs of a verb apart, without the times that a run took."""
    for name in ("calibration.yaml", "diagnosis.yaml"):
        if (folder / name).exists():
            return str(yaml.safe_load((folder / name).read_text())["provenance"]["log"])
    for name in ("trajectory.yaml", "observability.yaml", "inspection.yaml", "arcs.csv"):
        if (folder / name).exists():
            return digest(folder / name)
    return ""
