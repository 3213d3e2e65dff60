"""Follows the tutorial of PX4: a late receiver is repaired, and the hidden wind is named."""
import sys
import unittest

sys.dont_write_bytecode = True

from tutorial import Tutorial


class Px4(Tutorial):
    page = "px4.md"


del Tutorial  # so that unittest runs the subclass alone

if __name__ == "__main__":
    unittest.main()
