#include "problems/import/propose_streams.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <limits>
#include <utility>

#include "problems/common/app.h"
#include "problems/import/formats/open_recording.h"
#include "problems/log/csv_text.h"
#include "problems/log/units.h"

namespace trueline {
namespace {

// Fields of a channel that belong together, and their unit, by what their names say.

// Fields that differ only in their last part, as in "acc_x", "q[0]" or "q0", or in their first one,
// as in "x_acc". North, east, down and up are the parts "n", "e", "d" and "u".
struct FieldGroup {
  std::string stem;                          // in lower case
  std::string_view unit;                     // of the first that states one; empty without any
  std::map<std::string, std::string> parts;  // field by its part: "x", "0" or "[0]"
};

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

// The words of a name, in lower case.
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

bool IsOfSetpoint(const std::string& word) {
  for (const char* whole : {"ref", "des", "set", "sp", "cmd", "target", "goal", "est"}) {
    if (word == whole) return true;
  }
  for (const char* start : {"setpoint", "command", "reference", "desired", "estimat"}) {
    if (word.starts_with(start)) return true;
  }
  return false;
}

// Whether a word of the name says that it is of a setpoint or an estimate.
bool IsSetpointOrEstimate(const std::string& name) {
  const std::vector<std::string> words = WordsOf(name);
  return std::any_of(words.begin(), words.end(), IsOfSetpoint);
}

// Groups of setpoints and estimates come after all others.
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

// The fields of their rates, as in "roll_rate".
std::vector<FieldGroup> AngleRatesOf(const Channel& channel) {
  std::vector<FieldGroup> groups;
  for (const char* end : {"_rate", ".rate", "rate", "speed", "_speed", " rate"}) {
    for (FieldGroup& group : RollPitchYaw(channel, end)) groups.push_back(std::move(group));
  }
  std::erase_if(groups, [](const FieldGroup& g) { return IsSetpointOrEstimate(g.stem); });
  return groups;
}

// The fields roll, pitch and yaw, or phi, theta and psi, of one stem, as the parts "x", "y" and
// "z"; empty if there are none.
FieldGroup EulerAnglesOf(const Channel& channel) {
  std::vector<FieldGroup> groups = RollPitchYaw(channel, "");
  std::erase_if(groups, [](const FieldGroup& g) { return g.unit.ends_with("/s"); });
  std::stable_partition(groups.begin(), groups.end(),
                        [](const FieldGroup& g) { return !IsSetpointOrEstimate(g.stem); });
  return groups.empty() ? FieldGroup{} : groups.front();
}

using Texts = std::vector<std::string>;

// Numbers of this size tell units apart that no name states.
constexpr double kLargestG = 3.0;      // mean specific force of a flight in g; in m/s^2 about 10
constexpr double kFastestRate = 60.0;  // rad/s; gyroscopes end at 2000 deg/s = 35 rad/s
const Eigen::Vector3d kTurns(3.2, 1.6, 6.4);  // rad; the largest roll, pitch and heading
constexpr double kFewRows = 0.7;              // share of the channel's rows that have a position
constexpr double kLeastVerticalShare = 0.5;   // of the mean specific force, along z

// Words of columns that a tracker gives.
const Texts kTrackers = {"vicon", "mocap", "optitrack", "qualisys", "motive", "gt_", "truth"};

bool Mentions(const std::string& stem, const Texts& words) {
  return std::any_of(words.begin(), words.end(),
                     [&](const std::string& word) { return stem.find(word) != std::string::npos; });
}

// The fields of these parts; empty if one is missing.
Texts PartsOf(const FieldGroup& group, const Texts& parts) {
  Texts fields;
  for (const std::string& part : parts) {
    const auto found = group.parts.find(part);
    if (found == group.parts.end()) return {};
    fields.push_back(found->second);
  }
  return fields;
}

// Three fields x, y and z, or by number, without a fourth one; or in the order of `earth`.
Texts ThreeOf(const FieldGroup& group, std::string* earth = nullptr) {
  if (group.parts.contains("w")) return {};
  const std::vector<Texts> all = {
      {"x", "y", "z"}, {"[0]", "[1]", "[2]"}, {"0", "1", "2"}, {"1", "2", "3"}};
  for (const Texts& parts : all) {
    const Texts three = PartsOf(group, parts);
    if (!three.empty() && (parts[0] == "x" || group.parts.size() == 3)) return three;
  }
  if (earth == nullptr) return {};
  Texts three = PartsOf(group, {"n", "e", "d"});
  *earth = three.empty() ? "ENU" : "NED";
  if (three.empty()) three = PartsOf(group, {"e", "n", "u"});
  if (three.empty()) earth->clear();
  return three;
}

// Three columns of a map, with the unit that their names state.
struct Vector {
  Texts columns;  // empty for none
  std::string_view unit;
  std::string earth = "";  // the axes that their names state
  std::string stem = "";   // of the names
};

// --- Names: one table of what a quantity is called

enum class Quantity { kAccel, kGyro, kPosition, kVelocity };

// Names in lower case, without separators at their ends: `part` names that a longer one holds,
// `whole` ones that stand alone, as the a of ax; `not_part` tell that it is something else.
struct Synonyms {
  Quantity quantity;
  std::string_view si;
  Texts part, whole, not_part;
};

const std::vector<Synonyms>& AllSynonyms() {
  static const std::vector<Synonyms> kAll = {
      {Quantity::kAccel,
       "m/s^2",
       {"acc", "a_rs", "specific_force", "specificforce", "beschl", "acel"},
       {"a", "f", "imu_a", "imu.a", "sf", "ag"},
       {"ang", "stateestimate", "world", "earth", "_ned", "_enu", "grav"}},
      {Quantity::kGyro,
       "rad/s",
       SplitList("gyr,angular_vel,angularvel,ang_vel,ang vel,angvel,omega,w_rs,body_rate,bodyrate,"
                 "rotation_rate,rotationrate,rates,turn_rate,drehrate,winkelgeschw,angulaire,"
                 "velocidad_angular,velocidad angular,giro"),
       {"g", "w", "om", "imu_w", "imu_g", "imu.g", "imu.w"},
       {"mag", "motor", "rotor", "grav"}},
      {Quantity::kPosition,
       "m",
       {"pos", "transl", "p_rs", "point", "location"},
       {"p", "t", "local", "stateestimate", "vicon", "mocap", "optitrack", "gt", "ground_truth",
        "groundtruth", "odom", "est", "ort"},
       {"imu_pos"}},
      {Quantity::kVelocity,
       "m/s",
       {"vel", "v_rs", "speed", "geschw", "vitesse"},
       {"v", "local_v"},
       {"ang", "gyr", "omega", "rotor", "motor", "wind", "air", "body", "winkel", "dreh"}},
  };
  return kAll;
}

const Synonyms& SynonymsOf(Quantity quantity) {
  return AllSynonyms()[static_cast<std::size_t>(quantity)];
}

std::string WithoutEnds(const std::string& stem) {
  const std::size_t first = stem.find_first_not_of("._ /:-"),
                    last = stem.find_last_not_of("._ /:-");
  return first == std::string::npos ? "" : stem.substr(first, last - first + 1);
}

// The last name of a path, as "acc" of "/imu/acc/".
std::string LastOf(const std::string& stem) {
  const std::string name = WithoutEnds(stem);
  return name.substr(name.find_last_of("./:") + 1);
}

// The first vector that the table's names are of, long ones before short ones. Bare x, y and z have
// the channel's name.
Vector VectorOf(const Channel& channel, const std::vector<FieldGroup>& groups, Quantity quantity) {
  const Synonyms& names = SynonymsOf(quantity);
  for (const bool whole : {false, true}) {
    for (const FieldGroup& group : groups) {
      std::string earth;
      const bool in_earth = quantity == Quantity::kPosition || quantity == Quantity::kVelocity;
      const Texts three = ThreeOf(group, in_earth ? &earth : nullptr);
      const std::string name =
          WithoutEnds(group.stem.empty() ? LowerCase(channel.name) : group.stem);
      if (three.empty() || Mentions(name, names.not_part)) continue;
      if (Mentions(name, {"cov", "var", "bias", "offset", "std", "sigma", "clip", "calib"}))
        continue;
      const auto is = [&](const std::string& one) { return name == one || LastOf(name) == one; };
      const bool fits = whole ? std::any_of(names.whole.begin(), names.whole.end(), is)
                              : Mentions(name, names.part);
      if (fits) return {three, group.unit, earth, group.stem};
    }
  }
  return {};
}

Vector GyroscopeOf(const Channel& channel, const std::vector<FieldGroup>& groups) {
  Vector named = VectorOf(channel, groups, Quantity::kGyro);
  if (!named.columns.empty()) return named;
  for (const FieldGroup& group : groups) {
    Texts rates = PartsOf(group, {"p", "q", "r"});
    if (group.stem.empty() && !rates.empty()) return {rates, group.unit};
  }
  for (const FieldGroup& group : AngleRatesOf(channel)) {
    return {PartsOf(group, {"x", "y", "z"}), group.unit};
  }
  return {};
}

// Bare x, y and z are a position where a file holds nothing else, or its channel says so.
Vector PositionOf(const Channel& channel, const std::vector<FieldGroup>& groups, bool may_be_bare) {
  Vector named = VectorOf(channel, groups, Quantity::kPosition);
  if (!named.columns.empty() || !may_be_bare) return named;
  for (const FieldGroup& group : groups) {
    std::string earth;
    const Texts three = ThreeOf(group, &earth);
    if (group.stem.empty() && !three.empty() && !group.parts.contains("w"))
      return {three, group.unit, earth};
  }
  return {};
}

// Latitude, longitude and height.
Texts PlaceOnEarthOf(const Channel& channel) {
  // A plain name before longer ones, as "alt" before "baro_alt".
  const auto find = [&](const Texts& names) -> std::string {
    for (const bool longer : {false, true}) {
      for (const std::string& name : names) {
        for (const ChannelField& field : channel.fields) {
          const std::string last = LastOf(LowerCase(field.name)),
                            bare = last.substr(0, last.find_first_of(" [("));
          const bool holds = last.starts_with(name + "_") || last.ends_with("_" + name);
          if (bare == name || (longer && holds)) return field.name;
        }
      }
    }
    return "";
  };
  Texts place = {find({"lat", "latitude"}), find({"lon", "lng", "long", "longitude"}),
                 find({"alt", "altitude", "height", "elevation"})};
  return std::any_of(place.begin(), place.end(), [](const auto& s) { return s.empty(); }) ? Texts()
                                                                                          : place;
}

// w, x, y, z, or numbers from 0 on, where w usually comes first.
struct Quaternion {
  Texts columns;  // w, x, y, z; empty for none
  std::string stem = "";
};
std::vector<Quaternion> QuaternionsOf(const std::vector<FieldGroup>& groups) {
  std::vector<Quaternion> all;
  for (const FieldGroup& group : groups) {
    const bool is_attitude = group.stem == "q" || group.stem.ends_with("_q") ||
                             group.stem.ends_with(".q") ||
                             Mentions(group.stem, {"quat", "orient", "q_"});
    for (const Texts& parts : std::vector<Texts>{{"w", "x", "y", "z"},
                                                 {"0", "1", "2", "3"},
                                                 {"[0]", "[1]", "[2]", "[3]"},
                                                 {"1", "2", "3", "4"}}) {
      const bool named = parts.front() == "w";
      if (named ? Mentions(group.stem, {"covar"}) : !is_attitude) continue;
      const Texts columns = PartsOf(group, parts);
      if (columns.empty()) continue;
      all.push_back({columns, group.stem});
      break;
    }
  }
  return all;
}

// Whether the names of two groups have a word in common, as "mocap_x" and "mocap_qw" have.
bool ShareAWord(const std::string& a, const std::string& b) {
  const Texts words = WordsOf(a), others = WordsOf(b);
  return std::any_of(words.begin(), words.end(), [&](const std::string& word) {
    return word.size() > 1 && std::find(others.begin(), others.end(), word) != others.end();
  });
}

// r11 to r33, rot_00 to rot_22 or rot[0] to rot[8]; r0 to r8 are ranges.
Texts MatrixOf(const Channel& channel) {
  std::map<std::string, std::string> fields;  // by letters and numbers in lower case
  for (const ChannelField& field : channel.fields) {
    std::string name;
    for (const char c : LowerCase(LastOf(field.name))) {
      if (std::isalnum(static_cast<unsigned char>(c)) != 0) name += c;
    }
    fields[name] = field.name;
  }
  const std::vector<Texts> all = {{"11", "12", "13", "21", "22", "23", "31", "32", "33"},
                                  {"00", "01", "02", "10", "11", "12", "20", "21", "22"},
                                  {"xx", "xy", "xz", "yx", "yy", "yz", "zx", "zy", "zz"},
                                  {"0", "1", "2", "3", "4", "5", "6", "7", "8"}};
  for (const std::string stem : {"r", "rm", "rot", "rotation", "rotationmatrix", "rotmat", "dcm"}) {
    for (const Texts& parts : all) {
      if (stem.size() == 1 && parts.front().size() == 1) continue;
      Texts nine;
      for (const std::string& part : parts) {
        const auto found = fields.find(stem + part);
        if (found != fields.end()) nine.push_back(found->second);
      }
      if (nine.size() == parts.size()) return nine;
    }
  }
  return {};
}

// --- The size of numbers

struct Sizes {
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d largest = Eigen::Vector3d::Zero();
  double count = 0.0, changes = 0.0;  // rows, and those that differ from the one before

