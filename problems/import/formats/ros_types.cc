#include "problems/import/formats/ros_types.h"

#include <fmt/format.h>

#include <charconv>
#include <sstream>

namespace trueline {
namespace {

const std::map<std::string, Scalar, std::less<>> kRosScalars = {
    {"bool", Scalar::kU8},     {"byte", Scalar::kU8},    {"char", Scalar::kU8},
    {"int8", Scalar::kI8},     {"uint8", Scalar::kU8},   {"int16", Scalar::kI16},
    {"uint16", Scalar::kU16},  {"int32", Scalar::kI32},  {"uint32", Scalar::kU32},
    {"int64", Scalar::kI64},   {"uint64", Scalar::kU64}, {"float32", Scalar::kF32},
    {"float64", Scalar::kF64}, {"float", Scalar::kF32},  {"double", Scalar::kF64},
    {"octet", Scalar::kU8}};

// Takes "[]", "[n]" or "[<=n]" off the end of a type.
bool TakeList(std::string* type, RosField* field) {
  const std::size_t bracket = type->find('[');
  if (bracket == std::string::npos) return true;
  field->is_list = true;
  const std::string inside = type->substr(bracket + 1);
  type->resize(bracket);
  if (inside == "]" || inside.starts_with("<=")) return true;
  std::uint32_t length = 0;
  const char* end = inside.data() + inside.size();
  const auto [stop, error] = std::from_chars(inside.data(), end, length);
  if (error != std::errc() || stop + 1 != end || *stop != ']') return false;
  field->length = length;
  return true;
}

// `package` is that of the type that the field belongs to.
void SetKind(const std::string& type, const std::string& package, RosField* field) {
  const std::string plain = type.substr(0, type.find('<'));  // string<=10 is a string
  if (const auto scalar = kRosScalars.find(plain); scalar != kRosScalars.end()) {
    field->scalar = scalar->second;
    return;
  }
  const std::string name = RosTypeName(plain);
  if (plain == "string") {
    field->kind = RosKind::kText;
  } else if (plain == "wstring") {
    field->kind = RosKind::kWideText;
  } else if (plain == "time" || plain == "duration" || name == "builtin_interfaces/Time" ||
             name == "builtin_interfaces/Duration") {
    field->kind = RosKind::kTime;
  } else {
    field->kind = RosKind::kMessage;
    const bool is_header = name == "Header";
    field->message = is_header
                         ? "std_msgs/Header"
                         : (name.find('/') == std::string::npos ? package + "/" + name : name);
  }
}

enum class RosLine { kEmpty, kField, kBad };

// "type name", "type name default", "type NAME=constant", with a comment.
RosLine ParseRosLine(std::string line, const std::string& package, RosField* field) {
  line = line.substr(0, line.find('#'));
  std::istringstream words(line);
  std::string type, rest;
  if (!(words >> type)) return RosLine::kEmpty;
  if (!(words >> field->name)) return RosLine::kBad;
  std::getline(words, rest);
  const std::size_t equals = field->name.find('=');
  const std::size_t first = rest.find_first_not_of(" \t");
  if (equals != std::string::npos) return RosLine::kEmpty;
  if (first != std::string::npos && rest[first] == '=') return RosLine::kEmpty;
  if (!TakeList(&type, field)) return RosLine::kBad;
  SetKind(type, package, field);
  return RosLine::kField;
}

}  // namespace

std::string RosTypeName(std::string_view name) {
  const std::size_t middle = name.find("/msg/");
  if (middle == std::string_view::npos) return std::string(name);
  return std::string(name.substr(0, middle)) + std::string(name.substr(middle + 4));
}

bool ParseRosDefinition(const std::string& name, std::string_view definition, RosTypes* types) {
  std::string type = RosTypeName(name);
  if (!type.empty()) (*types)[type].clear();
  std::istringstream lines{std::string(definition)};
  for (std::string line; std::getline(lines, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (line.starts_with("===")) continue;
    if (line.starts_with("MSG: ")) {
      type = RosTypeName(line.substr(5, line.find_last_not_of(" \t") - 4));
      (*types)[type].clear();
      continue;
    }
    RosField field;
    const RosLine parsed = ParseRosLine(line, type.substr(0, type.find('/')), &field);
    if (parsed == RosLine::kBad) return false;
    if (parsed == RosLine::kField) (*types)[type].push_back(field);
  }
  return true;
}

std::string RosLayout(const std::string& name, const std::string& definition) {
  RosTypes types;
  if (!ParseRosDefinition(name, definition, &types)) return definition;
  std::string layout;
  for (const auto& [type, fields] : types) {
    layout += type + ":";
    for (const RosField& field : fields) {
      layout += fmt::format("{} {} {} {} {} {};", field.name, static_cast<int>(field.kind),
                            static_cast<int>(field.scalar), field.message, field.is_list,
                            field.length.value_or(0));
    }
  }
  return layout;
}

}  // namespace trueline
