#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "problems/common/error.h"
#include "problems/import/formats/bytes.h"
#include "problems/import/formats/open_recording.h"

namespace trueline {
namespace {

// What ULog's topics hold: where their fields lie in a message, and what motor outputs mean.

struct ULogField {
  std::string type, name;
  std::size_t count = 0;  // of an array; 0 for a single value
};

using ULogFormats = std::map<std::string, std::vector<ULogField>, std::less<>>;

// What PX4's topic actuator_outputs holds: pulses of PWM in us, or values of DShot, or of CAN.

inline constexpr std::string_view kULogOutputs = "actuator_outputs";

constexpr std::size_t kMaxFields = 16384;       // of one topic; a larger definition is damaged
constexpr std::size_t kMaxULogMessage = 65535;  // bytes
constexpr std::size_t kMaxSteps = 1 << 17;      // of one topic; types without fields cost no bytes
constexpr int kMaxNesting = 16;

const std::map<std::string, Scalar, std::less<>> kULogScalars = {
    {"int8_t", Scalar::kI8},    {"uint8_t", Scalar::kU8},   {"int16_t", Scalar::kI16},
    {"uint16_t", Scalar::kU16}, {"int32_t", Scalar::kI32},  {"uint32_t", Scalar::kU32},
    {"int64_t", Scalar::kI64},  {"uint64_t", Scalar::kU64}, {"float", Scalar::kF32},
    {"double", Scalar::kF64},   {"bool", Scalar::kU8}};

// "type[n] name" or "type name".
bool ParseULogField(std::string_view text, ULogField* field) {
  const std::size_t space = text.find(' ');
  if (space == std::string_view::npos) return false;
  std::string_view type = text.substr(0, space);
  field->name = text.substr(space + 1);
  const std::size_t bracket = type.find('[');
  field->type = type.substr(0, bracket);
  if (bracket == std::string_view::npos) return true;
  const char* end = type.data() + type.size();
  const auto [stop, error] = std::from_chars(type.data() + bracket + 1, end, field->count);
  return error == std::errc() && stop + 1 == end && *stop == ']' && field->count > 0;
}

// Adds a definition, "name:type field;type[n] field;...". False if it is malformed.
bool ParseULogFormat(std::string_view text, ULogFormats* formats) {
  const std::size_t colon = text.find(':');
  if (colon == std::string_view::npos) return false;
  std::vector<ULogField> fields;
  ByteCursor rest(text.substr(colon + 1));
  while (rest.left() > 0) {
    const std::string_view part = rest.Until(';');
    ULogField field;
    if (!rest.ok() || !ParseULogField(part, &field)) return false;
    fields.push_back(field);
  }
  (*formats)[std::string(text.substr(0, colon))] = std::move(fields);
  return true;
}

// Lays out the fields of a type one after another, nested types in place.
class ULogLayout {
 public:
  // `formats` must outlive this. The fields must fit into `room` bytes: so a file can't demand more
  // memory by its definitions than its messages have.
  ULogLayout(const ULogFormats& formats, std::size_t room) : formats_(formats), room_(room) {}

  // False if a type is not defined, nests too deeply or does not fit.
  bool Add(std::string_view type, const std::string& prefix, int depth = 0) {
    const auto format = formats_.find(type);
    if (format == formats_.end() || depth > kMaxNesting) return false;
    for (const ULogField& field : format->second) {
      for (std::size_t i = 0; i < std::max<std::size_t>(1, field.count); ++i) {
        const std::string name =
            prefix + field.name + (field.count > 0 ? fmt::format("[{}]", i) : "");
        if (!AddOne(field.type, name, depth)) return false;
      }
    }
    return true;
  }

  std::vector<PackedField> fields;
  std::size_t size = 0;      // bytes, with padding
  std::size_t min_size = 0;  // without padding at the end
  bool too_large = false;    // for the room: the type may fit into a longer message

 private:
  bool AddOne(const std::string& type, const std::string& name, int depth) {
    if (++steps_ > kMaxSteps) return false;
    if (const auto scalar = kULogScalars.find(type); scalar != kULogScalars.end()) {
      const bool padding = name.find("_padding") != std::string::npos;
      if (!padding) fields.push_back({name, size, scalar->second});
      size += SizeOf(scalar->second);
      if (!padding) min_size = size;
      return Fits();
    }
    if (type == "char") {
      min_size = ++size;
      return Fits();
    }
    return Add(type, name + ".", depth + 1);
  }
  bool Fits() {
    too_large = min_size > room_;
    return !too_large && fields.size() <= kMaxFields && size <= kMaxULogMessage;
  }

