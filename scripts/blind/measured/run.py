#!/usr/bin/python3
"""The second blind set: hides effects in measured flights, diagnoses them, then judges.

    scripts/blind/measured/run.py --build=build --work=OUT --seed=1 --count=200 --half=report
    scripts/blind/measured/run.py ... --drive=rotors --count=10

The measured flights are read from TRUELINE_DATA (default: ../shared/data beside the source folder)
and converted. Each is diagnosed untouched; then, for each trial, the seed draws a flight, a fit, an
effect and its size, the native log is changed, diagnosed, and compared with what was sealed and with
the untouched flight. The table goes to standard output and OUT/table.md, all trials to
OUT/trials.yaml. What has a result in OUT is not run again, so that a run that was killed goes on
where it stopped. See README.md of scripts/blind.
"""
import itertools
import random
import shutil
import sys
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.dont_write_bytecode = True
SCRIPTS = Path(__file__).resolve().parents[2]
sys.path[1:1] = [str(SCRIPTS / "blind"), str(SCRIPTS / "freeze")]

import yaml

from changes import CHANGES
from draw_hidden import ABSORBED, NEEDS, can_show, draw_absorbed, draw_effect
from judge_measured import judge_trial, table
from measured_flights import HIDDEN_IN, ROTOR_CONFIGS, convert, has_sampled_fixes, second_flight, usable
from native import Log
from program import SOURCE, app, drawn_effects, flags, read_yaml, refuse_other_draw, refuse_other_program, run_once
from program import parse as parse_flags

DRAW = ("seed", "half", "drive", "fits", "flights", "effects", "against")
FITS = {"imu": ["mocap", "fixes"], "rotors": ["mocap"]}


def parse(description=__doc__):
    parser = flags(description, seed=1, count=200, jobs=2, half=("tune", "report", "all"), drive=("imu", "rotors"))
    parser.add_argument("--fits", help="mocap, fixes, or alone: fixes of a log without mocap")
    parser.add_argument("--flights", help="only these, separated by commas")
    parser.add_argument("--effects", help="only these, separated by commas")
    parser.add_argument("--against", action="store_true",
                        help="judge --against another untouched flight of the vehicle; the trials are the same")
    arguments = parse_flags(parser)
    arguments.fits = arguments.fits.split(",") if arguments.fits else FITS[arguments.drive]
    if not arguments.data.is_dir():
        parser.error(f"no measured flights at {arguments.data}; set TRUELINE_DATA")
    return arguments


def chosen(names, wanted):
    """Those of a list in a flag; all without the flag."""
    return [name for name in names if not wanted or name in wanted.split(",")]


def config_of(arguments, flight):
    return SOURCE / f"config/calibrate/{ROTOR_CONFIGS[flight]}.yaml" if arguments.drive == "rotors" else None


def diagnose(arguments, flight, fit, log, folder, reference=None):
    """The diagnosis, against a reference flight if given; None where there is none. `log`: a folder, or
    several with commas."""
    flags = [f"--fit_to={'fixes' if fit == 'alone' else fit}"]
    if arguments.drive == "rotors":
        flags = ["--drive=rotors", f"--config={config_of(arguments, flight)}"]
    if reference:
        flags.append(f"--against={reference}")
    run_once(arguments, [app(arguments, "diagnose"), f"--log={log}", f"--out={folder}", "--quiet",
                         "--report=false", *flags], folder)
    file = folder / "diagnosis.yaml"
    return read_yaml(file) if file.exists() else None


def written(log, folder, fit):
    """The log in `folder`, without mocap for a fit `alone`."""
    if fit == "alone":
        log.streams.pop("mocap", None)
    log.write(folder)
    return folder


def as_fitted(log, fit):
    """The untouched log as a fit reads it: a copy without mocap for a fit `alone`."""
    copy = log.with_name(f"{log.name}_alone")
    return log if fit != "alone" else copy if copy.exists() else written(Log(log), copy, fit)


def reference_of(arguments, flight, fit):
    """The log of another flight of the vehicle, without --against None."""
    other = second_flight(flight, list(HIDDEN_IN)) if arguments.against else None
    log = convert(arguments, other) if other else None
    return as_fitted(log, fit) if log else None


def diagnose_untouched(arguments, flight, fit):
    """(flight, fit) and (folder of its log, diagnosis by which trials are drawn, the one to judge by);
    None where it can't be used."""
    log, reference = convert(arguments, flight), reference_of(arguments, flight, fit)
    if log is None or (arguments.against and not reference):
        return (flight, fit), None
    folder = arguments.work / "results" / f"untouched_{arguments.drive}_{flight}_{fit}"
    alone = diagnose(arguments, flight, fit, as_fitted(log, fit), folder)
    judged = diagnose(arguments, flight, fit, as_fitted(log, fit), folder.with_name(f"against_{folder.name}"),
                      reference) if reference else alone
    return (flight, fit), (log, alone, judged) if alone and judged else None


