"""The truth beside a simulated log, LOG.truth.yaml, for pages that compare with it."""
import math
from pathlib import Path

from tables import as_number
from yaml_file import read_mapping

BIASES = {"accel_bias": ("b_ax", "b_ay", "b_az"), "gyro_bias": ("b_gx", "b_gy", "b_gz")}


def read_truth(log):
    """True values by parameter, in SI; empty where no such file lies beside the log. A drifting
    AHRS error or bias is given by its mean."""
    path = Path(log).resolve()
    path = path.with_name(path.name + ".truth.yaml")
    if not path.exists():
        return {}
    content = read_mapping(path)
    values = {name: as_number(entry.get("value"))
              for name, entry in (content.get("parameters") or {}).items()
              if isinstance(entry, dict)}
    for key, names in BIASES.items():
        vector = (content.get("imu") or {}).get(key) or []
        values.update({name: as_number(value) for name, value in zip(names, vector)})
    return {name: value for name, value in values.items() if math.isfinite(value)}
