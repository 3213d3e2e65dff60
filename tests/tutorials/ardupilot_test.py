"""Follows the tutorial of ArduPilot: the hidden deflection of the compass is named."""
import sys
import unittest

sys.dont_write_bytecode = True

from tutorial import Tutorial


class ArduPilot(Tutorial):
    page = "ardupilot.md"


del Tutorial  # so that unittest runs the subclass alone

if __name__ == "__main__":
    unittest.main()
