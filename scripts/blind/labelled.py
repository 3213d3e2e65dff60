#!/usr/bin/python3
"""Flights whose cause is known, by trueline-diagnose --against: the table of what is named.

    scripts/blind/labelled.py --work=OUT [--build=build] [--only=cuts,fleet,full] [--every=1] [--jobs=2]

Reads labelled/crazypad, labelled/crazyswarm_thrust and nanobench of TRUELINE_DATA (default:
../shared/data beside the source folder). References never hold the flight itself. A campaign is a
run of labels flown with one set-up; its references are its mildest label, or the normal session
that it followed. The table goes to standard output and OUT/labelled.md.
"""
import csv
import gzip
import itertools
import re
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import yaml
from scipy.signal import butter, filtfilt
from scipy.stats import spearmanr

sys.path.insert(1, str(Path(__file__).resolve().parents[1] / "freeze"))
from program import SOURCE, flags
from program import parse as parse_flags

MILDEST = {"M12": "cut_M2_0.5mm_46.5mm", "E8": "cut_propeller_M3_0.5mm_46.5mm",
           "E9": "cut_propeller_M3_1mm_46mm"}
G = 9.81


def parse():
    parser = flags(__doc__, only="cuts,fleet,full", every=1, jobs=2)
    arguments = parse_flags(parser)
    if not (arguments.data / "labelled").is_dir():
        parser.error(f"no labelled flights at {arguments.data}; set TRUELINE_DATA")
    return arguments


class Program:
    """Runs diagnoses once each, a few at a time."""

    def __init__(self, arguments):
        self.apps, self.work, self.jobs = arguments.build / "apps", arguments.work, arguments.jobs

    def convert(self, log, name, map_file):
        out = self.work / "logs" / name
        if not (out / "log.yaml").exists():
            subprocess.run([self.apps / "trueline-convert", f"--map={map_file}", f"--in={log}",
                            f"--out={out}", "--quiet"], check=True)
        return out

    def diagnose(self, trials):
        """[(name, log, references, further flags)] to the contents of diagnosis.yaml; None for exit code 3."""
        with ThreadPoolExecutor(self.jobs) as pool:
            return list(pool.map(lambda trial: self._one(*trial), trials))

    def _one(self, name, log, references, flags):
        out = self.work / "results" / name
        command = [self.apps / "trueline-diagnose", f"--log={log}",
                   "--against=" + ",".join(map(str, references)), f"--out={out}", "--quiet",
                   "--report=false", *flags]
        code = subprocess.run(command, check=False).returncode
        if code == 3:
            return None
        if code != 0:
            sys.exit(f"{name}: exit code {code} of {' '.join(map(str, command))}")
        return yaml.safe_load((out / "diagnosis.yaml").read_text())


def rotors(result, key="causes"):
    """Numbers from 1 of the weak rotors, the weakest first."""
    return [c["parameters"]["rotor"]["value"] + 1 for c in result.get(key) or [] if c["id"] == "rotor_loss"]


def first(result):
    return rotors(result, "first")


def share(hits):
    return f"{sum(hits)} of {len(hits)} ({100 * np.mean(hits):.0f} %)" if hits else "none"