  bool AreHeld() const { return count > 100.0 && changes < 0.7 * count; }
};

// Of three columns; rows that lack one are left out.
Sizes SizesOf(Recording* recording, std::size_t channel, const Texts& columns) {
  std::array<std::size_t, 3> at{};
  for (std::size_t i = 0; i < 3; ++i) {
    at[i] = static_cast<std::size_t>(recording->channels()[channel].IndexOf(columns[i]));
  }
  Sizes sizes;
  double& count = sizes.count;
  Eigen::Vector3d before = Eigen::Vector3d::Constant(std::numeric_limits<double>::quiet_NaN());
  recording->Visit({channel}, [&](std::size_t, const Record& record) {
    const Eigen::Vector3d row(record.cells[at[0]].Number(), record.cells[at[1]].Number(),
                              record.cells[at[2]].Number());
    if (!row.allFinite()) return;
    sizes.changes += row == before ? 0.0 : 1.0;
    before = row;
    sizes.largest = sizes.largest.cwiseMax(row.cwiseAbs());
    sizes.mean += (row - sizes.mean) / ++count;
  });
  return sizes;
}

// --- Lines of a map

std::string Quoted(const Texts& columns) {
  Texts quoted;
  for (const std::string& column : columns) quoted.push_back(fmt::format("\"{}\"", column));
  return fmt::format("{}", fmt::join(quoted, ", "));
}

std::string ColumnsText(const Texts& columns, std::string_view unit) {
  return fmt::format("columns: [{}], unit: {}", Quoted(columns), unit);
}

// Of a value that is repeated until there is a new one.
std::string NewWhere(const Sizes& sizes, const Texts& columns) {
  return sizes.AreHeld() ? fmt::format(", new_where: [{}]", Quoted(columns)) : "";
}

// The unit that names state, if it is one of `si`; else `guess`.
std::string_view UnitOf(std::string_view stated, std::string_view si, std::string_view guess) {
  return UnitFactor(si, stated) ? stated : guess;
}

std::string EarthText(const Vector& vector) {
  return vector.earth.empty() ? "" : ", earth: " + vector.earth;
}

std::string QuaternionText(const Quaternion& quaternion) {
  const Texts& q = quaternion.columns;
  return fmt::format("quaternion: {{w: \"{}\", x: \"{}\", y: \"{}\", z: \"{}\"}}", q[0], q[1], q[2],
                     q[3]);
}

// The quaternion whose names go with those of a position; empty if there is none.
std::string QuaternionBeside(const Vector& position, const std::vector<FieldGroup>& groups) {
  for (const Quaternion& q : QuaternionsOf(groups)) {
    if (ShareAWord(q.stem, position.stem)) return QuaternionText(q);
  }
  return "";
}

std::string AttitudeText(const Channel& channel, std::size_t place, Recording* recording) {
  const std::vector<Quaternion> all = QuaternionsOf(GroupsOf(channel));
  if (!all.empty()) return QuaternionText(all.front());
  const Texts matrix = MatrixOf(channel);
  if (!matrix.empty()) return fmt::format("matrix: {{columns: [{}]}}", Quoted(matrix));
  const FieldGroup group = EulerAnglesOf(channel);
  const Texts angles = PartsOf(group, {"x", "y", "z"});
  if (angles.empty()) return "";
  // In rad a pitch lies within a quarter turn, a roll within half a turn, a heading within one.
  const Eigen::Vector3d largest = SizesOf(recording, place, angles).largest;
  const bool large = (largest.array() > kTurns.array()).any();
  return fmt::format("euler: {{roll: \"{}\", pitch: \"{}\", yaw: \"{}\", unit: {}{}}}", angles[0],
                     angles[1], angles[2], UnitOf(group.unit, "rad", large ? "deg" : "rad"),
                     LowerCase(angles[0]).ends_with("rx") ? ", order: vector" : "");
}

// The streams of one channel.
class ChannelProposal {
 public:
  ChannelProposal(Recording* recording, std::size_t channel, ProposedStreams* streams)
      : recording_(recording),
        place_(channel),
        channel_(recording->channels()[channel]),
        groups_(GroupsOf(channel_)),
        is_csv_(recording->format().key == std::string(kCsvFormat)),
        streams_(streams) {
    from_ = is_csv_ ? "skip_missing: true, "
                    : fmt::format("channel: \"{}\", skip_missing: true, ", channel_.Label());
  }

