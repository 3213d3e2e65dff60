#include <fmt/format.h>

#include <algorithm>

#include "problems/common/error.h"
#include "problems/import/formats/bytes.h"
#include "problems/import/formats/open_recording.h"
#include "problems/import/formats/ulog_topics.h"

namespace trueline {
namespace {

constexpr std::string_view kSyncRecord("\x08\x00\x53\x2f\x73\x13\x20\x25\x0c\xbb\x12", 11);
constexpr std::size_t kHeaderSize = 16;
constexpr std::size_t kMaxFileFields = 1 << 18;  // of all topics; PX4 has some thousands

// A topic as subscribed to.
struct ULogTopic {
  std::string name;
  int instance = 0;
  bool laid_out = false;
  std::optional<std::size_t> channel;    // if its format is known
  std::optional<std::size_t> timestamp;  // place in a message, bytes
};

class ULogWalk {
 public:
  ULogWalk(const std::filesystem::path& path, MessageSink* sink) : file_(path), sink_(sink) {}

  void Run() {
    ReadHeader();
    while (Next()) {
    }
    if (dropout_ms_ > 0) {
      sink_->Warn(
          fmt::format("logging lost {} ms (dropouts: {}); a faster card or fewer topics "
                      "avoids that",
                      dropout_ms_, dropouts_));
    }
    if (!has_motors_) {  // else these are the motor commands
      for (const std::string& warning : outputs_.Warnings()) sink_->Warn(warning);
    }
    sink_->WarnOf(crowded_, fmt::format("topics are left out: those before have {} fields, more "
                                        "than any log of a vehicle; it is damaged",
                                        fields_));
    sink_->WarnOf(short_, "records are shorter than their topic's definition; they are left out");
    sink_->WarnOf(untimed_, "records have no possible time stamp; they are left out");
    sink_->WarnOf(unknown_, "records of topics that were never announced are left out");
  }

 private:
  void ReadHeader() {
    std::string_view header;
    if (!file_.Read(kHeaderSize, &header)) {
      throw ErrorAt(file_.file(), 0, "ends within its header; copy the log again");
    }
  }

  // The end of this part of the data: the start of appended data, or the end of the file.
  std::uint64_t Limit() const { return appended_.empty() ? file_.size() : appended_.front(); }

  bool Next() {
    if (file_.position() >= Limit()) return ToAppended();
    std::string_view head;
    if (file_.position() + 3 > Limit() || !file_.Peek(3, &head)) return CutOff();
    const auto size = LoadLittle<std::uint16_t>(head.data());
    const char type = head[2];
    if (type < 'A' || type > 'Z') return Resynchronise();
    if (file_.position() + 3 + size > Limit()) return CutOff();
    std::string_view record;
    file_.Read(3ULL + size, &record);
    Handle(type, record.substr(3));
    return true;
  }

  bool ToAppended() {
    if (appended_.empty()) return false;
    file_.Seek(appended_.front());
    appended_.erase(appended_.begin());
    return true;
  }

  bool CutOff() {
    if (!appended_.empty()) return ToAppended();
    sink_->Warn(
        fmt::format("is cut off within the record at byte {}; it is left out", file_.position()));
    return false;
  }

  bool Resynchronise() {
    const std::uint64_t from = file_.position();
    const bool found = file_.Find(kSyncRecord) && file_.position() < Limit();
    if (!found) file_.Seek(Limit());
    sink_->Warn(
        fmt::format("no record at byte {}: {} bytes, to {}, are empty or damaged; they are "
                    "left out",
                    from, file_.position() - from, found ? "the next synchronisation" : "the end"));
    return found || ToAppended();
  }

  void Handle(char type, std::string_view payload) {
    if (type == 'D') return Data(payload);
    if (type == 'B') return Flags(payload);
    if (type == 'A') return Subscribe(payload);
    if (type == 'P') return outputs_.AddParameter(payload);
    if (type == 'F' && !ParseULogFormat(payload, &formats_)) {
      sink_->Warn(fmt::format("the definition before byte {} is malformed; its topic is left out",
                              file_.position()));
    }
    if (type == 'O' && payload.size() >= 2) {
      dropout_ms_ += LoadLittle<std::uint16_t>(payload.data());
      ++dropouts_;
    }
  }