class Cuts:
    """CrazyPAD: cut propellers, tape and loads on two vehicles."""

    def __init__(self, arguments, program):
        self.program, self.folder = program, arguments.data / "labelled/crazypad"
        rows = list(csv.DictReader((self.folder / "labels.csv").open()))
        self.flights = [self._flight(row) for row in rows]
        self.judged = self.flights[::arguments.every]

    def _flight(self, row):
        cut = {k: sum(map(float, row[f"cut_M{k}_mm"].split("/"))) / 2 if row[f"cut_M{k}_mm"] else 0
               for k in (1, 2, 3)}
        config = SOURCE / "config/import" / f"crazypad_{'motors' if row['kind'] == 'motor' else 'controller'}.yaml"
        path = self.program.convert(self.folder / row["file"], row["file"].split(".")[0], config)
        pair = row["label"].startswith("cut_M2")
        one_blade = re.fullmatch(r"cut_propeller_M3_\dmm", row["label"]) is not None
        return dict(row, path=path, cut=cut, pair=pair, one_blade=one_blade,
                    weak=(1, 2) if pair else (3,))

    def normals(self, flight, logs=None, kind=None):
        return [f["path"] for f in self.flights
                if f["cause"] == "none" and f["vehicle"] == flight["vehicle"] and f is not flight
                and (logs is None or f["log"] in logs) and kind in (None, f["kind"])]

    def campaign(self, flight):
        def label(name):
            return [f["path"] for f in self.flights
                    if f["label"] == name and f["vehicle"] == flight["vehicle"] and f is not flight]
        if flight["pair"]:
            return label(MILDEST["M12"])
        if flight["one_blade"]:
            return self.normals(flight, ("03", "04"), "motor")
        if flight["vehicle"] == "E8" and flight["cut"][3] > 1.5:
            return self.normals(flight, ("00", "01", "02"), "motor")
        return label(MILDEST[flight["vehicle"]])

    def run(self, name, chosen, references, *flags):
        trials = [(f, references(f)) for f in chosen]
        trials = [(f, r) for f, r in trials if r]
        results = self.program.diagnose([(f"{name}/{f['path'].name}", f["path"], r, flags) for f, r in trials])
        return [(f, result) for (f, _), result in zip(trials, results) if result]

    def table(self):
        certain = [f for f in self.judged
                   if f["cause"] == "propeller_cut" and not f["label"].startswith("cut_m3")]
        deep = [f for f in certain if (min(f["cut"][1], f["cut"][2]) >= 1 if f["pair"] else f["cut"][3] >= 1
                                       and (f["one_blade"] is False or f["cut_M3_mm"] == "3/0"))]
        rows = []
        for pair, title in ((False, "M3"), (True, "M1 and M2")):
            found = self.run("campaign", [f for f in deep if f["pair"] == pair], self.campaign)
            right = [set(first(r)) == {1, 2} if pair else first(r)[:1] == [3] for _, r in found]
            exact = [set(first(r)) == set(f["weak"]) for f, r in found]
            named = [set(rotors(r)) == set(f["weak"]) for f, r in found]
            same = [set(rotors(r, "if_same_session")) == set(f["weak"]) for f, r in found]
            wrong = [bool(set(rotors(r)) - set(f["weak"])) for f, r in found]
            rows += [(f"{title} cut by 1/1 mm or more, same campaign: first", share(right), "95 %"),
                     (f"{title}: exactly the cut rotors first", share(exact), ""),
                     (f"{title}: named, session not stated; another rotor named", f"{share(named)}; {share(wrong)}", ""),
                     (f"{title}: would be named with --session=same", share(same), "")]
        large = [f for f in self.judged if f in certain and f["cut"][3] >= 2.5
                 or f["label"] == "add_weight_W3_near_M3"]
        found = self.run("normals", large, self.normals)
        rows.append(("2.5 mm or more, W3 near M3, any normal flights: M3 named", share([rotors(r)[:1] == [3] for _, r in found]), "95 %"))
        rows.append(("the same: M3 and no other", share([rotors(r) == [3] for _, r in found]), ""))
        both = [{"rotor_loss", "payload"} <= {c["id"], *c["confused_with"]}
                for f, r in found for c in r["causes"][:1]]
        rows.append(("cut and load both listed, where M3 is named", share(both), "95 %"))
        normal = [f for f in self.judged if f["cause"] == "none"]
        quiet = []
        for size in (1, 2, 9):
            quiet += self.run(f"null_{size}", normal, lambda f, n=size: [
                p for p in self.normals(f) if self._session(p) != self._session(f["path"])][:n])
        rows.append(("normal flights against other sessions: a cause is named",
                     share([bool(r["causes"]) for _, r in quiet]), "0"))
        mild = [f for f in self.judged if f["cause"] in ("tape_on_propeller", "string_load")
                or f["label"] == "add_weight_W1_near_M4"
                or f["cause"] == "propeller_cut" and max(f["cut"].values()) < 1]
        found = self.run("mild", mild, self.normals)
        rows.append(("tape, light weight, string, cuts below 1 mm: named wrongly", share(
            [bool(r["causes"]) and not {f"M{k}" for k in rotors(r)} <= set(re.split(r"\W+", f["rotors"]))
             for f, r in found]), "2 %"))
        return rows + self._sizes(certain) + self._without(deep, large, normal) + self._seconds()

    def _without(self, deep, large, normal):
        """The same where the usual scatter is learned on the other vehicle alone."""
        def run(name, flights, references):
            return [pair for vehicle, other in (("E8", "E9"), ("E9", "E8")) for pair in self.run(
                f"{name}_without", [f for f in flights if f["vehicle"] == vehicle], references,
                f"--usual_scatter={self._scatter(other)}")]
        cuts, whole = run("campaign", deep, self.campaign), run("normals", large, self.normals)
        quiet = run("null", normal, lambda f: [p for p in self.normals(f) if self._session(p) != self._session(f["path"])])
        first_right = [set(first(r)) == {1, 2} if f["pair"] else first(r)[:1] == [3] for f, r in cuts]
        return [("usual scatter of the other vehicle alone: campaign cuts first; another rotor named", share(first_right)
                 + "; " + share([bool(set(rotors(r)) - set(f["weak"])) for f, r in cuts]), "95 %; 0"),
                ("the same: M3 of 2.5 mm or more named; a normal flight named", share([rotors(r)[:1] == [3] for _, r in whole])
                 + "; " + share([bool(r["causes"]) for _, r in quiet]), "95 %; 0")]

    def _scatter(self, vehicle):
        """For --usual_scatter: of flights of one label, and of normal sessions, by all trims so far."""
        trims = {}
        for file in (self.program.work / "results").glob("*/*/trims.csv"):
            for row in list(csv.reader(file.open()))[1:]:
                trims[Path(row[0]).name] = np.log(np.array(row[4::3], float))
        def sigmas(key, of_means):
            groups = {}
            for f in self.flights:
                if f["vehicle"] == vehicle and f["path"].name in trims and key(f):
                    groups.setdefault(key(f), []).append(trims[f["path"].name])
            if of_means:
                groups = {"": [np.mean(group, 0) for group in groups.values()]}
            deviations = np.concatenate([np.array(group) - np.mean(group, 0) for group in groups.values()])
            freedom, mean = len(deviations) - len(groups), deviations.mean(1)
            own = ((deviations - mean[:, None]) ** 2).sum() / freedom / (deviations.shape[1] - 1)
            common = max(0, (mean ** 2).sum() / freedom - own / deviations.shape[1])
            return f"{np.sqrt(common):.4f},{np.sqrt(own):.4f}"
        within = sigmas(lambda f: f["cause"] != "none" and (f["label"], f["kind"]), False)
        return f"{within},{sigmas(lambda f: f['cause'] == 'none' and self._session(f['path']), True)}"

    def _seconds(self):
        """From recordings to a page, one flight at a time."""
        seconds = []
        for flight in self.judged[::max(1, len(self.judged) // 8)]:
            normals = self.normals(flight, kind=flight["kind"])
            others = [f for f in self.flights if f["path"] in normals]
            start = time.time()
            self.program.diagnose([(f"page/{flight['path'].name}", self.folder / flight["file"],
                                    [self.folder / f["file"] for f in others], ["--report=true"])])
            seconds.append(time.time() - start)
        return [("from recordings to a page", f"{np.median(seconds):.1f} s, at most {max(seconds):.1f} s", "10 s")]

    def _session(self, path):
        """Sessions of the normal flights, by their README; controller logs are taken as further ones."""
        flight = next(f for f in self.flights if f["path"] == path)
        return flight["vehicle"], flight["kind"], {"03": 1, "04": 1, "05": 2, "06": 2}.get(flight["log"], 0)

    def _sizes(self, certain):
        rows, repeats = [], []
        # The one-blade labels of E9 are of another session.
        series = [f for f in certain if not (f["one_blade"] and f["vehicle"] == "E9")]
        found = self.run("sizes", series, lambda f: self.campaign(f) if f["pair"] else self.normals(f))
        def size(flight, result, rotor):
            names = {"+".join(f"u{k}" for k in order) for order in itertools.permutations(flight["weak"])}
            entry = next(c for c in result["candidates"] if c["which"] in names)
            place = entry["which"].split("+").index(f"u{rotor}")
            return entry["estimate"]["factor"][place], entry["sigma_flight"]["factor"][place]
        for vehicle, rotor, wanted in (("E8", 3, 0.90), ("E9", 3, 0.85), ("E9", 1, 0.95), ("E9", 2, 0.90)):
            chosen = [(f, *size(f, r, rotor)) for f, r in found
                      if f["vehicle"] == vehicle and rotor in f["weak"]]
            if len(chosen) > 2:
                def value(of):
                    return -spearmanr([f["cut"][rotor] for f, _, _ in of], [s for _, s, _ in of])[0]
                motors = [c for c in chosen if c[0]["kind"] == "motor"]
                rows.append((f"depth of the cut against the factor, M{rotor} of {vehicle}: Spearman",
                             f"{value(motors):.2f} by motor logs, {value(chosen):.2f} by all", f"{wanted:.2f}"))
            for (a, x, sigma), (b, y, _) in itertools.permutations(chosen, 2):
                if a["label"] == b["label"] and a["kind"] == b["kind"] == "motor":
                    repeats.append(abs(x - y) < 1.96 * np.sqrt(2) * sigma)
        return rows + [("repeats of a label in each other's 95 % interval", share(repeats), "93 to 97 %")]


class Fleet:
    """Crazyswarm: standard and upgraded motors, with the masses that the logs' info files state."""

    def __init__(self, arguments, program):
        self.program, folder = program, arguments.data / "labelled/crazyswarm_thrust"
        self.flights = []
        for row in csv.DictReader((folder / "labels.csv").open()):
            with gzip.open(folder / row["file"], "rt") as file:
                header = file.readline().strip().split(",")
                values = np.loadtxt(file, delimiter=",", usecols=[header.index(n) for n in self._columns(header)])
            name = "crazyswarm_lee" + ("" if "ctrlLee.thrustSi[N]" in header else "_si")
            map_file = arguments.work / f"{name}_{row['mass']}.yaml"
            map_file.write_text((SOURCE / f"config/import/{name}.yaml").read_text()
                                + f"vehicle: {{mass: {row['mass']}}}\n")
            path = program.convert(folder / row["file"], row["file"].split(".")[0], map_file)
            self.flights.append(dict(row, path=path, scale=float(row["mass"]) * self._ratio(values)))
        self.judged = self.flights[::arguments.every]

    @staticmethod
    def _columns(header):
        thrust = next(n for n in header if n.lower().startswith("ctrllee.thrustsi"))
        return ["timestamp[us]", *(f"stateEstimateZ.v{k}[mm/s]" for k in "xyz"), "ctrlLee.rpyx[rad]", "ctrlLee.rpyy[rad]",
                "ctrlLee.rpyz[rad]", thrust]

    @staticmethod
    def _ratio(values):
        """(a + g) along body z over the commanded thrust: regression through zero, 1/kg."""
        t, roll, pitch, yaw, thrust = values[:, 0] * 1e-6, *values[:, 4:].T
        rate = 1 / np.median(np.diff(t))
        v = filtfilt(*butter(2, 5 / (rate / 2)), values[:, 1:4] * 1e-3, axis=0)
        a = np.gradient(v, t, axis=0) + [0, 0, G]
        z = np.stack([np.cos(yaw) * np.sin(pitch) * np.cos(roll) + np.sin(yaw) * np.sin(roll),
                      np.sin(yaw) * np.sin(pitch) * np.cos(roll) - np.cos(yaw) * np.sin(roll),
                      np.cos(pitch) * np.cos(roll)], 1)
        along = (a * z).sum(1)
        return (along @ thrust) / (thrust @ thrust)

    def table(self):
        odd = {"182", "183", "184"}
        standard = [f for f in self.flights if f["hardware"] == "standard" and not f["load"]
                    and not any(f["log"].startswith(f"log{n}") for n in odd)]
        def references(flight):
            """One flight of each of eight other experiments."""
            others = {f["experiment"]: f for f in standard if f["experiment"] != flight["experiment"]}
            return list(others.values())[::max(1, len(others) // 8)]
        chosen = [(f, references(f)) for f in self.judged]
        results = self.program.diagnose([(f"fleet/{f['path'].name}", f["path"], [r["path"] for r in refs],
                                          ()) for f, refs in chosen])
        judged = [(f, refs, r) for (f, refs), r in zip(chosen, results) if r]
        def named(result):
            return [c["parameters"]["s"]["value"] for c in result["causes"] if c["id"] == "thrust_scale"]
        upgraded = [(f, refs, r) for f, refs, r in judged if f["hardware"] == "upgraded"]
        errors = [(1 + named(r)[0]) / (f["scale"] / np.mean([x["scale"] for x in refs])) - 1
                  for f, refs, r in upgraded if named(r)]
        rows = [("fleet, upgraded motors: thrust_scale named", share([bool(named(r)) for _, _, r in upgraded]), "99 %"),
                ("its size within 2 % of the regression", share([abs(e) < 0.02 for e in errors]), "all"),
                ("standard motors: named; verdict clean", share([bool(named(r)) for f, _, r in judged if f in standard])
                 + "; " + share([r["verdict"] == "clean" for f, _, r in judged if f in standard]), "0; all")]
        for f, _, r in judged:
            if f["load"] or any(f["log"].startswith(f"log{n}") for n in odd):
                text = r["causes"][0]["text"] if r["causes"] else "nothing named"
                rows.append((f"{f['log']} ({f['load'] or 'odd'})", text, ""))
        if no_result := [f["log"] for (f, _), r in zip(chosen, results) if not r]:
            rows.append(("no steady flight", ", ".join(no_result), ""))
        return rows


class Full:
    """Full logs against each other: NanoBench's ovals, trefoil and figure of eight."""

    def __init__(self, arguments, program):
        self.program = program
        self.logs = [program.convert(f, f.stem, SOURCE / "config/import/nanobench.yaml")
                     for f in sorted((arguments.data / "nanobench").glob("*.csv"))]

    def table(self):
        pairs = list(itertools.permutations(self.logs, 2))
        results = self.program.diagnose([(f"full/{a.name}_{b.name}", a, [b], ()) for a, b in pairs])
        return [("NanoBench flights against each other, by trim: a cause is named",
                 share([bool(r["causes"]) for r in results if r]), "2 %")]


def main():
    arguments = parse()
    arguments.work.mkdir(parents=True, exist_ok=True)
    program, rows, start = Program(arguments), [], time.time()
    for name, kind in (("cuts", Cuts), ("fleet", Fleet), ("full", Full)):
        if name in arguments.only.split(","):
            rows += kind(arguments, program).table()
    text = "| measured on labelled flights | result | wanted |\n|---|---|---|\n"
    text += "".join(f"| {' | '.join(row)} |\n" for row in rows)
    (arguments.work / "labelled.md").write_text(text)
    print(text + f"\n{time.time() - start:.0f} s")


if __name__ == "__main__":
    main()
