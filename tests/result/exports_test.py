"""Results in the formats of other programs, read back by other means than those that wrote them."""
import csv
import json
import math
import shutil
import struct
import subprocess
import tempfile
import unittest
import zlib
from pathlib import Path

import numpy as np

import diagnosis_page_test
import synthetic_result as synthetic
from pages import BUILD, render

MAGIC = b"\x89MCAP0\r\n"


def records(data):
    """(opcode, content, place) of each record."""
    at = 0
    while at < len(data):
        opcode, length = struct.unpack_from("<BQ", data, at)
        yield opcode, data[at + 9:at + 9 + length], at
        at += 9 + length


def text_at(content, at):
    length, = struct.unpack_from("<I", content, at)
    return content[at + 4:at + 4 + length].decode(), at + 4 + length


def read_mcap(data):
    """{topic: [(time in s, message)]}, after a check of magic, checksums and the summary's places."""
    assert data.startswith(MAGIC) and data.endswith(MAGIC)
    topics, messages = {}, {}
    whole = list(records(data[len(MAGIC):-len(MAGIC)]))
    assert whole[0][0] == 1 and whole[-1][0] == 2
    summary, = struct.unpack_from("<Q", whole[-1][1])
    assert data[summary] == 3  # a schema
    for opcode, content, _ in whole:
        if opcode == 8:
            start, length = struct.unpack_from("<QQ", content, 16)
            assert data[start] == 6 and struct.unpack_from("<Q", data, start + 1)[0] == length - 9
        if opcode != 6:
            continue
        size, crc = struct.unpack_from("<QI", content, 16)
        inner = content[-size:]
        assert zlib.crc32(inner) == crc
        for kind, part, _ in records(inner):
            if kind == 4:
                topic, at = text_at(part, 4)
                assert text_at(part, at)[0] == "json"
                topics[struct.unpack_from("<H", part)[0]] = topic
            elif kind == 5:
                channel, _, time, _ = struct.unpack_from("<HIQQ", part)
                messages.setdefault(topics[channel], []).append((1e-9 * time, json.loads(part[22:])))
    return messages


class Exports(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.root = Path(tempfile.mkdtemp(prefix="trueline_exports_"))
        cls.addClassCleanup(shutil.rmtree, cls.root)
        cls.log, cls.result = synthetic.write_all(cls.root)
        end = (synthetic.ARCS + 1) * (synthetic.PASS_TIME + synthetic.ARC_TIME)
        synthetic.write_csv(cls.log / "attitude.csv", "t [s],qw [1],qx [1],qy [1],qz [1]",
                            [(float(t), math.cos(t / 2), 0.0, 0.0, math.sin(t / 2)) for t in np.arange(0, end, 0.01)])

    def exported(self, verb, name):
        outcome = render(verb, self.result, self.root / name, f"--log={self.log}")
        self.assertEqual(outcome.returncode, 0, outcome.stderr)
        return self.root / name

    def test_a_path_is_a_tum_trajectory(self):
        rows = np.loadtxt(self.exported("tum", "path.tum"))
        self.assertEqual(rows.shape[1], 8)
        self.assertTrue(np.all(np.diff(rows[:, 0]) > 0))
        np.testing.assert_allclose(np.linalg.norm(rows[:, 4:], axis=1), 1.0, atol=1e-6)
        near = [synthetic.position(t) for t in rows[:, 0]]
        self.assertLess(np.median(np.linalg.norm(rows[:, 1:3] - near, axis=1)), 0.5)
        turn = 2.0 * np.unwrap(np.arctan2(rows[:, 6], rows[:, 7]), period=np.pi)
        np.testing.assert_allclose(turn - turn[0], rows[:, 0] - rows[0, 0], atol=0.02)

    def test_a_recording_holds_all_of_a_calibration(self):
        messages = read_mcap(self.exported("mcap", "result.mcap").read_bytes())
        self.assertEqual(len(messages["/ellipses"]), synthetic.ARCS)
        self.assertEqual(len(messages["/residuals"]), 18 * (synthetic.ARCS + 1))
        self.assertIn("/parameters/vgd/K_x", messages)
        poses = [message["pose"]["position"] for _, message in messages["/pose"]]
        self.assertEqual([set(p) for p in poses], [set("xyz")] * len(poses))
        with open(self.result / "arcs.csv", newline="") as stream:
            arcs = {f"arc {row['tau']}": row for row in csv.DictReader(stream)
                    if row["estimator"] == "vgd" and row["gamma"] == "3"}
        for _, update in messages["/ellipses"]:
            entity = update["entities"][0]
            arc = {key.split(" [")[0]: value for key, value in arcs[entity["id"]].items()}
            number = lambda name: float(arc[name])
            off = np.array([[p["x"] - number("x_predicted"), p["y"] - number("y_predicted")]
                            for p in entity["lines"][0]["points"]])
            cov = [[number("cov_xx"), number("cov_xy")], [number("cov_xy"), number("cov_yy")]]
            distance = np.einsum("ni,ij,nj->n", off, np.linalg.inv(cov), off)
            np.testing.assert_allclose(distance, 5.991, rtol=1e-3)  # 95 % of a normal in the plane
        self.assertTrue(messages["/causes"][0][1]["message"].startswith("verdict: "))

    def test_the_own_reader_lists_a_recording(self):
        listed = subprocess.run([BUILD / "apps/trueline-convert", f"--in={self.exported('mcap', 'own.mcap')}"],
                                capture_output=True, text=True)
        self.assertIn("foxglove.PoseInFrame", listed.stdout)
        self.assertIn("trueline.Residual", listed.stdout)

    def test_a_recording_of_a_diagnosis_says_its_causes(self):
        diagnosis_page_test.write_result(self.root / "diagnosis")
        outcome = render("mcap", self.root / "diagnosis", self.root / "diagnosis.mcap")
        self.assertEqual(outcome.returncode, 0, outcome.stderr)
        messages = read_mcap((self.root / "diagnosis.mcap").read_bytes())
        said = [(m["level"], m["message"]) for _, m in messages["/causes"]]
        self.assertIn((3, "rotor_drag: k = 0.03 +- 0.003 s/m"), said)
        self.assertIn("refuted by a witness", [text for level, text in said if text.startswith("fix_scale")][0])
        self.assertEqual(len(messages["/misfit/1_s"]), diagnosis_page_test.STARTS)

    def test_a_missing_log_is_an_error_with_a_remedy(self):
        for verb in ("tum", "mcap"):
            outcome = render(verb, self.result, self.root / f"none.{verb}", f"--log={self.root / 'nowhere'}")
            self.assertEqual(outcome.returncode, 2)
            self.assertIn("by --log", outcome.stderr)


if __name__ == "__main__":
    unittest.main()
