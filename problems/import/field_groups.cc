#include "problems/import/field_groups.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <utility>

#include "problems/log/csv_text.h"

namespace trueline {
namespace {

struct Spelling {
  std::string_view text, unit;
};

// How names spell units, as PlainUnit() has them.
constexpr auto kSpellings = std::to_array<Spelling>({
    {"m/s2", "m/s^2"},   {"m/s/s", "m/s^2"}, {"ms-2", "m/s^2"},  {"mps2", "m/s^2"},
    {"m_s2", "m/s^2"},   {"g", "g"},         {"mg", "mg"},       {"rad/s", "rad/s"},
    {"rads-1", "rad/s"}, {"rad_s", "rad/s"}, {"radps", "rad/s"}, {"deg/s", "deg/s"},
    {"degs-1", "deg/s"}, {"deg_s", "deg/s"}, {"degps", "deg/s"}, {"dps", "deg/s"},
    {"deg", "deg"},      {"rad", "rad"},     {"m", "m"},         {"cm", "cm"},
    {"mm", "mm"},        {"ft", "ft"},       {"m/s", "m/s"},     {"ms-1", "m/s"},
    {"mps", "m/s"},      {"cm/s", "cm/s"},   {"mm/s", "mm/s"},   {"mrad/s", "mrad/s"},
});

// In lower case, without blanks and marks of powers, words as their symbols: "m/s²", "m s^-2",
// "degrees/sec" and "Meters" are "m/s2", "ms-2", "deg/s" and "m".
std::string PlainUnit(std::string_view text) {
  constexpr std::array<std::pair<std::string_view, std::string_view>, 19> kSame = {{
      {"²", "2"},      {"°", "deg"},    {"⁻", "-"},         {"¹", "1"},        {"·", ""},
      {"**", ""},      {"^", ""},       {" ", ""},          {"seconds", "s"},  {"second", "s"},
      {"secs", "s"},   {"sec", "s"},    {"degrees", "deg"}, {"degree", "deg"}, {"radians", "rad"},
      {"meters", "m"}, {"metres", "m"}, {"meter", "m"},     {"metre", "m"},
  }};
  std::string unit = LowerCase(std::string(text));
  for (const auto& [from, to] : kSame) {
    for (std::size_t at = unit.find(from); at != std::string::npos; at = unit.find(from, at)) {
      unit.replace(at, from.size(), to);
    }
  }
  return unit;
}

std::string_view UnitSpelled(std::string_view text) {
  const std::string plain = PlainUnit(text);
  const auto found = std::find_if(kSpellings.begin(), kSpellings.end(),
                                  [&](const Spelling& spelling) { return spelling.text == plain; });
  return found == kSpellings.end() ? "" : found->unit;
}

// "Acc X [g]", "acc_x_g" and "acc x (g)" as a name and a unit; none for "q[0]".
struct NameAndUnit {
  std::string name;  // in lower case
  std::string_view unit;
};

// A text in brackets at the end that is no element, as in "q[0]", is a unit, known or not.
NameAndUnit SplitUnit(const ChannelField& field) {
  std::string name = LowerCase(field.name);
  std::string_view unit = UnitSpelled(field.unit);
  const std::size_t open = name.find_last_of("[(");
  const bool closed =
      open != std::string::npos && open > 0 && name.back() == (name[open] == '[' ? ']' : ')');
  if (closed) {
    const std::string_view inside = std::string_view(name).substr(open + 1, name.size() - open - 2);
    const bool is_element = !inside.empty() && name[open - 1] != ' ' &&
                            std::isdigit(static_cast<unsigned char>(inside.front())) != 0;
    if (is_element) return {name, unit};
    const std::string bare(TrimmedField(std::string_view(name).substr(0, open)));
    if (inside.size() == 1 && inside.front() >= 'w' && inside.front() <= 'z') {
      return {fmt::format("{}_{}", bare, inside), unit};  // "acc[x]"
    }
    return {bare, unit.empty() ? UnitSpelled(inside) : unit};
  }
  if (!unit.empty()) return {name, unit};
  for (const auto& [text, spelled] : kSpellings) {
    const std::string end = fmt::format("_{}", text);
    if (!name.ends_with(end) || name.size() == end.size()) continue;
    return {name.substr(0, name.size() - end.size()), spelled};
  }
  return {name, ""};
}

bool IsSeparator(char c) { return std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '['; }

void Add(const std::string& stem, const std::string& part, std::string_view unit,
         const ChannelField& field, std::vector<FieldGroup>* groups) {
  auto group = std::find_if(groups->begin(), groups->end(),
                            [&](const FieldGroup& g) { return g.stem == stem; });
  if (group == groups->end()) group = groups->insert(group, {stem, unit, {}});
  if (group->unit.empty()) group->unit = unit;
  group->parts[part] = field.name;
}

}  // namespace

std::vector<std::string> WordsOf(const std::string& name) {
  std::vector<std::string> words(1);
  for (const char c : LowerCase(name)) {
    if (std::isalpha(static_cast<unsigned char>(c)) != 0) {
      words.back() += c;
    } else if (!words.back().empty()) {
      words.emplace_back();
    }
  }
  return words;
}

namespace {

bool IsOfSetpoint(const std::string& word) {
  for (const char* whole : {"ref", "des", "set", "sp", "cmd", "target", "goal", "est"}) {
    if (word == whole) return true;
  }
  for (const char* start : {"setpoint", "command", "reference", "desired", "estimat"}) {
    if (word.starts_with(start)) return true;
  }
  return false;
}

}  // namespace

bool IsSetpointOrEstimate(const std::string& name) {
  const std::vector<std::string> words = WordsOf(name);
  return std::any_of(words.begin(), words.end(), IsOfSetpoint);
}

std::vector<FieldGroup> GroupsOf(const Channel& channel) {
  std::vector<FieldGroup> groups;
  for (const ChannelField& field : channel.fields) {
    const auto [name, unit] = SplitUnit(field);
    const std::size_t start = name.ends_with(']') ? name.rfind('[') : name.size() - 1;
    if (name.empty() || start == std::string::npos) continue;
    Add(name.substr(0, start), name.substr(start), unit, field, &groups);
    if (name.size() > 2 && IsSeparator(name[1])) {
      Add(name.substr(2), name.substr(0, 1), unit, field, &groups);
    } else if (name.size() > 2 && name[0] >= 'x' && name[0] <= 'z') {
      Add(name.substr(1), name.substr(0, 1), unit, field, &groups);  // "xgyro"
    }
    for (const std::string_view direction : {"north", "east", "down", "up"}) {
      if (!name.ends_with(direction)) continue;
      Add(name.substr(0, name.size() - direction.size()), std::string(direction.substr(0, 1)), unit,
          field, &groups);
    }
  }
  std::stable_partition(groups.begin(), groups.end(),
                        [](const FieldGroup& g) { return !IsSetpointOrEstimate(g.stem); });
  return groups;
}

// Groups of roll, pitch and yaw whose names end in `end`, the parts "x", "y" and "z".
std::vector<FieldGroup> RollPitchYaw(const Channel& channel, const std::string& end) {
  constexpr std::array<std::array<const char*, 7>, 3> kAngles = {
      {{"x", "roll", "phi", "rollwinkel", "roulis", "alabeo", "rx"},
       {"y", "pitch", "theta", "nickwinkel", "tangage", "cabeceo", "ry"},
       {"z", "yaw", "psi", "gierwinkel", "lacet", "guiñada", "rz"}}};
  std::vector<FieldGroup> groups;
  for (const ChannelField& field : channel.fields) {
    const auto [name, unit] = SplitUnit(field);
    for (const auto& spellings : kAngles) {
      for (std::size_t spelling = 1; spelling < spellings.size(); ++spelling) {
        const std::string angle = spellings[spelling] + end;
        if (!name.ends_with(angle)) continue;
        const std::string stem = name.substr(0, name.size() - angle.size());
        // "rx", but not the end of "gyrx".
        const bool is_short = std::string_view(spellings[spelling]).size() == 2;
        if (is_short && !stem.empty() && !IsSeparator(stem.back())) continue;
        Add(fmt::format("{}:{}", spelling, stem), spellings[0], unit, field, &groups);
      }
    }
  }
  // What a controller wants is no measurement.
  std::erase_if(groups, [](const FieldGroup& g) {
    return g.parts.size() < 3 || g.stem.find("controller.") != std::string::npos;
  });
  return groups;
}

std::vector<FieldGroup> AngleRatesOf(const Channel& channel) {
  std::vector<FieldGroup> groups;
  for (const char* end : {"_rate", ".rate", "rate", "speed", "_speed", " rate"}) {
    for (FieldGroup& group : RollPitchYaw(channel, end)) groups.push_back(std::move(group));
  }
  std::erase_if(groups, [](const FieldGroup& g) { return IsSetpointOrEstimate(g.stem); });
  return groups;
}

FieldGroup EulerAnglesOf(const Channel& channel) {
  std::vector<FieldGroup> groups = RollPitchYaw(channel, "");
  std::erase_if(groups, [](const FieldGroup& g) { return g.unit.ends_with("/s"); });
  std::stable_partition(groups.begin(), groups.end(),
                        [](const FieldGroup& g) { return !IsSetpointOrEstimate(g.stem); });
  return groups.empty() ? FieldGroup{} : groups.front();
}

}  // namespace trueline
