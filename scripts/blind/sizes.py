"""Sizes of the effects that the blind sets hide, as the declarations state them."""
import subprocess

import yaml


def drawn_effects(build, drive):
    """{id: {parameter: (low, high, either sign)}} of the effects that are hidden, in declared order.
    Sizes are drawn log-uniformly. They range from undetectable to a few times the detectable size;
    pairs of the IMU-driven set use the upper half."""
    listed = subprocess.run([build / "apps/trueline-effects", "--yaml", f"--drive={drive}"],
                            capture_output=True, text=True, check=True).stdout
    return {effect["id"]: {name: (size["low"], size["high"], size["either_sign"])
                           for name, size in effect["drawn"].items()}
            for effect in yaml.safe_load(listed) if "drawn" in effect}
