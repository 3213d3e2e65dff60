"""A foreign log made from a simulated one: the CSV files of its streams, and a map that reads them."""

MAP = """name: made
dataset: made by scripts/knocks
inputs:
  imu: {time: {column: 1, unit: s}}
  attitude: {time: {column: 1, unit: s}}
  fixes: {time: {column: 1, unit: s}}
  mocap: {time: {column: 1, unit: s}}
earth: NED
body: FRD
streams:
  imu:
    accel: {columns: [2, 3, 4], unit: m/s^2}
    gyro: {columns: [5, 6, 7], unit: rad/s}
  attitude: {input: attitude, quaternion: {w: 2, x: 3, y: 4, z: 5}}
  fixes:
    input: fixes
    position: {columns: [2, 3, 4], unit: m}
    sigma: {column: 5}
    gate: {column: 6}
  mocap:
    input: mocap
    position: {columns: [2, 3, 4], unit: m}
    quaternion: {w: 5, x: 6, y: 7, z: 8}
"""
STREAMS = ["imu", "attitude", "fixes", "mocap"]


def inputs_of(log):
    """The value of --in for a folder with these streams."""
    return ",".join(str(log / f"{stream}.csv") for stream in STREAMS)


def write_map(path):
    path.write_text(MAP)
    return path