  void Add() {
    AddImu();
    AddPositionAndAttitude();
    AddBattery();
  }

 private:
  void AddLine(const char* stream, const std::string& text, const std::string& comment = "") {
    streams_->lines.try_emplace(stream, fmt::format("{}: {{{}{}}}{}{}", stream, from_, text,
                                                    comment.empty() ? "" : "  # ", comment));
  }

  void AddImu() {
    const Vector accel = VectorOf(channel_, groups_, Quantity::kAccel);
    const Vector gyro = GyroscopeOf(channel_, groups_);
    if (!gyro.columns.empty()) streams_->gyros.push_back({place_, gyro.columns, gyro.unit});
    if (!accel.columns.empty()) streams_->accels.push_back({place_, accel.columns, accel.unit});
    if (accel.columns.empty() || gyro.columns.empty()) return;
    AddImuLine(accel, gyro, place_);
  }

 public:
  // The gyroscope may be of another channel, whose last values go with the accelerometer's.
  void AddImuLine(const Vector& accel, const Vector& gyro, std::size_t gyro_place) {
    if (streams_->lines.contains("imu")) return;
    const Eigen::Vector3d force = SizesOf(recording_, place_, accel.columns).mean;
    const bool fast =
        SizesOf(recording_, gyro_place, gyro.columns).largest.maxCoeff() > kFastestRate;
    const bool in_g = force.norm() > 0.0 && force.norm() < kLargestG;
    const bool stated =
        UnitFactor("m/s^2", accel.unit).has_value() && UnitFactor("rad/s", gyro.unit).has_value();
    const std::string with =
        gyro_place == place_
            ? ""
            : fmt::format("with: [\"{}\"], ", recording_->channels()[gyro_place].Label());
    Texts gyro_columns = gyro.columns;
    for (std::string& column : gyro_columns) {
      if (gyro_place != place_) column = recording_->channels()[gyro_place].name + ":" + column;
    }
    AddLine("imu",
            fmt::format(
                "{}accel: {{{}}}, gyro: {{{}}}", with,
                ColumnsText(accel.columns, UnitOf(accel.unit, "m/s^2", in_g ? "g" : "m/s^2")),
                ColumnsText(gyro_columns, UnitOf(gyro.unit, "rad/s", fast ? "deg/s" : "rad/s"))),
            stated ? "" : "units by the size of the numbers; or m/s^2, g, rad/s, deg/s");
    streams_->is_z_up = force.z() > kLeastVerticalShare * force.norm();
  }

