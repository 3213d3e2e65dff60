"""Each verb with two inputs and one folder to write in."""
import subprocess
from dataclasses import dataclass
from pathlib import Path

from foreign import inputs_of, write_map

SECONDS = 15  # of flight, in all inputs
EXPERIMENT = """name: Two flights
about: for scripts/knocks
simulations:
  - {{config: {source}/config/simulate/hippodrome.yaml, overrides: {{duration: {seconds}}}}}
seeds: {{first: {k}, count: 2}}
estimators:
  - {{name: vgd, label: VGD}}
gammas: [3]
"""


@dataclass
class Verb:
    name: str
    commands: list   # two, which write different results
    out: Path
    last_file: str   # written last, before the result takes its place


def make_inputs(apps, source, work):
    """Two flights, the map that converts their files again, configurations of short runs."""
    work.mkdir(parents=True, exist_ok=True)
    write_map(work / "map.yaml")
    design = (source / "config/design/quick.yaml").read_text()
    (work / "design.yaml").write_text(design.replace("iterations: 5", "iterations: 1"))
    for k in (1, 2):
        (work / f"experiment{k}.yaml").write_text(
            EXPERIMENT.format(source=source, seconds=SECONDS, k=k))
        subprocess.run([apps / "trueline-simulate", f"--out={work}/log{k}", f"--seed={k}",
                        f"--config={source}/config/simulate/hippodrome.yaml",
                        f"--duration={SECONDS}", "--quiet"], check=True)


def verbs(apps, source, work):
    def two(name, program, last_file, *flags):
        """`flags` with {k} for the number of the input."""
        out = work / f"out_{name}"
        commands = [[apps / f"trueline-{program}", f"--out={out}", "--quiet"] +
                    [str(flag).format(k=k) for flag in flags] for k in (1, 2)]
        return Verb(name, commands, out, last_file)

    log, plain, manifest = f"--log={work}/log{{k}}", "--report=false", "manifest.yaml"
    return [
        two("simulate", "simulate", "log.yaml", "--seed={k}", f"--duration={SECONDS}",
            f"--config={source}/config/simulate/hippodrome.yaml"),
        two("convert", "convert", "log.yaml", f"--map={work}/map.yaml",
            f"--in={inputs_of(work / 'log{k}')}"),
        two("inspect", "inspect", manifest, log, plain),
        two("calibrate", "calibrate", manifest, log, "--gamma_sweep=", plain),
        two("report", "calibrate", manifest, log, "--gamma_sweep="),
        two("diagnose", "diagnose", manifest, log, plain),
        two("observe", "observe", manifest, log, plain),
        two("design", "design", manifest, f"--config={work}/design.yaml", "--seed={k}", plain),
        two("benchmark", "benchmark", manifest, f"--config={work}/experiment{{k}}.yaml",
            "--times=false", plain),
    ]
