"""The measured flights in which effects are hidden: those of scripts/freeze and further ones of the
same sources, in two halves. Others are diagnosed untouched only."""
import hashlib
from collections import defaultdict

from flights import FLIGHTS, ROTORS
from program import SOURCE, convert_once, read_yaml

MORE = {f"nanodrone_{what}_{run}": (
            "idsia_nanodrone", [f"nanodrone_benchmark/raw/{what}_20251017_run{run}.csv.gz"])
        for what, runs in (("random1", (2, 3, 4)), ("random", (1, 2, 3, 4))) for run in runs}
MORE |= {"neurobem_slow": ("neurobem", ["neurobem_benchmark/racetrack_slow_part.csv.gz"]),
         "neurobem_linear": ("neurobem", ["neurobem_benchmark/linear_20210203161037.csv.gz"])}
HIDDEN_IN = {**FLIGHTS, **MORE}
# Diagnosed untouched only, so that the halves of the flights above stay as they are.
UNTOUCHED = {f"nanodrone_chirp_{run}": (
                 "idsia_nanodrone", [f"nanodrone_benchmark/raw/chirp_20251017_run{run}.csv.gz"])
             for run in (1, 2, 3, 4)}
UNTOUCHED |= {f"nanodrone_square_{run}": (
                  "idsia_nanodrone_square",
                  [f"nanodrone_benchmark/raw/square_20251017_run{run}.csv.gz"])
              for run in (1, 3, 4, 5)}
ALL = {**HIDDEN_IN, **UNTOUCHED}
ROTOR_CONFIGS = {**ROTORS,
                 **{name: "rotors_nanodrone" for name in MORE | UNTOUCHED if "nanodrone" in name}}


def order(name):
    return hashlib.sha256(name.encode()).hexdigest()


def halves():
    """{name: "tune" or "report"}: of each source the flights in order of the SHA-256 of their names,
    in turn."""
    sources = defaultdict(list)
    for name in sorted(HIDDEN_IN, key=order):
        sources[ALL[name][0]].append(name)
    return {name: ("tune", "report")[i % 2] for names in sources.values() for i, name in enumerate(names)}


def usable(drive, half):
    """Names in a fixed order. The rotor drive takes flights with measured rotor speeds."""
    of_half = [name for name, of in halves().items() if half in (of, "all")]
    if drive == "imu":
        return of_half
    return [name for name in of_half if name in ROTOR_CONFIGS and ALL[name][0] != "nanobench"]


def second_flight(name, names):
    """The next one of `names` by the same source, in turn; None where there is no other."""
    same = sorted(other for other in names if ALL[other][0] == ALL[name][0])
    following = same[(same.index(name) + 1) % len(same)]
    return following if following != name else None


def has_sampled_fixes(name):
    """True where the converter samples fixes from mocap; the other logs have a detector's."""
    return "fixes_from_mocap" in read_yaml(SOURCE / f"config/import/{ALL[name][0]}.yaml")


def convert(arguments, name):
    """The folder of the untouched native log; None where its files are missing or do not convert."""
    map_name, files = ALL[name]
    out = arguments.work / "untouched" / name
    if not all((arguments.data / file).exists() for file in files):
        return None
    convert_once(arguments, map_name, [arguments.data / file for file in files], out)
    return out if (out / "log.yaml").exists() else None