  // Position and attitude of a tracker; empty if the channel has none.
  std::string Tracker() const {
    for (const FieldGroup& group : groups_) {
      const Texts columns = ThreeOf(group);
      if (columns.empty() || !Mentions(group.stem, kTrackers)) continue;
      const std::string q = QuaternionBeside({columns, group.unit, "", group.stem}, groups_);
      if (q.empty()) continue;
      return fmt::format("mocap: {{{}position: {{{}}}, {}}}", from_,
                         ColumnsText(columns, UnitOf(group.unit, "m", "m")), q);
    }
    return "";
  }

 private:
  // A pose is that of mocap; a position alone is that of fixes.
  void AddPositionAndAttitude() {
    const std::string attitude = AttitudeText(channel_, place_, recording_);
    const bool has_imu = !streams_->accels.empty() && streams_->accels.back().channel == place_;
    const bool may_be_bare = is_csv_ || has_imu || !attitude.empty() ||
                             Mentions(LowerCase(channel_.name), {"pos", "odom", "traj", "track"});
    Vector position = PositionOf(channel_, groups_, may_be_bare);
    for (const auto* imu : {&streams_->accels, &streams_->gyros}) {  // bare axes of a sensor's file
      const bool own = !imu->empty() && imu->back().channel == place_;
      if (own && imu->back().columns == position.columns) position = {};
    }
    if (position.columns.empty()) {
      if (!attitude.empty()) AddLine("attitude", attitude);
      AddPlaceOnEarth();
      const Vector velocity = VectorOf(channel_, groups_, Quantity::kVelocity);
      if (velocity.columns.empty()) return;
      streams_->velocity = fmt::format(
          "fixes: {{{}velocity: {{{}{}}}, sigma: {{constant: 0.05}}}}  # integrated", from_,
          ColumnsText(velocity.columns, UnitOf(velocity.unit, "m/s", "m/s")), EarthText(velocity));
      return;
    }
    // Positions that repeat or are missing while an attitude goes on are of another sensor.
    const Sizes sizes = SizesOf(recording_, place_, position.columns);
    const bool held = sizes.AreHeld();
    const bool few = sizes.count < kFewRows * static_cast<double>(channel_.count);
    const std::string columns = fmt::format(
        "position: {{{}{}}}{}", ColumnsText(position.columns, UnitOf(position.unit, "m", "m")),
        EarthText(position), NewWhere(sizes, position.columns));
    if (has_imu && !attitude.empty()) AddLine("attitude", attitude);
    const std::string sigma = SigmaText();
    if (attitude.empty() || ((held || few) && has_imu) || !sigma.empty()) {
      AddLine("fixes", columns + (sigma.empty() ? ", sigma: {constant: 0.05}" : sigma) + GateText(),
              sigma.empty() ? "state its standard deviation, m" : "");
    } else {
      const std::string beside = QuaternionBeside(position, groups_);
      const std::string own = beside.empty() ? attitude : beside;
      if (!streams_->lines.contains("mocap")) {
        streams_->attitude_of_mocap = fmt::format("attitude: {{{}{}}}  # mocap's own", from_, own);
      }
      AddLine("mocap", columns + ", " + own, "if truth");
    }
  }

