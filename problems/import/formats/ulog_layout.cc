#include "problems/import/formats/ulog_layout.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>

#include "problems/import/formats/bytes.h"

namespace trueline {
namespace {

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

}  // namespace

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

bool ULogLayout::Add(std::string_view type, const std::string& prefix, int depth) {
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

bool ULogLayout::Fits() {
  too_large = min_size > room_;
  return !too_large && fields.size() <= kMaxFields && size <= kMaxULogMessage;
}

bool ULogLayout::AddOne(const std::string& type, const std::string& name, int depth) {
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

}  // namespace trueline
