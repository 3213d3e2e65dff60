#!/usr/bin/python3
"""Writes config/reference: lists of what the programs know, from the programs and their sources.

    reference.py [--build=build] [--out=config/reference] [--check]

With --check nothing is written: exit code 1 where a committed list differs from what the code says, or
where an option, finding or stream lacks a description in describe.yaml.
"""
import argparse
import fnmatch
import json
import re
import subprocess
import sys
from pathlib import Path

import yaml

ROOT = Path(__file__).resolve().parents[2]
VERBS = ("convert inspect calibrate diagnose simulate effects observe design export audit benchmark").split()
MADE = "<!-- Made by scripts/handbook/reference.py; do not edit. -->\n"
UNITS = {"_rad_per_s": "rad/s", "_deg_per_s": "deg/s", "_deg_per_sqrt_s": "deg/sqrt(s)", "_per_s2": "1/s^2",
         "_mps2_per_sqrt_hz": "m/s^2/sqrt(Hz)", "_mps2_per_sqrt_s": "m/s^2/sqrt(s)", "_per_s": "1/s",
         "_mps2": "m/s^2", "_mps": "m/s", "_radps": "rad/s", "_deg": "deg", "_hz": "Hz", "_m": "m", "_s": "s",
         "_sigmas": "sigma"}


class Lacking(Exception):
    """What has no description, or a description of what there is not."""


def table(headers, rows):
    lines = [headers, ["---"] * len(headers), *rows]
    return "".join("| " + " | ".join(str(cell).replace("|", "\\|") for cell in line) + " |\n" for line in lines)


def described(kind, names, descriptions):
    """Raises Lacking unless exactly these names are described."""
    lacking = [n for n in names if n not in descriptions]
    stale = [n for n in descriptions if n not in names]
    if lacking or stale:
        raise Lacking(f"{kind}: without a description in scripts/handbook/describe.yaml: "
                      f"{', '.join(lacking) or 'none'}; described but not in the code: {', '.join(stale) or 'none'}")


class Programs:
    def __init__(self, build):
        self.folder = build / "apps"

    def say(self, verb, *flags):
        return subprocess.run([self.folder / f"trueline-{verb}", *flags], check=True, capture_output=True,
                              text=True).stdout


def commands(programs, _):
    text = "# Commands\n\n`trueline VERB` is the same as `trueline-VERB`.\n"
    for verb in VERBS:
        told = programs.say(verb, "--help").rstrip()
        if bare := re.findall(r"^  (--\w+) +\(default", told, re.M):
            raise Lacking(f"commands: trueline-{verb}: {', '.join(bare)} lacks its meaning")
        text += f"\n## trueline-{verb}\n\n```text\n{told}\n```\n"
    return text


def effects(programs, _):
    text = "# Effects\n\nWhat a diagnosis can name, and a simulated flight can have (key `effects`).\n"
    for drive, title in (("imu", "Seen by the model that the IMU drives"),
                         ("rotors", "Seen by the model that rotor speeds drive")):
        rows = []
        for effect in yaml.safe_load(programs.say("effects", "--yaml", f"--drive={drive}")):
            for key in ("physics", "definition", "shown_by"):
                if not effect.get(key) and effect["id"] != "term":
                    raise Lacking(f"effects: {effect['id']} lacks '{key}' in its declaration")
            sizes = ", ".join(f"`{name}` [{unit}]" for name, unit in effect["parameters"].items())
            rows.append([f"`{effect['id']}`", sizes, effect["physics"], effect["definition"],
                         effect.get("shown_by", "")])
        text += f"\n## {title}\n\n" + table(["effect", "parameters", "what it is", "defined as", "shown by"], rows)
    return text


def flat(node, path=""):
    """(path, value) of every option in a tree of them."""
    if isinstance(node, dict) and node:
        for key, value in node.items():
            yield from flat(value, f"{path}.{key}" if path else key)
    else:
        yield path, node