  // A column of standard deviations, as mocap has none; x stands for all axes.
  std::string SigmaText() const {
    for (const char* word : {"sigma", "std", "stddev", "sd"}) {
      for (const ChannelField& field : channel_.fields) {
        const Texts words = WordsOf(field.name);
        const auto has = [&](const char* one) {
          return std::find(words.begin(), words.end(), one) != words.end();
        };
        if (!has(word) || has("y") || has("z")) continue;
        if (Mentions(LowerCase(field.name), {"acc", "gyr", "vel", "yaw", "roll", "pitch", "att"})) {
          continue;
        }
        return fmt::format(", sigma: {{column: \"{}\"}}", field.name);
      }
    }
    return "";
  }
  std::string GateText() const {
    for (const ChannelField& field : channel_.fields) {
      const std::string name = LowerCase(field.name);
      if (name == "gate" || name == "gate_id" || name == "gate id" || name == "gateid") {
        return fmt::format(", gate: {{column: \"{}\"}}", field.name);
      }
    }
    return "";
  }

  // North-east-down in any case; counts of 1e-7 deg come with mm, as PX4 has them.
  void AddPlaceOnEarth() {
    const Texts place = PlaceOnEarthOf(channel_);
    if (place.empty()) return;
    const Sizes sizes = SizesOf(recording_, place_, place);
    const bool counts = sizes.largest.maxCoeff() > 1e6;
    AddLine("fixes",
            fmt::format("position: {{geodetic: [{}]{}, earth: NED}}{}, sigma: {{constant: 2.5}}",
                        Quoted(place), counts ? ", scale: [1.0e-7, 1.0e-7, 1.0e-3]" : "",
                        NewWhere(sizes, place)),
            "state its standard deviation, m");
  }

