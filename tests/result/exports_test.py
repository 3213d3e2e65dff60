"""Results in the formats of other programs, read back by other means than those that wrote them: by readers
written here, and by programs that know nothing of Trueline (@mcap/core of npm, pandas and SciPy).

@mcap/core is looked for in the folder TRUELINE_NODE_MODULES, else in node_modules beside the source; get it by
`npm install --ignore-scripts @mcap/core`.
"""
import csv
import json
import math
import os
import shutil
import struct
import subprocess
import tempfile
import unittest
import zlib
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

import diagnosis_page_test
import synthetic_result as synthetic
from pages import BUILD, SOURCE, render

MAGIC = b"\x89MCAP0\r\n"
MODULES = Path(os.environ.get("TRUELINE_NODE_MODULES", SOURCE / "node_modules"))
READ = """
const {McapIndexedReader, McapStreamReader} = require("@mcap/core"), fs = require("fs/promises");
(async () => {
  const file = await fs.open(process.argv[1]), size = (await file.stat()).size;
  const readable = {size: async () => BigInt(size), read: async (offset, length) => {
    const buffer = Buffer.alloc(Number(length));
    await file.read(buffer, 0, Number(length), Number(offset));
    return new Uint8Array(buffer);
  }};
  const reader = await McapIndexedReader.Initialize({readable}), topics = {}, ids = new Map();
  for (const channel of reader.channelsById.values()) {
    ids.set(channel.id, channel.topic);
    JSON.parse(new TextDecoder().decode(reader.schemasById.get(channel.schemaId).data));
    topics[channel.topic] = {encoding: channel.messageEncoding, messages: 0, last: 0};
  }
  for await (const message of reader.readMessages({validateCrcs: true})) {
    const topic = topics[ids.get(message.channelId)];
    JSON.parse(new TextDecoder().decode(message.data));
    if (message.logTime < topic.last) throw new Error("steps back in time");
    ++topic.messages; topic.last = Number(message.logTime);
  }
  const streamed = new McapStreamReader({validateCrcs: true});
  streamed.append(new Uint8Array(await fs.readFile(process.argv[1])));
  let count = 0;
  for (let record; (record = streamed.nextRecord());) count += record.type === "Message";
  console.log(JSON.stringify({topics, count, stated: Number(reader.statistics.messageCount)}));
})();
"""


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

    def exported(self, verb):
        file = self.root / f"result.{verb}"
        if not file.exists():
            outcome = render(verb, self.result, file, f"--log={self.log}")
            self.assertEqual(outcome.returncode, 0, outcome.stderr)
        return file

    def test_a_recording_holds_all_of_a_calibration(self):
        messages = read_mcap(self.exported("mcap").read_bytes())
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
        listed = subprocess.run([BUILD / "apps/trueline-convert", f"--in={self.exported('mcap')}"],
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

    @unittest.skipUnless(shutil.which("node") and (MODULES / "@mcap/core").is_dir(),
                         "SKIPPED: no @mcap/core for node, no recording was read by it")
    def test_mcap_core_reads_every_message_of_a_recording(self):
        file = self.exported("mcap")
        outcome = subprocess.run(["node", "-e", READ, file], capture_output=True, text=True,
                                 env={**os.environ, "NODE_PATH": str(MODULES)})
        self.assertEqual(outcome.stderr, "")
        read = json.loads(outcome.stdout)
        own = read_mcap(file.read_bytes())
        self.assertEqual({name: topic["messages"] for name, topic in read["topics"].items()},
                         {name: len(messages) for name, messages in own.items()})
        self.assertEqual({topic["encoding"] for topic in read["topics"].values()}, {"json"})
        self.assertEqual(read["count"], read["stated"])

    def test_pandas_and_scipy_read_a_path(self):
        file = self.exported("tum")
        table = pd.read_csv(file, sep=" ", comment="#", header=None, names="t x y z qx qy qz qw".split())
        self.assertFalse(table.isna().any().any())
        self.assertTrue(np.all(np.diff(table.t) > 0))
        np.testing.assert_allclose(np.linalg.norm(table[["qx", "qy", "qz", "qw"]], axis=1), 1.0, atol=1e-6)
        turns = Rotation.from_quat(table[["qx", "qy", "qz", "qw"]].to_numpy())  # the last is the real part
        yaw = np.unwrap(turns.as_euler("ZYX")[:, 0])
        np.testing.assert_allclose(yaw - yaw[0], table.t - table.t[0], atol=0.02)  # it turns by 1 rad/s
        near = np.array([synthetic.position(t) for t in table.t])
        self.assertLess(np.median(np.linalg.norm(table[["x", "y"]].to_numpy() - near, axis=1)), 0.5)


if __name__ == "__main__":
    unittest.main()
