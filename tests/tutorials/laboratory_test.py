"""Follows the laboratory's tutorial: the hidden wind is named; messages land between the lines of a result."""
import subprocess
import sys
import unittest

sys.dont_write_bytecode = True

from tutorial import BUILD, Tutorial


class Laboratory(Tutorial):
    page = "laboratory.md"

    def test_it_says_what_to_do_next(self):
        self.assertIn("use what was found", " ".join(self.result("diagnosis/diagnosis.yaml")["next"]))

    def test_messages_land_between_the_lines_of_a_result(self):
        command = [BUILD / "apps/trueline", "calibrate", "--log=log", "--out=again", "--report=false"]
        apart = subprocess.run(command, cwd=self.root, check=True, capture_output=True, text=True)
        together = subprocess.run(command, cwd=self.root, check=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT,
                                  text=True).stdout.splitlines()
        self.assertIn("warning: ", apart.stderr)
        for line in (apart.stdout + apart.stderr).splitlines():
            self.assertIn(line, together)


del Tutorial  # so that unittest runs the subclass alone

if __name__ == "__main__":
    unittest.main()
