#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <boost/crc.hpp>
#include <cmath>
#include <iterator>
#include <numbers>

#include "problems/common/error.h"
#include "problems/import/formats/bytes.h"
#include "problems/import/formats/open_recording.h"

namespace trueline {
namespace {

constexpr std::size_t kMaxUsdHeader = 1 << 20;  // bytes
constexpr std::size_t kUsdCrc = 4;

// Letters of Python's struct.
const std::map<char, Scalar> kUsdLetters = {
    {'b', Scalar::kI8},  {'B', Scalar::kU8},  {'h', Scalar::kI16}, {'H', Scalar::kU16},
    {'i', Scalar::kI32}, {'I', Scalar::kU32}, {'q', Scalar::kI64}, {'Q', Scalar::kU64},
    {'f', Scalar::kF32}, {'d', Scalar::kF64}};

struct UsdEvent {
  std::string name;
  std::vector<PackedField> fields;
  std::size_t size = 0;  // bytes of the variables
  std::size_t channel = 0;
};

// Quaternions of stateEstimateZ are packed: the place of the largest component of x, y, z, w in the
// two top bits, then a sign and 9 bits of size for each of the others, in units of sqrt(1/2) / 511.
bool IsPackedQuaternion(const PackedField& field) {
  return field.name.ends_with(".quat") && field.type == Scalar::kU32;
}

std::array<double, 4> UnpackQuaternion(std::uint32_t packed) {
  constexpr double kStep = std::numbers::sqrt2 / 2.0 / 511.0;
  const std::size_t largest = packed >> 30;
  std::array<double, 4> q{};
  double rest = 1.0;
  for (std::size_t i = 4; i-- > 0;) {
    if (i == largest) continue;
    q[i] = kStep * static_cast<double>(packed & 511) * ((packed >> 9 & 1) != 0 ? -1.0 : 1.0);
    rest -= q[i] * q[i];
    packed >>= 10;
  }
  q[largest] = std::sqrt(std::max(0.0, rest));
  return q;
}

// Appends to an event's variables "group.qx", y, z and w of its packed quaternions.
class UsdDecoder final : public MessageDecoder {
 public:
  UsdDecoder(const std::vector<PackedField>& fields, std::size_t size)
      : variables_(fields, size, "", 0), count_(fields.size()) {
    std::copy_if(fields.begin(), fields.end(), std::back_inserter(packed_), IsPackedQuaternion);
  }

  bool Describe(std::string_view message, Channel* channel) override {
    if (!variables_.Describe(message, channel)) return false;
    for (const PackedField& field : packed_) {
      const std::string group = field.name.substr(0, field.name.size() - 4);
      for (const char axis : {'x', 'y', 'z', 'w'}) {
        channel->fields.push_back({fmt::format("{}q{}", group, axis), ""});
      }
    }
    return true;
  }

  bool Decode(std::string_view message, std::vector<Cell>* cells) const override {
    cells->resize(count_);
    if (!variables_.Decode(message, cells)) return false;
    for (const PackedField& field : packed_) {
      const auto packed = LoadLittle<std::uint32_t>(message.data() + field.offset);
      for (const double component : UnpackQuaternion(packed)) cells->emplace_back(component);
    }
    return true;
  }

 private:
  PackedDecoder variables_;
  std::size_t count_;  // of the variables
  std::vector<PackedField> packed_;
};

// "group.name(t)"
bool ParseUsdVariable(std::string_view text, UsdEvent* event) {
  if (text.size() < 4 || text[text.size() - 3] != '(' || text.back() != ')') return false;
  const auto letter = kUsdLetters.find(text[text.size() - 2]);
  if (letter == kUsdLetters.end()) return false;
  event->fields.push_back(
      {std::string(text.substr(0, text.size() - 3)), event->size, letter->second});
  event->size += SizeOf(letter->second);
  return true;
}

class UsdWalk {
 public:
  UsdWalk(const std::filesystem::path& path, MessageSink* sink) : file_(path), sink_(sink) {}

