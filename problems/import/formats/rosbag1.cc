#include <fmt/format.h>

#include "problems/common/error.h"
#include "problems/import/formats/bytes.h"
#include "problems/import/formats/open_recording.h"
#include "problems/import/formats/ros_decoder.h"
#include "problems/log/decompress.h"

namespace trueline {
namespace {

constexpr std::uint64_t kMaxChunk = 1ULL << 31;  // bytes, uncompressed

constexpr std::uint64_t kNoIndex = std::numeric_limits<std::uint64_t>::max();

enum BagOp : std::uint8_t {
  kBagMessage = 2,
  kBagHeader = 3,
  kBagChunk = 5,
  kBagChunkInfo = 6,
  kBagConnection = 7
};

// The fields "name=value" of a record's header.
class BagFields {
 public:
  explicit BagFields(std::string_view header) {
    ByteCursor cursor(header);
    while (cursor.left() > 0) {
      const std::string_view field = cursor.Text<std::uint32_t>();
      const std::size_t equals = field.find('=');
      if (!cursor.ok() || equals == std::string_view::npos) break;
      fields_[field.substr(0, equals)] = field.substr(equals + 1);
    }
  }

  std::string_view Text(std::string_view name) const {
    const auto found = fields_.find(name);
    return found == fields_.end() ? std::string_view() : found->second;
  }
  template <class T>
  T Get(std::string_view name, T fallback) const {
    const std::string_view value = Text(name);
    return value.size() == sizeof(T) ? LoadLittle<T>(value.data()) : fallback;
  }

 private:
  std::map<std::string_view, std::string_view> fields_;
};

class BagWalk {
 public:
  BagWalk(const std::filesystem::path& path, MessageSink* sink) : file_(path), sink_(sink) {}

  void Run() {
    std::string_view line;
    file_.Read(13, &line);  // "#ROSBAG V2.0\n"
    while (Next()) {
    }
    sink_->WarnOf(damaged_, fmt::format("chunks cannot be decompressed, the first at byte {}; "
                                        "their messages are left out",
                                        first_damaged_));
    sink_->WarnOf(strangers_,
                  "messages of connections that the bag does not describe are left out");
  }

 private:
  bool Next() {
    const std::uint64_t start = file_.position();
    constexpr std::uint64_t kLeast = 8;  // bytes of a record
    if (start == file_.size()) return false;
    if (start + kLeast > end_) {
      if (AtIndex(start)) return false;
      sink_->Warn(fmt::format(
          "its header says that the index starts at byte {}, where none is; the bag is read to its "
          "end instead",
          end_));
      end_ = kNoIndex;
    }
    std::string_view bytes;
    if (!file_.Peek(kLeast, &bytes)) return CutOff(start);
    const auto header_size = LoadLittle<std::uint32_t>(bytes.data());
    if (!file_.Peek(8ULL + header_size, &bytes)) return CutOff(start);
    const auto data_size = LoadLittle<std::uint32_t>(bytes.data() + 4 + header_size);
    if (!file_.Read(8ULL + header_size + data_size, &bytes)) return CutOff(start);
    Handle(bytes.substr(4, header_size), bytes.substr(8ULL + header_size), start);
    return true;
  }

  // Whether all chunks are read. Where the header does not count them, the index must stand here:
  // records of connections and chunk infos.
  bool AtIndex(std::uint64_t start) {
    std::string_view bytes;
    if (announced_ > 0) return chunks_ >= announced_;
    if (start != end_ || !file_.Peek(4, &bytes)) return false;
    const auto header_size = LoadLittle<std::uint32_t>(bytes.data());
    if (!file_.Peek(4ULL + header_size, &bytes)) return true;  // it is cut off
    const auto op = BagFields(bytes.substr(4)).Get<std::uint8_t>("op", 0);
    return op == kBagConnection || op == kBagChunkInfo;
  }

  bool CutOff(std::uint64_t start) {
    sink_->Warn(fmt::format("is cut off within the record at byte {}; it is left out", start));
    return false;
  }

  void Handle(std::string_view header, std::string_view data, std::uint64_t start,
              bool in_chunk = false) {
    const BagFields fields(header);
    switch (fields.Get<std::uint8_t>("op", 0)) {
      case kBagHeader:
        if (!fields.Text("encryptor").empty()) {
          throw ErrorAt(file_.file(), 0, "is encrypted; decrypt it with `rosbag decrypt`");
        }
        if (const auto index = fields.Get<std::uint64_t>("index_pos", 0); index > start) {
          end_ = index;
        }
        announced_ = fields.Get<std::uint32_t>("chunk_count", 0);
        break;
      case kBagChunk:
        if (in_chunk) break;
        ++chunks_;
        return Chunk(fields, data, start);
      case kBagConnection:
        return Connection(fields, data);
      case kBagMessage:
        return Message(fields, data);
      default:
        break;
    }
  }

  void Chunk(const BagFields& fields, std::string_view data, std::uint64_t start) {
    std::string records;
    const std::string_view compression = fields.Text("compression");
    if (compression != "none") {
      const std::uint64_t size = fields.Get<std::uint32_t>("size", 0);
      if (!Decompress(compression, data, std::min(size, kMaxChunk), &records)) {
        if (damaged_++ == 0) first_damaged_ = start;
        return;
      }
      data = records;
    }
    ByteCursor cursor(data);
    while (cursor.left() > 0) {
      const std::string_view header = cursor.Text<std::uint32_t>();
      const std::string_view body = cursor.Text<std::uint32_t>();
      if (!cursor.ok()) {
        sink_->Warn(fmt::format("the chunk at byte {} ends within a record", start));
        return;
      }
      Handle(header, body, start, true);
    }
  }

  void Connection(const BagFields& fields, std::string_view data) {
    const BagFields about(data);
    const std::string type(about.Text("type"));
    const std::string definition(about.Text("message_definition"));
    channels_[fields.Get<std::uint32_t>("conn", 0)] = sink_->AddChannel(
        {std::string(fields.Text("topic")), 0, type, layouts_.Of(type, definition)},
        [&] { return MakeRos1Decoder(type, definition); });
  }

  void Message(const BagFields& fields, std::string_view data) {
    const auto channel = channels_.find(fields.Get<std::uint32_t>("conn", 0xffffffff));
    const std::string_view time = fields.Text("time");
    if (channel == channels_.end() || time.size() != 8) {
      ++strangers_;
      return;
    }
    sink_->Add(channel->second,
               kNsPerSecond * LoadLittle<std::uint32_t>(time.data()) +
                   LoadLittle<std::uint32_t>(time.data() + 4),
               data);
  }

  ByteFile file_;
  MessageSink* sink_;
  std::uint64_t end_ = kNoIndex;                   // where the index starts
  std::uint32_t announced_ = 0, chunks_ = 0;       // how many, and those read
  std::map<std::uint32_t, std::size_t> channels_;  // by connection
  RosLayouts layouts_;
  std::size_t damaged_ = 0, strangers_ = 0;
  std::uint64_t first_damaged_ = 0;
};

}  // namespace

void WalkRosbag1(const std::filesystem::path& path, MessageSink* sink) {
  BagWalk(path, sink).Run();
}

}  // namespace trueline