  void Flags(std::string_view payload) {
    ByteCursor cursor(payload);
    cursor.Bytes(8);
    const auto incompatible = cursor.Get<std::uint64_t>();
    if ((incompatible & ~std::uint64_t{1}) != 0) {
      throw ErrorAt(file_.file(), 0,
                    "needs a newer ULog reader: it sets incompatible flags that are unknown here; "
                    "convert the log with PX4's tools first");
    }
    for (int i = 0; i < 3; ++i) {
      const auto offset = cursor.Get<std::uint64_t>();
      if (offset > file_.position() && offset < file_.size()) appended_.push_back(offset);
    }
    std::sort(appended_.begin(), appended_.end());
  }

  void Subscribe(std::string_view payload) {
    ByteCursor cursor(payload);
    const auto instance = cursor.Get<std::uint8_t>();
    const auto id = cursor.Get<std::uint16_t>();
    const std::string_view name = cursor.Bytes(cursor.left());
    if (cursor.ok()) topics_[id] = {std::string(name), instance, false, {}, {}};
  }

  void Data(std::string_view payload) {
    if (payload.size() < 2) return;
    const auto found = topics_.find(LoadLittle<std::uint16_t>(payload.data()));
    const std::string_view message = payload.substr(2);
    if (found == topics_.end()) {
      ++unknown_;
      return;
    }
    if (!LaidOut(found->first, message, &found->second)) return;
    const ULogTopic& topic = found->second;
    if (topic.name == kULogOutputs) outputs_.AddMessage(found->first, message);
    TimeNs time = 0;
    const bool has_time = topic.timestamp && *topic.timestamp + 8 <= message.size();
    if (has_time && !ReadScalar(Scalar::kU64, message.data() + *topic.timestamp).Time(3, &time)) {
      ++untimed_;
      return;
    }
    sink_->Add(*topic.channel, time, message);
  }

  // Lays out a topic at its first data: nested types may be defined after it. False, and counted,
  // where that fails.
  bool LaidOut(std::uint16_t id, std::string_view first_message, ULogTopic* topic) {
    if (topic->laid_out) {
      unknown_ += topic->channel ? 0 : 1;
      return topic->channel.has_value();
    }
    ULogLayout layout(formats_, first_message.size());
    const bool good = layout.Add(topic->name, "");
    if (layout.too_large) {  // a longer message may come
      ++short_;
      return false;
    }
    topic->laid_out = true;
    fields_ += good ? layout.fields.size() : 0;
    unknown_ += good ? 0 : 1;
    crowded_ += good && fields_ > kMaxFileFields ? 1 : 0;
    if (!good || fields_ > kMaxFileFields) return false;
    std::string stamp = "timestamp";
    for (const PackedField& field : layout.fields) {
      if (field.name == "timestamp") topic->timestamp = field.offset;
      if (field.name == "timestamp_sample") stamp = field.name;
    }
    if (topic->name == kULogOutputs) {
      const Channel named{.name = topic->name, .instance = topic->instance, .fields = {}};
      outputs_.Describe(id, named.Label(), first_message, &layout.fields);
    }
    has_motors_ |= topic->name == "actuator_motors";
    const ChannelKey key{topic->name, topic->instance, topic->name, PackedLayout(layout.fields)};
    topic->channel = sink_->AddChannel(key, [&] {
      return std::make_unique<PackedDecoder>(layout.fields, layout.min_size, stamp, 3);
    });
    return true;
  }

  ByteFile file_;
  MessageSink* sink_;
  ULogFormats formats_;
  std::map<std::uint16_t, ULogTopic> topics_;
  std::vector<std::uint64_t> appended_;  // where appended data start, those still ahead
  ULogOutputs outputs_;
  bool has_motors_ = false;  // from 1.14 on, whatever their protocol
  std::size_t fields_ = 0;   // of all topics
  std::size_t unknown_ = 0, short_ = 0, untimed_ = 0, crowded_ = 0;
  int dropouts_ = 0;
  std::uint64_t dropout_ms_ = 0;
};

}  // namespace

void WalkULog(const std::filesystem::path& path, MessageSink* sink) { ULogWalk(path, sink).Run(); }

}  // namespace trueline
