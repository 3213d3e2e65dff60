"""Doxygen makes pages of the library's headers, with the comments of the sources and the handbook's example."""
import os
import re
import shutil
import subprocess
import tempfile
import unittest
from pathlib import Path

SOURCE = Path(os.environ.get("TRUELINE_TEST_SOURCE_DIR", Path(__file__).resolve().parents[2]))


@unittest.skipUnless(shutil.which("doxygen"), "SKIPPED: no doxygen, no pages of the library were made")
class Pages(unittest.TestCase):
    def test_comments_of_functions_and_members_stand_on_the_pages(self):
        out = Path(self.enterContext(tempfile.TemporaryDirectory()))
        options = (SOURCE / "scripts/handbook/Doxyfile").read_text() + f"OUTPUT_DIRECTORY = {out}\n"
        made = subprocess.run(["doxygen", "-"], input=options, cwd=SOURCE, capture_output=True, text=True)
        self.assertEqual((made.returncode, made.stderr), (0, ""))
        for page, words in (("namespacetrueline", "Throws InputError for bad input"),
                            ("structtrueline_1_1CalibrationOptions", "of the model (trueline-diagnose)"),
                            ("calibration_8h", "Calibration of one flight: log in"), ("index", "ReadNativeLog")):
            text = re.sub(r"<[^>]*>", "", (out / "html" / f"{page}.html").read_text())
            self.assertTrue(words in text, f"{page}.html lacks '{words}'")


if __name__ == "__main__":
    unittest.main()
