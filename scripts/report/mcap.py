"""A calibration or diagnosis as an MCAP file: opens in Foxglove, PlotJuggler and Rerun.

Messages are JSON. What can be drawn has Foxglove's schemas, in the frame `earth` (north-east-down) below
`world` (z up); numbers over time have schemas of their own, with units in their descriptions.
"""
import math
from pathlib import Path

import numpy as np

from charts import decimate
from csv_table import read_table
from errors import ReportError
from mcap_file import McapFile
from page import Document
from path_of_result import log_of, read_path, unwrapped
from yaml_file import read_mapping

MOST_POSES = 4000
CHI_SQUARE_95 = 5.991  # of two degrees of freedom
NED_IN_WORLD = {"x": math.sqrt(0.5), "y": math.sqrt(0.5), "z": 0.0, "w": 0.0}
COLOURS = {"fit": (0.12, 0.44, 0.92), "prediction": (0.88, 0.48, 0.0)}
LEVELS = {"cause": 3, "set aside": 2, "verdict": 2}  # of foxglove.Log: 2 info, 3 warning


def add_arguments(parser):
    parser.add_argument("--log", type=Path, help="the native log it was made from; default: as it states")


def build(arguments):
    for name, add in (("calibration", _calibration), ("diagnosis", _diagnosis)):
        path = arguments.result / f"{name}.yaml"
        if path.exists():
            result = read_mapping(path)
            file = McapFile()
            add(file, result, arguments.result, log_of(arguments, result))
            return Recording(file)
    raise ReportError(f"{arguments.result}: holds neither calibration.yaml nor diagnosis.yaml")


class Recording(Document):
    def __init__(self, file):
        self.file = file

    def render(self):
        return self.file.content()


def _ns(seconds):
    return round(1e9 * float(seconds))


def _stamp(seconds):
    return dict(zip(("sec", "nsec"), divmod(_ns(seconds), 1_000_000_000)))


def _object(**properties):
    return {"type": "object", "properties": properties}


def _array(items):
    return {"type": "array", "items": items}


def _number(description):
    return {"type": "number", "description": description}


TEXT = {"type": "string"}
TIME = _object(sec={"type": "integer"}, nsec={"type": "integer"})
VECTOR = _object(**{axis: {"type": "number"} for axis in "xyz"})
QUATERNION = _object(**{axis: {"type": "number"} for axis in "xyzw"})
POSE = _object(position=VECTOR, orientation=QUATERNION)
COLOUR = _object(**{c: {"type": "number"} for c in "rgba"})
LINE = _object(type={"type": "integer"}, pose=POSE, thickness={"type": "number"}, scale_invariant={"type": "boolean"},
               points=_array(VECTOR), color=COLOUR, colors=_array(COLOUR), indices=_array({"type": "integer"}))
ENTITY = _object(timestamp=TIME, frame_id=TEXT, id=TEXT, lifetime=TIME, frame_locked={"type": "boolean"},
                 metadata=_array(_object(key=TEXT, value=TEXT)), lines=_array(LINE))
SCHEMAS = {
    "foxglove.FrameTransform": _object(timestamp=TIME, parent_frame_id=TEXT, child_frame_id=TEXT, translation=VECTOR,
                                       rotation=QUATERNION),
    "foxglove.PosesInFrame": _object(timestamp=TIME, frame_id=TEXT, poses=_array(POSE)),
    "foxglove.PoseInFrame": _object(timestamp=TIME, frame_id=TEXT, pose=POSE),
    "foxglove.SceneUpdate": _object(deletions=_array(_object()), entities=_array(ENTITY)),
    "foxglove.Log": _object(timestamp=TIME, level={"type": "integer"}, message=TEXT, name=TEXT, file=TEXT,
                            line={"type": "integer"}),
    "trueline.Velocity": _object(**{axis: _number("m/s, earth axes") for axis in ("north", "east", "down")}),
    "trueline.Residual": _object(gate=_number("id"), weight=_number("of the robust loss"),
                                 **{f"r_{axis}": _number("m, fix less path") for axis in "xyz"},
                                 sigma=_number("m, of the detector")),
    "trueline.Arc": _object(final_point_error=_number("m"), predicted_sigma=_number("m")),
    "trueline.Estimate": _object(value=_number("in the unit"), sigma=_number("one standard deviation"), unit=TEXT,
                                 status=TEXT),
    "trueline.Misfit": _object(**{f"{axis}_{when}": _number(f"m, open-loop error {when} the causes")
                                  for axis in ("north", "east", "down") for when in ("before", "after")}),
}


