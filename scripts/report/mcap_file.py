"""Writes MCAP files of JSON messages (https://mcap.dev/spec): chunked and indexed, not compressed."""
import json
import struct
import zlib
from dataclasses import dataclass, field

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX = range(1, 9)
STATISTICS, DATA_END = 0x0B, 0x0F
CHUNK_BYTES = 1 << 20


def text(value):
    return blob(value.encode())


def blob(value):
    return struct.pack("<I", len(value)) + value


def record(opcode, content):
    return struct.pack("<BQ", opcode, len(content)) + content


def pairs(entries, key, value):
    """A map, or an array of pairs: its length in bytes, then the entries."""
    return blob(b"".join(struct.pack(f"<{key}{value}", *entry) for entry in entries))


@dataclass
class Channel:
    topic: str
    schema_name: str
    schema: dict
    messages: list = field(default_factory=list)  # (time in ns, content)


class McapFile:
    """add() messages in any order, then content()."""

    def __init__(self):
        self.channels = {}

    def add(self, topic, schema_name, schema, time_ns, content):
        channel = self.channels.setdefault(topic, Channel(topic, schema_name, schema))
        channel.messages.append((int(time_ns), content))

    def content(self):
        definitions = self._definitions()
        out = MAGIC + record(HEADER, text("") + text("trueline"))
        chunk_indices = []
        for chunk in self._chunks():
            packed, index = _packed(chunk, definitions if not chunk_indices else b"", len(out))
            out += packed
            chunk_indices.append(index)
        out += record(DATA_END, struct.pack("<I", 0))
        summary = len(out)
        out += definitions + b"".join(chunk_indices) + self._statistics(len(chunk_indices))
        return out + record(FOOTER, struct.pack("<QQI", summary, 0, 0)) + MAGIC

    def _definitions(self):
        """Schemas and channels, one schema a channel; both are numbered from 1."""
        out = b""
        for i, channel in enumerate(self.channels.values(), 1):
            out += record(SCHEMA, struct.pack("<H", i) + text(channel.schema_name) + text("jsonschema")
                          + blob(json.dumps(channel.schema).encode()))
            out += record(CHANNEL, struct.pack("<HH", i, i) + text(channel.topic) + text("json") + blob(b""))
        return out

    def _chunks(self):
        """Lists of (time, channel, record), in the order of time."""
        messages = []
        for i, channel in enumerate(self.channels.values(), 1):
            for sequence, (time, content) in enumerate(sorted(channel.messages, key=lambda m: m[0])):
                body = struct.pack("<HIQQ", i, sequence, time, time) + json.dumps(content, allow_nan=False).encode()
                messages.append((time, i, record(MESSAGE, body)))
        messages.sort(key=lambda m: m[0])
        chunk, size = [], 0
        for message in messages:
            chunk.append(message)
            size += len(message[2])
            if size > CHUNK_BYTES:
                yield chunk
                chunk, size = [], 0
        if chunk:
            yield chunk

    def _statistics(self, chunks):
        counts = [(i, len(c.messages)) for i, c in enumerate(self.channels.values(), 1)]
        times = [time for c in self.channels.values() for time, _ in c.messages] or [0]
        return record(STATISTICS, struct.pack("<QHIIIIQQ", sum(n for _, n in counts), len(counts), len(counts), 0, 0,
                                              chunks, min(times), max(times)) + pairs(counts, "H", "Q"))


def _packed(messages, definitions, start):
    """A chunk with its message indices, and its entry for the summary; `start`: its place in the file."""
    body, offsets = definitions, {}
    for time, channel, packed in messages:
        offsets.setdefault(channel, []).append((time, len(body)))
        body += packed
    first, last = messages[0][0], messages[-1][0]
    chunk = record(CHUNK, struct.pack("<QQQI", first, last, len(body), zlib.crc32(body)) + text("")
                   + struct.pack("<Q", len(body)) + body)
    places, indices = [], b""
    for channel, entries in offsets.items():
        places.append((channel, start + len(chunk) + len(indices)))
        indices += record(MESSAGE_INDEX, struct.pack("<H", channel) + pairs(entries, "Q", "Q"))
    index = record(CHUNK_INDEX, struct.pack("<QQQQ", first, last, start, len(chunk)) + pairs(places, "H", "Q")
                   + struct.pack("<Q", len(indices)) + text("") + struct.pack("<QQ", len(body), len(body)))
    return chunk + indices, index