  void Run() {
    ReadHeader();
    while (Next()) {
    }
    CheckCrc();
    sink_->WarnOf(untimed_, "records have no possible time stamp; they are left out");
  }

 private:
  void ReadHeader() {
    std::string_view start;
    file_.Peek(kMaxUsdHeader, &start);
    ByteCursor cursor(start);
    cursor.Get<std::uint8_t>();
    version_ = cursor.Get<std::uint16_t>();
    const auto types = cursor.Get<std::uint16_t>();
    for (int i = 0; i < types && cursor.ok(); ++i) {
      const auto id = cursor.Get<std::uint16_t>();
      UsdEvent& event = events_[id];
      event.name = cursor.Until('\0');
      const auto variables = cursor.Get<std::uint16_t>();
      for (int k = 0; k < variables && cursor.ok(); ++k) {
        if (!ParseUsdVariable(cursor.Until('\0'), &event)) Refuse();
      }
    }
    if (!cursor.ok()) Refuse();
    std::string_view header;
    const std::size_t size = cursor.at();
    file_.Read(size, &header);
    crc_.process_bytes(header.data(), header.size());
    for (auto& [id, event] : events_) {
      const ChannelKey key{event.name, 0, "", PackedLayout(event.fields)};
      event.channel = sink_->AddChannel(
          key, [&event = event] { return std::make_unique<UsdDecoder>(event.fields, event.size); });
    }
  }

  [[noreturn]] void Refuse() const {
    throw ErrorAt(file_.file(), 0,
                  "starts as a log of a Crazyflie's micro-SD card, but its list of events is "
                  "malformed; copy it from the card again");
  }

  bool Next() {
    const std::size_t time_size = version_ == 1 ? 4 : 8;
    std::string_view head;
    if (file_.position() + kUsdCrc >= file_.size()) return false;
    if (!file_.Peek(2 + time_size, &head)) return false;
    const auto event = events_.find(LoadLittle<std::uint16_t>(head.data()));
    if (event == events_.end()) {
      sink_->Warn(fmt::format("has no event of a known type at byte {}; the rest is left out",
                              file_.position()));
      return false;
    }
    std::string_view record;
    if (!file_.Read(2 + time_size + event->second.size, &record)) return false;
    crc_.process_bytes(record.data(), record.size());
    TimeNs time = 0;
    const Cell stamp = ReadScalar(version_ == 1 ? Scalar::kU32 : Scalar::kU64, record.data() + 2);
    if (stamp.Time(version_ == 1 ? 6 : 3, &time)) {
      sink_->Add(event->second.channel, time, record.substr(2 + time_size));
    } else {
      ++untimed_;
    }
    return true;
  }

  void CheckCrc() {
    std::string_view crc;
    const bool complete = file_.position() + kUsdCrc == file_.size() && file_.Read(kUsdCrc, &crc);
    if (complete && LoadLittle<std::uint32_t>(crc.data()) == crc_.checksum()) return;
    sink_->Warn(fmt::format("has no right CRC at its end: it was cut at byte {}, or is damaged",
                            file_.position()));
  }

  ByteFile file_;
  MessageSink* sink_;
  std::uint16_t version_ = 0;
  std::map<std::uint16_t, UsdEvent> events_;
  boost::crc_32_type crc_;
  std::size_t untimed_ = 0;
};

}  // namespace

bool IsCrazyflie(std::string_view start) {
  ByteCursor cursor(start);
  const auto magic = cursor.Get<std::uint8_t>();
  const auto version = cursor.Get<std::uint16_t>();
  const auto types = cursor.Get<std::uint16_t>();
  return cursor.ok() && magic == 0xBC && (version == 1 || version == 2) && types > 0 && types < 256;
}

void WalkCrazyflie(const std::filesystem::path& path, MessageSink* sink) {
  UsdWalk(path, sink).Run();
}

}  // namespace trueline