def comments(file):
    """{path: comment} of a YAML file whose keys stand one a line, the comment behind them."""
    found, stack, last = {}, [], None
    for line in file.read_text().splitlines():
        key = re.match(r"( *)([\w.]+):", line)
        if key:
            stack = [(depth, name) for depth, name in stack if depth < len(key[1])] + [(len(key[1]), key[2])]
            last = ".".join(name for _, name in stack)
            comment = re.search(r"\s#\s*(.*)", line[key.end():])
            if comment:
                found[last] = comment[1]
        elif last in found and (more := re.match(r" {8,}#\s*(.*)", line)):
            found[last] += " " + more[1]
        else:
            last = None
    return found


def unit_of(path):
    return next((unit for suffix, unit in UNITS.items() if path.endswith(suffix)), "")


def option_rows(options, file, used):
    told, patterns = comments(file), yaml.safe_load((ROOT / "scripts/handbook/describe.yaml").read_text())["options"]
    rows, lacking = [], []
    for path, value in options:
        pattern = next((p for p in patterns if fnmatch.fnmatchcase(path, p) and p.count(".") == path.count(".")), None)
        used.add(pattern)
        meaning = told.get(path) or (patterns[pattern] if pattern else None)
        if not meaning:
            lacking.append(path)
        default = json.dumps(value) if isinstance(value, (list, dict, bool)) else f"{value:.6g}" \
            if isinstance(value, float) else value
        rows.append([f"`{path}`", f"`{default}`", unit_of(path), meaning])
    if lacking:
        raise Lacking(f"options: {', '.join(lacking)}: no comment in {file.relative_to(ROOT)} and no description in "
                      "scripts/handbook/describe.yaml")
    return rows


def options(programs, describe):
    text = ("# Options of calibration and diagnosis\n\nKeys of a `--config` file, with the values of "
            "`trueline calibrate --show_config`.\n")
    used = set()
    for drive, file in (("imu", "default.yaml"), ("rotors", "rotors.yaml")):
        tree = yaml.safe_load(programs.say("calibrate", "--show_config", f"--drive={drive}"))
        rows = option_rows(flat(tree), ROOT / "config/calibrate" / file, used)
        text += f"\n## `--drive={drive}` ([{file}](../calibrate/{file}))\n\n"
        text += table(["option", "default", "unit", "meaning"], rows)
    if stale := [pattern for pattern in describe["options"] if pattern not in used]:
        raise Lacking(f"options: described but not in the code: {', '.join(stale)}")
    return text


def findings(_, __):
    source = (ROOT / "problems/inspection/fault.h").read_text()
    kinds = re.findall(r'((?:// .*\n)*)inline constexpr FaultKind k\w+\{"(\w+)"', source)
    texts = {name: comment.replace("\n// ", " ")[3:].strip() for comment, name in reversed(kinds)}
    if bare := [name for name, text in texts.items() if not text]:
        raise Lacking(f"findings: {', '.join(bare)} lacks its comment in problems/inspection/fault.h")
    rows = [[f"`{name}`", *(part.rstrip(".") for part in (text + " Repaired: ").split(" Repaired: ")[:2])]
            for name, text in reversed(texts.items())]
    return ("# Findings of an inspection\n\nEach comes with a level, a size, its sigma and a remedy;\n"
            "[how it is decided](../handbook/inspection.md).\n\n" +
            table(["finding", "what it says", "what corrected_map.yaml does"], rows))


