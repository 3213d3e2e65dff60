#include "problems/import/formats/recording.h"

#include <fmt/format.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <type_traits>
#include <unordered_set>

#include "problems/import/formats/bytes.h"
#include "problems/log/unpacked.h"

namespace trueline {
namespace {

constexpr std::size_t kLooks = 500;  // first messages of a channel that may add fields

// Whether `a` has all fields of `b`, and more.
bool HasMoreFields(const Channel& a, const Channel& b) {
  if (a.fields.size() <= b.fields.size()) return false;
  std::unordered_set<std::string_view> names;
  for (const ChannelField& field : a.fields) names.insert(field.name);
  return std::all_of(b.fields.begin(), b.fields.end(),
                     [&](const ChannelField& field) { return names.contains(field.name); });
}

template <class T>
Cell CellOf(const char* bytes) {
  const T value = LoadLittle<T>(bytes);
  if constexpr (std::is_same_v<T, std::uint64_t>) {
    if (value >> 63 != 0) return Cell(static_cast<double>(value));
  }
  if constexpr (std::is_integral_v<T>) {
    return Cell(static_cast<std::int64_t>(value));
  } else {
    return Cell(static_cast<double>(value));
  }
}

// IEEE 754 binary16.
Cell HalfCell(const char* bytes) {
  const auto half = Eigen::numext::bit_cast<Eigen::half>(LoadLittle<std::uint16_t>(bytes));
  return Cell(static_cast<double>(static_cast<float>(half)));
}

// In the order of Scalar.
struct ScalarType {
  std::size_t size;  // bytes
  Cell (*read)(const char* bytes);
};
constexpr ScalarType kScalars[] = {
    {1, CellOf<std::int8_t>},   {1, CellOf<std::uint8_t>},  {2, CellOf<std::int16_t>},
    {2, CellOf<std::uint16_t>}, {4, CellOf<std::int32_t>},  {4, CellOf<std::uint32_t>},
    {8, CellOf<std::int64_t>},  {8, CellOf<std::uint64_t>}, {2, HalfCell},
    {4, CellOf<float>},         {8, CellOf<double>},
};

}  // namespace

std::string Channel::Label() const {
  return instance == 0 ? name : fmt::format("{}[{}]", name, instance);
}

double Channel::Rate() const {
  const double span = ToSeconds(last) - ToSeconds(first);  // damaged stamps may be anything
  return count > 1 && span > 0.0 ? static_cast<double>(count - 1) / span : 0.0;
}

int Channel::IndexOf(const std::string& field) const {
  const auto found = std::find_if(fields.begin(), fields.end(),
                                  [&](const ChannelField& f) { return f.name == field; });
  return found == fields.end() ? -1 : static_cast<int>(found - fields.begin());
}

void Channel::SetStamp(const std::string& field, int exponent) {
  stamp_field = IndexOf(field);
  stamp_exponent = exponent;
}

Recording::Recording(const std::filesystem::path& path, const LogFormat& format)
    : file_(path.string()), format_(format) {
  Walk();
  described_by_.clear();
  WarnOfRefusals();
}

std::vector<std::size_t> Recording::Visit(const std::vector<std::size_t>& wanted,
                                          const Visitor& visit) {
  wanted_.assign(channels_.size(), false);
  for (const std::size_t channel : wanted) wanted_[channel] = true;
  undecoded_.assign(channels_.size(), 0);
  visit_ = &visit;
  record_.place = 0;
  Walk();
  visit_ = nullptr;
  std::vector<std::size_t> counts;
  counts.reserve(wanted.size());
  for (const std::size_t channel : wanted) counts.push_back(undecoded_[channel]);
  return counts;
}

// The content of an archive of several files is a folder.
void Recording::Walk() {
  const std::filesystem::path content = Unpacked(file_);
  format_.walk(std::filesystem::is_directory(content) ? content : std::filesystem::path(file_),
               this);
}

std::size_t Recording::AddChannel(const ChannelKey& key, const MakeDecoder& make) {
  const auto [place, is_new] = index_.try_emplace(key, channels_.size());
  if (is_new) {
    channels_.push_back(
        {.name = key.name, .instance = key.instance, .type = key.type, .fields = {}});
    decoders_.push_back(make());
    described_by_.emplace_back();
  }
  return place->second;
}

void Recording::Add(std::size_t channel, TimeNs recorded, std::string_view message) {
  if (visit_ == nullptr) return Scan(channel, recorded, message);
  ++record_.place;
  if (channel >= wanted_.size() || !wanted_[channel]) return;
  const Channel& of = channels_[channel];
  record_.time = recorded;
  record_.is_unstamped = false;
  record_.cells.assign(of.fields.size(), Cell());
  if (!decoders_[channel] || !decoders_[channel]->Decode(message, &record_.cells)) {
    ++undecoded_[channel];
    return;
  }
  if (of.stamp_field >= 0) {
    const Cell& cell = record_.cells[static_cast<std::size_t>(of.stamp_field)];
    TimeNs stamp = 0;  // an unset stamp is zero
    if (!cell.Time(of.stamp_exponent, &stamp) && std::isfinite(cell.Number())) {
      ++undecoded_[channel];  // a number that is no time
      return;
    }
    if (stamp != 0) record_.time = stamp;
    record_.is_unstamped = stamp == 0 && recorded != 0;
  }
  (*visit_)(channel, record_);
}

void Recording::Scan(std::size_t channel, TimeNs recorded, std::string_view message) {
  Channel& of = channels_[channel];
  if (of.count++ == 0) of.first = recorded;
  of.last = recorded;
  if (!decoders_[channel]) return;
  const bool look = of.fields.empty() || (of.count <= kLooks && decoders_[channel]->MayGrow());
  if (look) Describe(channel, message);
}

// A list may be empty in a channel's first message and full in the others. The message with the
// most fields describes the channel, if it has all fields that were there before.
void Recording::Describe(std::size_t channel, std::string_view message) {
  Channel& of = channels_[channel];
  const auto describe = [&](std::string_view by) {
    Channel described;
    if (!decoders_[channel]->Describe(by, &described)) described.fields.clear();
    return described;
  };
  Channel described = describe(message);
  if (HasMoreFields(described, of)) {
    of.fields = std::move(described.fields);
    of.stamp_field = described.stamp_field;
    of.stamp_exponent = described.stamp_exponent;
    described_by_[channel] = decoders_[channel]->MayGrow() ? message : std::string_view();
  } else if (!of.fields.empty()) {
    describe(described_by_[channel]);  // the decoder is as before again
  }
}

void Recording::WarnOfRefusals() {
  for (std::size_t i = 0; i < channels_.size(); ++i) {
    const std::string why = decoders_[i] ? decoders_[i]->Refusal() : "";
    if (!why.empty()) Warn(fmt::format("{} is left out: {}", channels_[i].Label(), why));
  }
}

void Recording::Warn(const std::string& warning) {
  if (visit_ == nullptr) warnings_.push_back(fmt::format("{}: {}", file_, warning));
}

bool NamedFields::Describe(const std::vector<NamedCell>& row, Channel* channel) {
  places_.clear();
  for (const NamedCell& cell : row) {
    if (!places_.try_emplace(cell.name, channel->fields.size()).second) continue;
    channel->fields.push_back({cell.name, cell.is_time ? "ns" : ""});
    const bool is_stamp = cell.name == "timestamp" || cell.name == "header.stamp";
    if (cell.is_time && is_stamp) channel->SetStamp(cell.name, 0);
  }
  return !row.empty();
}

void NamedFields::Place(const std::vector<NamedCell>& row, std::vector<Cell>* cells) const {
  for (const NamedCell& cell : row) {
    const auto place = places_.find(cell.name);
    if (place != places_.end() && place->second < cells->size()) {
      (*cells)[place->second] = cell.cell;
    }
  }
}

bool Cell::Time(int exponent, TimeNs* time) const {
  std::int64_t factor = 1;
  for (int i = 0; i < exponent; ++i) factor *= 10;
  if (whole_) {
    std::int64_t product = 0;  // what wraps must not reach callers
    if (__builtin_mul_overflow(Load<std::int64_t>(), factor, &product)) return false;
    *time = product;
    return true;
  }
  const double count = Load<double>() * static_cast<double>(factor);
  if (!(std::abs(count) < 9e18)) return false;
  *time = std::llround(count);
  return true;
}

std::size_t SizeOf(Scalar type) { return kScalars[static_cast<std::size_t>(type)].size; }

Cell ReadScalar(Scalar type, const char* bytes) {
  return kScalars[static_cast<std::size_t>(type)].read(bytes);
}

}  // namespace trueline
