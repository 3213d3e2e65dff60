"""Follows the tutorial of Betaflight: two files by one map, and the hidden scale of the accelerometer is named."""
import sys
import unittest

sys.dont_write_bytecode = True

from tutorial import Tutorial


class Betaflight(Tutorial):
    page = "betaflight.md"


del Tutorial  # so that unittest runs the subclass alone

if __name__ == "__main__":
    unittest.main()
