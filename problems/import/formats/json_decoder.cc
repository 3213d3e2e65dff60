#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "problems/import/formats/recording.h"
#include "problems/import/formats/ros_decoder.h"
#include "problems/log/units.h"

namespace trueline {
namespace {

using nlohmann::json;

// {sec, nsec}, {sec, nanosec} or {secs, nsecs}, or a date and time as text.
bool JsonTime(const json& value, Cell* time) {
  if (value.is_string()) {
    const auto& text = value.get_ref<const std::string&>();
    TimeNs date = 0;
    if (text.find('-') == std::string::npos || !ParseDateTime(text, &date)) return false;
    *time = Cell(std::int64_t{date});
    return true;
  }
  if (!value.is_object() || value.size() != 2) return false;
  for (const auto& [seconds, nanoseconds] :
       {std::pair{"sec", "nsec"}, {"sec", "nanosec"}, {"secs", "nsecs"}}) {
    const auto s = value.find(seconds);
    const auto ns = value.find(nanoseconds);
    if (s == value.end() || ns == value.end()) continue;
    if (!s->is_number_integer() || !ns->is_number_integer()) return false;
    TimeNs whole = 0;
    if (!Cell(s->get<std::int64_t>()).Time(9, &whole)) return false;
    *time = Cell(
        static_cast<std::int64_t>(static_cast<std::uint64_t>(whole) + ns->get<std::uint64_t>()));
    return true;
  }
  return false;
}

void FlattenJson(const json& value, const std::string& name, int depth,
                 std::vector<NamedCell>* row) {
  if (depth > kMaxNamedDepth || row->size() >= kMaxNamedCells) return;
  Cell time;
  if (JsonTime(value, &time)) {
    row->push_back({name, time, true});
  } else if (value.is_object()) {
    for (const auto& [key, part] : value.items()) {
      FlattenJson(part, name.empty() ? key : name + "." + key, depth + 1, row);
    }
  } else if (value.is_array()) {
    for (std::size_t i = 0; i < std::min(value.size(), kMaxNamedElements); ++i) {
      FlattenJson(value[i], fmt::format("{}[{}]", name, i), depth + 1, row);
    }
  } else if (value.is_number_integer() && !value.is_number_unsigned()) {
    row->push_back({name, Cell(value.get<std::int64_t>())});
  } else if (value.is_number_unsigned() && value.get<std::uint64_t>() >> 63 == 0) {
    row->push_back({name, Cell(static_cast<std::int64_t>(value.get<std::uint64_t>()))});
  } else if (value.is_number()) {
    row->push_back({name, Cell(value.get<double>())});
  } else if (value.is_boolean()) {
    row->push_back({name, Cell(static_cast<std::int64_t>(value.get<bool>()))});
  }
}

class JsonDecoder final : public NamedRowDecoder {
 private:
  bool Parse(std::string_view message, std::vector<NamedCell>* row) const override {
    const json value = json::parse(message, nullptr, false);
    if (value.is_discarded()) return false;
    FlattenJson(value, "", 0, row);
    return true;
  }
};

}  // namespace

std::unique_ptr<MessageDecoder> MakeJsonDecoder() { return std::make_unique<JsonDecoder>(); }

}  // namespace trueline
