"""Follows the tutorial of Crazyflie: where nothing is hidden, nothing is named."""
import sys
import unittest

sys.dont_write_bytecode = True

from tutorial import Tutorial


class Crazyflie(Tutorial):
    page = "crazyflie.md"


del Tutorial  # so that unittest runs the subclass alone

if __name__ == "__main__":
    unittest.main()
