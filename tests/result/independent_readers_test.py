"""Recordings and paths of Trueline, read by programs that know nothing of it: @mcap/core of npm, pandas and SciPy.

@mcap/core is looked for in the folder TRUELINE_NODE_MODULES, else in node_modules beside the source; get it by
`npm install --ignore-scripts @mcap/core`.
"""
import json
import os
import shutil
import subprocess
import unittest
from pathlib import Path

import numpy as np
import pandas as pd
from scipy.spatial.transform import Rotation

import exports_test
import synthetic_result as synthetic
from pages import SOURCE

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


class Readers(unittest.TestCase):
    setUpClass = classmethod(exports_test.Exports.setUpClass.__func__)
    exported = exports_test.Exports.exported

    @unittest.skipUnless(shutil.which("node") and (MODULES / "@mcap/core").is_dir(),
                         "SKIPPED: no @mcap/core for node, no recording was read by it")
    def test_mcap_core_reads_every_message_of_a_recording(self):
        file = self.exported("mcap", "result.mcap")
        outcome = subprocess.run(["node", "-e", READ, file], capture_output=True, text=True,
                                 env={**os.environ, "NODE_PATH": str(MODULES)})
        self.assertEqual(outcome.stderr, "")
        read = json.loads(outcome.stdout)
        own = exports_test.read_mcap(file.read_bytes())
        self.assertEqual({name: topic["messages"] for name, topic in read["topics"].items()},
                         {name: len(messages) for name, messages in own.items()})
        self.assertEqual({topic["encoding"] for topic in read["topics"].values()}, {"json"})
        self.assertEqual(read["count"], read["stated"])

    def test_pandas_and_scipy_read_a_path(self):
        file = self.exported("tum", "path.tum")
        table = pd.read_csv(file, sep=" ", comment="#", header=None, names="t x y z qx qy qz qw".split())
        self.assertFalse(table.isna().any().any())
        turns = Rotation.from_quat(table[["qx", "qy", "qz", "qw"]].to_numpy())  # the last is the real part
        yaw = np.unwrap(turns.as_euler("ZYX")[:, 0])
        np.testing.assert_allclose(yaw - yaw[0], table.t - table.t[0], atol=0.02)  # it turns by 1 rad/s
        near = np.array([synthetic.position(t) for t in table.t])
        self.assertLess(np.median(np.linalg.norm(table[["x", "y"]].to_numpy() - near, axis=1)), 0.5)


if __name__ == "__main__":
    unittest.main()