  void AddBattery() {
    for (const ChannelField& field : channel_.fields) {
      const std::string name = LowerCase(field.name);
      if (!name.starts_with("volt") && !name.starts_with("vbat")) continue;
      const char* unit = name.find("mv") == std::string::npos ? "V" : "mV";
      AddLine("battery", fmt::format("column: \"{}\", unit: {}", field.name, unit));
    }
  }

  Recording* recording_;
  std::size_t place_;
  const Channel channel_;
  std::vector<FieldGroup> groups_;
  bool is_csv_;
  ProposedStreams* streams_;
  std::string from_;
};

}  // namespace

std::string ProposeTracker(Recording* recording) {
  ProposedStreams unused;
  for (std::size_t i = 0; i < recording->channels().size(); ++i) {
    const std::string line = ChannelProposal(recording, i, &unused).Tracker();
    if (!line.empty()) return line;
  }
  return "";
}

ProposedStreams ProposeStreams(Recording* recording) {
  std::vector<std::size_t> channels;
  for (std::size_t i = 0; i < recording->channels().size(); ++i) {
    if (recording->channels()[i].count > 0) channels.push_back(i);
  }
  std::stable_partition(channels.begin(), channels.end(), [&](std::size_t i) {
    return !IsSetpointOrEstimate(recording->channels()[i].name);
  });
  ProposedStreams streams;
  for (const std::size_t i : channels) ChannelProposal(recording, i, &streams).Add();
  if (!streams.lines.contains("imu") && !streams.accels.empty() && !streams.gyros.empty()) {
    const ProposedVector &accel = streams.accels.front(), &gyro = streams.gyros.front();
    ChannelProposal(recording, accel.channel, &streams)
        .AddImuLine({accel.columns, accel.unit}, {gyro.columns, gyro.unit}, gyro.channel);
  }
  const bool has_place = streams.lines.contains("fixes") || streams.lines.contains("mocap");
  if (!has_place && !streams.velocity.empty()) streams.lines["fixes"] = streams.velocity;
  if (!streams.attitude_of_mocap.empty()) {
    streams.lines.try_emplace("attitude", streams.attitude_of_mocap);
  }
  return streams;
}

}  // namespace trueline