def _add(file, topic, schema, seconds, content):
    """JSON knows no NaN: a number that is not there is null."""
    known = {key: None if isinstance(value, float) and not math.isfinite(value) else value
             for key, value in content.items()}
    file.add(topic, schema, SCHEMAS[schema], _ns(seconds), known)


def _frame(file, start):
    _add(file, "/tf", "foxglove.FrameTransform", start,
         {"timestamp": _stamp(start), "parent_frame_id": "world", "child_frame_id": "earth",
          "translation": {"x": 0.0, "y": 0.0, "z": 0.0}, "rotation": NED_IN_WORLD})


def _vector(x, y, z=0.0):
    return {"x": float(x), "y": float(y), "z": float(z)}


def _pose(position, quaternion=(1.0, 0.0, 0.0, 0.0)):
    return {"position": _vector(*position), "orientation": dict(zip("wxyz", map(float, quaternion)))}


def _calibration(file, result, folder, log):
    path, _ = read_path(folder, log)
    _frame(file, path.t.iloc[0])
    shown = decimate(path, MOST_POSES)
    poses = []
    for row, q in zip(shown.itertuples(), unwrapped(shown[["qw", "qx", "qy", "qz"]])):
        poses.append(_pose((row.x, row.y, row.z), q))
        _add(file, "/pose", "foxglove.PoseInFrame", row.t,
             {"timestamp": _stamp(row.t), "frame_id": "earth", "pose": poses[-1]})
        _add(file, "/velocity", "trueline.Velocity", row.t, {"north": row.vx, "east": row.vy, "down": row.vz})
    _add(file, "/path", "foxglove.PosesInFrame", path.t.iloc[0],
         {"timestamp": _stamp(path.t.iloc[0]), "frame_id": "earth", "poses": poses})
    _parameters(file, folder, str(result.get("estimator", "")), result.get("gamma", 0))
    for name, add in (("arcs", _arcs), ("residuals", _residuals)):
        if (folder / f"{name}.csv").exists():
            add(file, folder, str(result["estimator"]), result["gamma"], path)
    reasons = [f"verdict: {result['verdict']}", *(result.get("reasons") or []), *(result.get("unobservable") or [])]
    _notes(file, path.t.iloc[0], [("verdict", text) for text in reasons])


def _reported(table, estimator, gamma):
    return table[(table.estimator == estimator) & (table.gamma == gamma)]


def _parameters(file, folder, estimator, gamma):
    windows = read_table(folder / "windows.csv", ["gamma", "t_end", "value", "sigma"],
                         ["estimator", "parameter", "unit", "status"])
    chosen = windows[(windows.estimator == estimator) & (windows.gamma == gamma)]
    if len(set(chosen.t_end)) < 2:  # of rotors the filter's history, beside the batch's one estimate
        chosen = windows[windows.gamma == gamma]
    for row in chosen.itertuples():
        if math.isfinite(row.value) and math.isfinite(row.sigma):
            _add(file, f"/parameters/{row.estimator}/{row.parameter}", "trueline.Estimate", row.t_end,
                 {"value": row.value, "sigma": row.sigma, "unit": row.unit, "status": row.status})


