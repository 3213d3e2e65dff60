"""The path of a calibration as a TUM file, for evo and its like: t x y z qx qy qz qw."""
from pathlib import Path

from page import Document
from path_of_result import log_of, read_path, unwrapped
from yaml_file import read_mapping


def add_arguments(parser):
    parser.add_argument("--log", type=Path, help="the native log it was made from; default: as it states")


def build(arguments):
    result = read_mapping(arguments.result / "calibration.yaml")
    path, source = read_path(arguments.result, log_of(arguments, result))
    return Trajectory(path, source)


class Trajectory(Document):
    def __init__(self, path, source):
        self.path, self.source = path, source

    def render(self):
        q = unwrapped(self.path[["qw", "qx", "qy", "qz"]])
        lines = [f"# Path fitted by Trueline in north-east-down, m; attitude {self.source}, body to earth",
                 "# t x y z qx qy qz qw"]
        for row, (w, x, y, z) in zip(self.path.itertuples(), q):
            lines.append(f"{row.t:.6f} {row.x:.6f} {row.y:.6f} {row.z:.6f} {x:.9f} {y:.9f} {z:.9f} {w:.9f}")
        return "\n".join(lines) + "\n"
