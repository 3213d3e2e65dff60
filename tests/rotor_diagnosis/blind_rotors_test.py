#!/usr/bin/python3
"""The small blind set for the model driven by rotor speeds."""
import os
import sys
from pathlib import Path

sys.path.insert(0, str(Path(os.environ["TRUELINE_TEST_SOURCE_DIR"]) / "tests/diagnosis"))
sys.dont_write_bytecode = True

from blind_test import main

main("--drive=rotors", "--seed=2026")