def _ellipse(arc, down):
    """The 95 % ellipse about the predicted end of an arc, level, as points."""
    values, axes = np.linalg.eigh([[arc.cov_xx, arc.cov_xy], [arc.cov_xy, arc.cov_yy]])
    turn = np.linspace(0.0, 2.0 * math.pi, 33)
    circle = np.stack([np.cos(turn), np.sin(turn)])
    points = axes @ (np.sqrt(CHI_SQUARE_95 * np.maximum(values, 0.0))[:, None] * circle)
    return [_vector(arc.x_predicted + x, arc.y_predicted + y, down) for x, y in points.T]


def _arcs(file, folder, estimator, gamma, path):
    columns = ["gamma", "tau", "t_end", "final_point_error", "predicted_sigma", "x_predicted", "y_predicted", "cov_xx",
               "cov_xy", "cov_yy"]
    for arc in _reported(read_table(folder / "arcs.csv", columns, ["estimator"]), estimator, gamma).itertuples():
        if math.isfinite(arc.final_point_error):
            _add(file, "/arcs", "trueline.Arc", arc.t_end,
                 {"final_point_error": arc.final_point_error, "predicted_sigma": arc.predicted_sigma})
        down = np.interp(arc.t_end, path.t, path.z)
        line = {"type": 0, "pose": _pose((0.0, 0.0, 0.0)), "thickness": 2.0, "scale_invariant": True,
                "points": _ellipse(arc, down), "color": dict(zip("rgba", (*COLOURS["prediction"], 1.0))), "colors": [],
                "indices": []}
        entity = {"timestamp": _stamp(arc.t_end), "frame_id": "earth", "id": f"arc {arc.tau:g}",
                  "lifetime": {"sec": 0, "nsec": 0}, "frame_locked": False, "metadata": [], "lines": [line]}
        _add(file, "/ellipses", "foxglove.SceneUpdate", arc.t_end, {"deletions": [], "entities": [entity]})


def _residuals(file, folder, estimator, gamma, _):
    columns = ["gamma", "tau", "t", "gate", "r_x", "r_y", "r_z", "sigma", "weight"]
    rows = _reported(read_table(folder / "residuals.csv", columns, ["estimator"]), estimator, gamma)
    for row in rows.drop_duplicates("t").itertuples():
        _add(file, "/residuals", "trueline.Residual", row.t,
             {name: getattr(row, name) for name in ("gate", "r_x", "r_y", "r_z", "sigma", "weight")})


def _diagnosis(file, result, folder, _):
    rows = read_table(folder / "residuals.csv", ["t"], ["kind"])
    start = rows.t.min() if len(rows) else 0.0
    _frame(file, start)
    notes = [("verdict", f"verdict: {result['verdict']}: {result.get('meaning', '')}")]
    for kind, key in (("cause", "causes"), ("set aside", "set_aside")):
        for cause in result.get(key) or []:
            sizes = ", ".join(f"{name} = {p['value']:.4g}" + (f" +- {p['sigma']:.2g}" if "sigma" in p else "")
                              + f" {p['unit']}" for name, p in cause["parameters"].items())
            notes.append((kind, f"{cause['id']}: {sizes} {cause.get('because', '')}".strip()))
    notes += [("cause", term["text"]) for term in result.get("terms") or []]
    notes += [("verdict", f"next: {step}") for step in result.get("next") or []]
    _notes(file, start, notes)
    if (folder / "misfit.csv").exists():
        _misfit(file, folder)


def _misfit(file, folder):
    columns = list(SCHEMAS["trueline.Misfit"]["properties"])
    rows = read_table(folder / "misfit.csv", ["t", "horizon", *columns])
    for row in rows.itertuples():
        _add(file, f"/misfit/{row.horizon:g}_s", "trueline.Misfit", row.t,
             {name: getattr(row, name) for name in columns})


def _notes(file, start, notes):
    for kind, message in notes:
        _add(file, "/causes", "foxglove.Log", start,
             {"timestamp": _stamp(start), "level": LEVELS[kind], "message": message, "name": kind, "file": "", "line": 0})