def draw(arguments, trial, untouched, sizes):
    """What trial number `trial` hides where; None where no flight shows such an effect."""
    effects = chosen(NEEDS[arguments.drive], arguments.effects)
    fit = arguments.fits[trial % len(arguments.fits)]
    effect = effects[trial // len(arguments.fits) % len(effects)]
    rng = random.Random(f"{arguments.seed} {trial}")
    from_counted = rng.random() < 0.5
    flights = sorted(flight for flight, of in untouched if of == fit)
    rng.shuffle(flights)
    for counted, flight in itertools.product((from_counted, not from_counted), flights):
        log, diagnosis, _ = untouched[flight, fit]
        about, config = read_yaml(log / "log.yaml"), config_of(arguments, flight)
        if not can_show(effect, arguments.drive, log, about):
            continue
        hidden = (draw_absorbed(rng, effect, read_yaml(config) if config else {}) if effect in ABSORBED else
                  draw_effect(rng, effect, counted, sizes.get(effect, {}), diagnosis, about))
        if hidden:
            return {"flight": flight, "fit": fit, "hidden": hidden}
    return None


def run_trial(arguments, trial, untouched, sizes):
    """The judge's record; None where there is nothing to judge."""
    name = f"t{trial:03d}"
    folder, sealed = arguments.work / "results" / name, arguments.work / "sealed" / f"{name}.yaml"
    if not (folder / "outcome.yaml").exists() or not sealed.exists():
        drawn = draw(arguments, trial, untouched, sizes)
        if drawn is None:
            print(f"{name}: no flight shows the drawn effect at such a size", file=sys.stderr, flush=True)
            return None
        log = Log(untouched[drawn["flight"], drawn["fit"]][0])
        CHANGES[drawn["hidden"]["id"]](log, drawn["hidden"])
        sealed.write_text(yaml.safe_dump(drawn, sort_keys=False))
        written(log, arguments.work / "logs" / name, drawn["fit"])
    drawn = read_yaml(sealed)
    changed = diagnose(arguments, drawn["flight"], drawn["fit"], arguments.work / "logs" / name, folder,
                       reference_of(arguments, drawn["flight"], drawn["fit"]))
    shutil.rmtree(arguments.work / "logs" / name, ignore_errors=True)
    log, _, before = untouched[drawn["flight"], drawn["fit"]]
    if changed is None:
        print(f"{name}: no diagnosis: {read_yaml(folder / 'outcome.yaml')['errors']}", file=sys.stderr)
        return None
    gates = len(read_yaml(log / "log.yaml").get("gates") or [])
    record = judge_trial(drawn["hidden"], before, changed, gates)
    print(f"{name} {drawn['flight']}, {drawn['fit']}: {drawn['hidden']['id']} x {record['times']:.1f} -> "
          f"{', '.join(record['named']) or record['verdicts'][1]}", file=sys.stderr, flush=True)
    return {"trial": name, "flight": drawn["flight"], "fit": drawn["fit"], "drive": arguments.drive, **record}


def main():
    arguments = parse()
    for folder in ("sealed", "results", "logs"):
        (arguments.work / folder).mkdir(parents=True, exist_ok=True)
    refuse_other_program(arguments)
    refuse_other_draw(arguments.work, {name: getattr(arguments, name) for name in DRAW})
    flights = chosen(usable(arguments.drive, arguments.half), arguments.flights)
    with ThreadPoolExecutor(arguments.jobs) as pool:
        references = [second_flight(name, list(HIDDEN_IN)) for name in flights if arguments.against]
        logs = pool.map(lambda name: convert(arguments, name), {*flights, *filter(None, references)})
        for log, fit in itertools.product(filter(None, logs), arguments.fits):
            as_fitted(log, fit)
        pairs = [(name, fit) for name in flights for fit in arguments.fits]
        untouched = dict(pool.map(lambda pair: diagnose_untouched(arguments, *pair), pairs))
        untouched = {pair: of for pair, of in untouched.items() if of}
        sizes = drawn_effects(arguments.build, arguments.drive)
        trials = range(arguments.count)
        records = [record for record in
                   pool.map(lambda trial: run_trial(arguments, trial, untouched, sizes), trials) if record]
    (arguments.work / "trials.yaml").write_text(yaml.safe_dump(records, sort_keys=False, width=150))
    text = table(records, [(*pair, has_sampled_fixes(pair[0]), diagnosis)
                           for pair, (_, _, diagnosis) in untouched.items()])
    (arguments.work / "table.md").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
