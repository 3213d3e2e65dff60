"""Both blind sets, on a seed that nothing was tuned on."""
import sys

from program import SOURCE, read_yaml, run_script
from records import diagnosis_record, digits

sys.path.insert(0, str(SOURCE / "scripts/blind"))
from judge import read, tallies

SEED = 101


def run(arguments, drive):
    folder = arguments.work / f"blind_{drive}"
    run_script(arguments, [sys.executable, SOURCE / "scripts/blind/run.py", f"--drive={drive}",
                           f"--build={arguments.build}", f"--work={folder}", f"--seed={SEED}",
                           f"--flights={arguments.flights}", f"--jobs={arguments.jobs}"])
    return {"rates": rates(folder), "flights": flights(folder)}


def rates(folder):
    return {what: [tally.good, tally.all] for what, tally in tallies(read(folder)).items()}


def flights(folder):
    records = {}
    for file in sorted((folder / "sealed").glob("*.hidden.yaml")):
        name, hidden = file.name.split(".")[0], read_yaml(file)
        effects = [{"id": effect["id"], **{key: digits(value) for key, value in effect.items()}}
                   for effect in hidden["effects"]]
        records[name] = {"hidden": effects, **result(folder / "results" / name, hidden["flown"])}
    return records


def result(folder, flown):
    file = folder / "diagnosis.yaml"
    if not file.exists():
        return {"verdict": "no diagnosis" if flown else "not flown"}
    return diagnosis_record(read_yaml(file))