  const ULogFormats& formats_;
  std::size_t room_;
  std::size_t steps_ = 0;  // fields visited, those without bytes too
};

constexpr double kShortestPulse = 800.0, kLongestPulse = 2200.0;  // us
constexpr double kFullDshot = 1999.0;
constexpr std::size_t kMotors = 4;  // the outputs that the map reads as motors

// NaN beyond the message's end.
double OutputAt(std::string_view message, std::size_t offset, std::size_t k) {
  const std::size_t place = offset + k * SizeOf(Scalar::kF32);
  if (place + SizeOf(Scalar::kF32) > message.size()) return std::nan("");
  return ReadScalar(Scalar::kF32, message.data() + place).Number();
}

// Zero is an output that is not used.
bool IsNoPulse(double output) {
  return (output > 0.0 && output < kShortestPulse) || output > kLongestPulse;
}

// PX4 before 1.14 has one parameter, which states the rate; 1.13 on has one for each group of
// timers, of which -5 to -2 are DShot150 to DShot1200.
bool SetsDshot(std::string_view name, std::int32_t value) {
  const bool of_timers = name.starts_with("PWM_") && name.find("_TIM") != std::string_view::npos;
  return (name == "DSHOT_CONFIG" && value > 0) || (of_timers && value >= -5 && value <= -2);
}

// DShot values are 0 (disarmed) or 1 to 1999 and would pass for short pulses of PWM. A log says by
// its parameters that an output is DShot, but not which of two drivers' outputs: the first message
// tells them apart, as PWM has no pulse below 800 us.
class ULogOutputs {
 public:
  // A parameter's record: whether it sets outputs to DShot.
  void AddParameter(std::string_view payload) {
    constexpr std::string_view kWhole = "int32_t ";
    ByteCursor cursor(payload);
    const std::string_view key = cursor.Bytes(cursor.Get<std::uint8_t>());
    const auto value = cursor.Get<std::int32_t>();
    if (!cursor.ok() || !key.starts_with(kWhole)) return;
    dshot_ |= SetsDshot(key.substr(kWhole.size()), value);
  }
  // Adds to a topic whose outputs are DShot a field dshot[k], 0 to 1, for each output[k].
  void Describe(std::uint16_t topic, const std::string& label, std::string_view first_message,
                std::vector<PackedField>* fields) {
    std::vector<PackedField> outputs;
    for (const PackedField& field : *fields) {
      if (field.name.starts_with("output[") && field.type == Scalar::kF32) outputs.push_back(field);
    }
    if (outputs.size() < kMotors) return;
    Outputs& found = topics_[topic];
    found.label = label;
    found.offset = outputs.front().offset;
    found.first = OutputAt(first_message, found.offset, 0);
    found.is_dshot = dshot_ && found.first < kShortestPulse;
    if (!found.is_dshot) return;
    for (const PackedField& output : outputs) {
      fields->push_back({"dshot" + output.name.substr(std::string_view("output").size()),
                         output.offset, output.type, "1", 1.0 / kFullDshot});
    }
  }
  // Counts a message of a topic described before.
  void AddMessage(std::uint16_t topic, std::string_view message) {
    const auto found = topics_.find(topic);
    if (found == topics_.end()) return;
    Outputs& outputs = found->second;
    ++outputs.messages;
    for (std::size_t k = 0; k < kMotors; ++k) {
      if (!IsNoPulse(OutputAt(message, outputs.offset, k))) continue;
      ++outputs.no_pulse;
      return;
    }
  }
  // What can't be read as pulses, or may not be; empty where DShot was told.
  std::vector<std::string> Warnings() const {
    constexpr const char* kRemedy =
        "for DShot give 'motors' in a map the columns output[0..3] with 'scale: 5.0025e-4' "
        "(1 / 1999), without 'offset' and 'accept'; else leave 'motors' out";
    std::vector<std::string> warnings;
    for (const auto& [topic, outputs] : topics_) {
      if (outputs.is_dshot) continue;
      if (outputs.no_pulse > 0) {
        warnings.push_back(fmt::format(
            "{}: {} of {} messages hold values that are no PWM pulses of 800 to 2200 us, "
            "so that motor commands read as such are wrong; {}",
            outputs.label, outputs.no_pulse, outputs.messages, kRemedy));
      } else if (dshot_) {
        warnings.push_back(
            fmt::format("{}: the parameters set DShot, but the first output is {:.5g}, so that all "
                        "are read as PWM pulses (us); if they are DShot's, {}",
                        outputs.label, outputs.first, kRemedy));
      }
    }
    return warnings;
  }

 private:
  struct Outputs {
    std::string label;
    std::size_t offset = 0;  // of output[0], bytes
    bool is_dshot = false;
    double first = 0.0;                      // output[0] of the first message
    std::size_t messages = 0, no_pulse = 0;  // all, and those with a value that PWM has not
  };

  bool dshot_ = false;  // by the parameters
  std::map<std::uint16_t, Outputs> topics_;
};

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
