#include <fmt/format.h>

#include <boost/crc.hpp>

#include "problems/import/formats/bytes.h"
#include "problems/import/formats/open_recording.h"
#include "problems/import/formats/ros_decoder.h"
#include "problems/log/decompress.h"

namespace trueline {
namespace {

constexpr std::uint64_t kMaxMcapChunk = 1ULL << 31;  // bytes, uncompressed

enum McapOp : std::uint8_t {
  kMcapFooter = 0x02,
  kMcapSchema = 0x03,
  kMcapChannel = 0x04,
  kMcapMessage = 0x05,
  kMcapChunk = 0x06,
  kMcapDataEnd = 0x0F
};

struct McapSchema {
  std::string name, encoding, data;
};

std::unique_ptr<MessageDecoder> MakeMcapDecoder(std::string_view encoding,
                                                const McapSchema& schema) {
  if (encoding == "cdr" && schema.encoding == "ros2msg") {
    return MakeCdrDecoder(schema.name, schema.data);
  }
  if (encoding == "ros1" && schema.encoding == "ros1msg") {
    return MakeRos1Decoder(schema.name, schema.data);
  }
  if (encoding == "json") return MakeJsonDecoder();
  if (encoding == "protobuf" && schema.encoding == "protobuf") {
    return MakeProtobufDecoder(schema.name, schema.data);
  }
  return nullptr;
}

class McapWalk {
 public:
  McapWalk(const std::filesystem::path& path, MessageSink* sink) : file_(path), sink_(sink) {}

  void Run() {
    file_.Seek(8);  // the magic bytes
    while (Next()) {
    }
    sink_->WarnOf(damaged_, fmt::format("chunks are damaged, the first at byte {}; their messages "
                                        "are left out",
                                        first_damaged_));
    sink_->WarnOf(strangers_, "messages of channels that the file does not describe are left out");
  }

 private:
  bool Next() {
    const std::uint64_t start = file_.position();
    std::string_view head;
    if (!file_.Peek(9, &head)) return NeverClosed(start);
    const auto op = static_cast<std::uint8_t>(head[0]);
    const auto size = LoadLittle<std::uint64_t>(head.data() + 1);
    if (size > file_.size() - start - 9) return DoesNotFit(start);
    if (op == kMcapDataEnd || op == kMcapFooter) return false;
    if (op < kMcapSchema || op > kMcapChunk) {  // nothing of use here
      file_.Seek(start + 9 + size);
      return true;
    }
    std::string_view record;
    file_.Read(9 + size, &record);
    Handle(op, record.substr(9), start, false);
    return true;
  }

  bool NeverClosed(std::uint64_t start) {
    sink_->Warn(fmt::format("was never closed: it ends at byte {}, which is where its messages end",
                            start));
    return false;
  }

  bool DoesNotFit(std::uint64_t start) {
    sink_->Warn(
        fmt::format("was never closed, or is damaged: the record at byte {} does not fit the "
                    "file, so the {} bytes from there to the end are not read",
                    start, file_.size() - start));
    return false;
  }

  void Handle(std::uint8_t op, std::string_view content, std::uint64_t start, bool in_chunk) {
    ByteCursor cursor(content);
    if (op == kMcapMessage) return Message(&cursor);
    if (op == kMcapSchema) return Schema(&cursor);
    if (op == kMcapChannel) return Channel(&cursor);
    if (op == kMcapChunk && !in_chunk) return Chunk(&cursor, start);
  }

  void Schema(ByteCursor* cursor) {
    const auto id = cursor->Get<std::uint16_t>();
    McapSchema schema;
    schema.name = cursor->Text<std::uint32_t>();
    schema.encoding = cursor->Text<std::uint32_t>();
    schema.data = cursor->Text<std::uint32_t>();
    if (cursor->ok()) schemas_[id] = std::move(schema);
  }

  void Channel(ByteCursor* cursor) {
    const auto id = cursor->Get<std::uint16_t>();
    const McapSchema& schema = schemas_[cursor->Get<std::uint16_t>()];
    const std::string topic(cursor->Text<std::uint32_t>());
    const std::string_view encoding = cursor->Text<std::uint32_t>();
    if (!cursor->ok()) return;
    const ChannelKey key{topic, 0, schema.name, LayoutOf(encoding, schema)};
    channels_[id] = sink_->AddChannel(key, [&] {
      auto decoder = MakeMcapDecoder(encoding, schema);
      if (!decoder) {
        sink_->Warn(fmt::format("{} is encoded as {} with {}, which is not read here", topic,
                                encoding, schema.encoding.empty() ? "no schema" : schema.encoding));
      }
      return decoder;
    });
  }

  // JSON states its layout in each message.
  std::string LayoutOf(std::string_view encoding, const McapSchema& schema) {
    const std::string layout(encoding);
    if (encoding == "json") return layout;
    if (encoding != "cdr" && encoding != "ros1") return layout + " " + schema.data;
    return layout + " " + schema.encoding + " " + layouts_.Of(schema.name, schema.data);
  }

  void Message(ByteCursor* cursor) {
    const auto channel = channels_.find(cursor->Get<std::uint16_t>());
    cursor->Get<std::uint32_t>();
    const auto time = static_cast<TimeNs>(cursor->Get<std::uint64_t>());
    cursor->Get<std::uint64_t>();
    if (channel == channels_.end() || !cursor->ok()) {
      ++strangers_;
      return;
    }
    sink_->Add(channel->second, time, cursor->Bytes(cursor->left()));
  }

  void Chunk(ByteCursor* cursor, std::uint64_t start) {
    cursor->Bytes(16);  // first and last time
    const auto size = cursor->Get<std::uint64_t>();
    const auto crc = cursor->Get<std::uint32_t>();
    const std::string_view compression = cursor->Text<std::uint32_t>();
    std::string_view records = cursor->Text<std::uint64_t>();
    std::string decompressed;
    bool good = cursor->ok();
    if (good && !compression.empty()) {
      good = size <= kMaxMcapChunk && Decompress(compression, records, size, &decompressed);
      records = decompressed;
    }
    if (!good || !RightCrc(records, crc)) {
      if (damaged_++ == 0) first_damaged_ = start;
      return;
    }
    ByteCursor inside(records);
    while (inside.left() > 0) {
      const std::size_t at = inside.at();
      const auto op = inside.Get<std::uint8_t>();
      const std::string_view content = inside.Text<std::uint64_t>();
      if (!inside.ok()) {
        sink_->Warn(
            fmt::format("the chunk at byte {} ends within a record; the {} bytes from there "
                        "on are left out",
                        start, records.size() - at));
        return;
      }
      Handle(op, content, start, true);
    }
  }

  static bool RightCrc(std::string_view records, std::uint32_t expected) {
    if (expected == 0) return true;  // not computed by the writer
    boost::crc_32_type crc;
    crc.process_bytes(records.data(), records.size());
    return crc.checksum() == expected;
  }

  ByteFile file_;
  MessageSink* sink_;
  std::map<std::uint16_t, McapSchema> schemas_;
  std::map<std::uint16_t, std::size_t> channels_;
  RosLayouts layouts_;
  std::size_t damaged_ = 0, strangers_ = 0;
  std::uint64_t first_damaged_ = 0;
};

}  // namespace

void WalkMcap(const std::filesystem::path& path, MessageSink* sink) { McapWalk(path, sink).Run(); }

}  // namespace trueline
