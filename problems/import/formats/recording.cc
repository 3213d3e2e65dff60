#include "problems/import/formats/recording.h"

#include <fmt/format.h>

#include <algorithm>

namespace trueline {

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
  format_.walk(file_, this);
}

std::vector<std::size_t> Recording::Visit(const std::vector<std::size_t>& wanted,
                                          const Visitor& visit) {
  wanted_.assign(channels_.size(), false);
  for (const std::size_t channel : wanted) wanted_[channel] = true;
  undecoded_.assign(channels_.size(), 0);
  visit_ = &visit;
  format_.walk(file_, this);
  visit_ = nullptr;
  std::vector<std::size_t> counts;
  counts.reserve(wanted.size());
  for (const std::size_t channel : wanted) counts.push_back(undecoded_[channel]);
  return counts;
}

std::size_t Recording::AddChannel(const std::string& name, int instance, const std::string& type,
                                  const MakeDecoder& make) {
  const auto [place, is_new] = index_.try_emplace({name, instance, type}, channels_.size());
  if (is_new) {
    channels_.push_back({.name = name, .instance = instance, .type = type, .fields = {}});
    decoders_.push_back(make());
  }
  return place->second;
}

void Recording::Add(std::size_t channel, TimeNs recorded, std::string_view message) {
  if (visit_ == nullptr) return Scan(channel, recorded, message);
  if (channel >= wanted_.size() || !wanted_[channel]) return;
  const Channel& of = channels_[channel];
  record_.time = recorded;
  record_.cells.assign(of.fields.size(), Cell());
  if (!decoders_[channel] || !decoders_[channel]->Decode(message, &record_.cells)) {
    ++undecoded_[channel];
    return;
  }
  TimeNs stamp = 0;  // an unset stamp is zero
  if (of.stamp_field >= 0 &&
      record_.cells[static_cast<std::size_t>(of.stamp_field)].Time(of.stamp_exponent, &stamp) &&
      stamp != 0) {
    record_.time = stamp;
  }
  (*visit_)(channel, record_);
}

void Recording::Scan(std::size_t channel, TimeNs recorded, std::string_view message) {
  Channel& of = channels_[channel];
  if (of.count++ == 0) of.first = recorded;
  of.last = recorded;
  if (!of.fields.empty() || !decoders_[channel]) return;
  if (!decoders_[channel]->Describe(message, &of)) of.fields.clear();
}

void Recording::Warn(const std::string& warning) {
  if (visit_ == nullptr) warnings_.push_back(fmt::format("{}: {}", file_, warning));
}

}  // namespace trueline