def terms(_, __):
    source = (ROOT / "problems/effects/term.cc").read_text()
    quantities = re.findall(r'\{k\w+, "(\w+)", "([^"]*)", "([^"]*)", \d, \{([^}]*)\}\}', source)
    places = re.findall(r'\{"(\w+)", TermOn::k(\w+), \d\}', source)
    if len(quantities) < 10 or len(places) < 10:
        raise Lacking("terms: the tables of problems/effects/term.cc are not as expected")
    if bare := [symbol for symbol, words, *_ in quantities if not words]:
        raise Lacking(f"terms: {', '.join(bare)} lacks its words in problems/effects/term.cc")
    units = {"Force": "m/s^2", "Turn": "rad/s^2", "Attitude": "rad", "Fix": "m"}
    numbers = {"x": "beyond this, m", "y": "beyond this, m", "h": "beyond this, m", "T": "less this, m/s^2",
               "U": "above this, V", "t": "middle and half width, s", "sin": "psi, or 2*psi", "cos": "psi, or 2*psi",
               "place": "north, east; radius, m", "slope_north": "north, east; radius, m",
               "slope_east": "north, east; radius, m"}
    return ("# Terms of the open catalogue\n\nA term is `size` times a product of quantities, added `where` the model "
            "lacks it\n([how they are found](../handbook/diagnosis.md#the-open-catalogue)).\n\n## Where\n\n" +
            table(["where", "unit of the size, over that of the product"], [[f"`{w}`", units[on]] for w, on in places]) +
            "\n## With\n\n" +
            table(["symbol", "quantity", "unit", "numbers in brackets"],
                  [[f"`{symbol}`", re.sub(r"\{.*?\}", "the number", words).strip(), unit, numbers.get(symbol, "")]
                   for symbol, words, unit, _ in quantities]) +
            "\n`abs(r)` is the size of a quantity, `lag(q;0.3)` its low-pass of 0.3 s, `q*v_x` a product.\n")


def map_keys(_, __):
    header = (ROOT / "problems/import/import_map.h").read_text().split("\nnamespace ")[0]
    block = "\n".join(line[2:].removeprefix(" ") for line in header.splitlines()
                      if line.startswith("//"))
    names = set(re.findall(r"[a-z_]{2,}", block))
    sources = "\n".join((ROOT / "problems/import" / name).read_text() for name in ("import_map.cc", "stream_import.cc"))
    keys = set(re.findall(r'(?:Get<[^>]*>|Has|Child|Children|GetChoice|Get\w*)\(\s*"([a-z_]{2,})"', sources))
    if lacking := sorted(keys - names):
        raise Lacking(f"map keys: {', '.join(lacking)}: not in the head of problems/import/import_map.h")
    return ("# Keys of a column map\n\nFrom the head of [import_map.h](../../problems/import/import_map.h);\n"
            "[what a map is](../../problems/import/README.md).\n\n```yaml\n" + block + "\n```\n")


FIELD = re.compile(r'Field\{"(\w*)", \{([^}]*)\}(?:, "([^"]*)")?')


def streams(_, describe):
    header = (ROOT / "problems/log/flight_log.h").read_text()
    attitude = FIELD.search(header.replace("kAttitudeField{", 'Field{', 1))
    samples = {}
    for name, body in re.findall(r"struct (\w+) \{\n(.*?)\n\};", header, re.S):
        body = body.replace("archive(kAttitudeField", f"archive({attitude[0]}")
        samples[name] = [(re.findall(r'"(\w+)"', columns), unit or "1") for _, columns, unit in FIELD.findall(body)]
    types = dict((name, kind) for kind, name in re.findall(r"std::vector<(\w+)> (\w+);", header))
    rows, names = [], []
    for name, columns, unit in re.findall(r'visit\(Stream\{"(\w+)"(?:, \{"", \{"(\w+)"\}(?:, "([^"]*)")?\})?\}', header):
        names.append(name)
        fields = samples[types[name]] or [([columns + ("1, " + columns + "2, ..." if name in ("rotors", "motors") else "")],
                                           unit or "1")]
        if name in ("rotors", "motors"):
            fields = [([f"{columns}1", "..."], unit or "1")]
        told = ", ".join(f"{' '.join(c)} [{u}]" for c, u in fields)
        rows.append([f"`{name}.csv`", f"`t [s]`, {told}", describe["streams"].get(name, "")])
    described("streams", names, describe["streams"])
    return ("# Streams of a native log\n\nEarth axes are north-east-down, body axes forward-right-down; "
            "[the folder](../../problems/log/README.md).\n\n" + table(["file", "columns", "what it holds"], rows))


def field_rows(schema, root, path=""):
    """(path, type, description) of all that a schema states, without what it names twice."""
    if "$ref" in schema:
        yield from ()
        return
    for key, value in schema.get("properties", {}).items():
        here = f"{path}.{key}" if path else key
        ref = value.get("$ref", "").split("/")[-1]
        items = value.get("items", {}) if isinstance(value.get("items"), dict) else {}
        of_map = value.get("additionalProperties") if isinstance(value.get("additionalProperties"), dict) else {}
        ref = ref or items.get("$ref", "").split("/")[-1] or of_map.get("$ref", "").split("/")[-1]
        if "description" not in value and not ref:
            raise Lacking(f"{root['title']}: {here} lacks a description in config/schema")
        kind = " \\| ".join(map(str, value["enum"])) if "enum" in value else \
            "list" if value.get("type") == "array" else "" if value.get("type") == "object" else \
            value.get("type", "") if isinstance(value.get("type"), str) else ""
        yield here, kind, value.get("description", "") + (f" (see *{ref}*)" if ref else "")
        yield from field_rows(value, root, here)
        yield from field_rows(items, root, here + "[]")
        yield from field_rows(of_map, root, here + ".NAME")


def column_described(head, describe):
    """Whether a column of a result's CSV file, as `name [unit]` in its head, has a description."""
    return any(fnmatch.fnmatchcase(head.split(" [")[0], pattern) for pattern in describe["columns"])


def results(_, describe):
    text = ("# Fields of result files\n\nEach file has a JSON schema in `config/schema`; tests hold real results "
            "against it.\n")
    for file in sorted((ROOT / "config/schema").glob("*.schema.json")):
        schema = json.loads(file.read_text())
        text += f"\n## {schema['title']}\n\n{schema['description'].capitalize()}; [schema](../schema/{file.name}).\n\n"
        rows = [[f"`{p}`", k.replace("\\|", "or"), d] for p, k, d in field_rows(schema, schema)]
        text += table(["field", "kind", "meaning"], rows)
        for name, part in schema.get("$defs", {}).items():
            rows = [[f"`{p}`", k.replace("\\|", "or"), d] for p, k, d in field_rows(part, schema)]
            text += f"\n*{name}*\n\n" + table(["field", "kind", "meaning"], rows)
    text += "\n## CSV files\n\n" + table(["file", "a row is"], [[f"`{n}.csv`", t] for n, t in describe["tables"].items()])
    return text + "\n" + table(["column", "meaning"], [[f"`{n}`", told] for n, told in describe["columns"].items()])


PAGES = {"commands": commands, "options": options, "effects": effects, "findings": findings, "terms": terms,
         "map": map_keys, "streams": streams, "results": results}


def pages(build):
    describe = yaml.safe_load((ROOT / "scripts/handbook/describe.yaml").read_text())
    programs, made, lacking = Programs(build), {}, []
    for name, make in PAGES.items():
        try:
            made[f"{name}.md"] = MADE + make(programs, describe)
        except Lacking as error:
            lacking.append(str(error))
    titles = {name: text.split("# ", 1)[1].split("\n")[0] for name, text in made.items()}
    made["README.md"] = (MADE + "# Reference\n\nLists that are made from the programs and their sources. A test fails "
                         "where they differ.\n\n" + "".join(f"- [{title}]({name})\n" for name, title in titles.items()))
    return made, lacking


def main(argv):
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--build", type=Path, default=ROOT / "build")
    parser.add_argument("--out", type=Path, default=ROOT / "config/reference")
    parser.add_argument("--check", action="store_true", help="write nothing; fail where a list differs")
    arguments = parser.parse_args(argv)
    made, problems = pages(arguments.build)
    for name, text in made.items():
        path = arguments.out / name
        if not arguments.check:
            path.parent.mkdir(parents=True, exist_ok=True)
            path.write_text(text)
        elif not path.exists() or path.read_text() != text:
            problems.append(f"{path}: differs from what the code says; run scripts/handbook/reference.py")
    print("\n".join(problems) or f"reference: {len(made)} pages {'agree' if arguments.check else 'written'}")
    return bool(problems)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
