#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "problems/effects/effect.h"

namespace trueline {
namespace {

struct QuantityInfo {
  TermQuantity of;
  const char *symbol, *words, *unit;
  int length;              // of its formula
  std::vector<double> at;  // where the symbol has no numbers; NaN: it needs them
};

const std::vector<QuantityInfo>& Quantities() {
  using enum TermQuantity;
  static const std::vector<QuantityInfo> quantities = {
      {kSpeedX, "v_x", "forward speed", "m/s", 1, {}},
      {kSpeedY, "v_y", "sideways speed", "m/s", 1, {}},
      {kSpeedZ, "v_z", "sink rate", "m/s", 1, {}},
      {kRateX, "p", "roll rate", "rad/s", 1, {}},
      {kRateY, "q", "pitch rate", "rad/s", 1, {}},
      {kRateZ, "r", "yaw rate", "rad/s", 1, {}},
      {kThrust, "T", "thrust", "m/s^2", 1, {0.0}},
      {kSine, "sin", "the sine of ", "1", 1, {1.0}},
      {kCosine, "cos", "the cosine of ", "1", 1, {1.0}},
      {kNorth, "x", "the distance north of x = {:.1f} m", "m", 1, {0.0}},
      {kEast, "y", "the distance east of y = {:.1f} m", "m", 1, {0.0}},
      {kHeight, "h", "the height above {:.1f} m", "m", 1, {0.0}},
      {kTime, "t", "time", "s", 1, {0.0, 1.0}},
      {kVoltage, "U", "battery voltage above {:.2f} V", "V", 1, {0.0}},
      {kPlace, "place", "being", "1", 2, {NAN, NAN, NAN}},
      {kSlopeNorth, "slope_north", "the distance north of x = {:.1f} m", "m", 3, {NAN, NAN, NAN}},
      {kSlopeEast, "slope_east", "the distance east of y = {:.1f} m", "m", 3, {NAN, NAN, NAN}},
      {kGateDistance, "d", "the distance to the gate", "m", 1, {}},
  };
  return quantities;
}

const QuantityInfo& InfoOfQuantity(TermQuantity of) {
  return Quantities()[static_cast<std::size_t>(of)];
}

bool IsWave(TermQuantity of) { return of == TermQuantity::kSine || of == TermQuantity::kCosine; }
bool IsHump(TermQuantity of) {
  return of == TermQuantity::kPlace || of == TermQuantity::kSlopeNorth ||
         of == TermQuantity::kSlopeEast;
}

std::string Numbers(const std::vector<double>& at) {
  std::string text;
  for (std::size_t i = 0; i < at.size(); ++i) {
    text += fmt::format("{}{:.6g}", i == 0 ? "" : i == 1 && at.size() > 2 ? "," : ";", at[i]);
  }
  return text;
}

std::string PlainSymbol(const TermFactor& factor) {
  const QuantityInfo& info = InfoOfQuantity(factor.of);
  if (IsWave(factor.of)) {
    return fmt::format("{}({}psi)", info.symbol, factor.at[0] > 1.0 ? "2*" : "");
  }
  if (factor.at == info.at) return info.symbol;
  return fmt::format("{}({})", info.symbol, Numbers(factor.at));
}

std::string SymbolOf(const TermFactor& factor) {
  std::string symbol = PlainSymbol(factor);
  if (factor.lag > 0.0) symbol = fmt::format("lag({};{:g})", symbol, factor.lag);
  return factor.size ? "abs(" + symbol + ")" : symbol;
}

std::string Within(const TermFactor& factor) {
  return fmt::format("within about {:.1f} m of ({:.1f}, {:.1f})", factor.at[2], factor.at[0],
                     factor.at[1]);
}

std::string PlainWords(const TermFactor& factor) {
  const QuantityInfo& info = InfoOfQuantity(factor.of);
  if (IsWave(factor.of)) {
    return info.words + std::string(factor.at[0] > 1.0 ? "twice the heading" : "the heading");
  }
  if (factor.of == TermQuantity::kPlace) return "being " + Within(factor);
  if (factor.of == TermQuantity::kThrust)
    return factor.at[0] > 0.0 ? "thrust above hover" : "thrust";
  if (factor.of == TermQuantity::kTime && factor.at[1] != 1.0) return "time (half of the flight)";
  if (factor.at.empty() || factor.of == TermQuantity::kTime) return info.words;
  const double offset = factor.of == TermQuantity::kSlopeEast ? factor.at[1] : factor.at[0];
  const std::string words = fmt::format(fmt::runtime(info.words), offset);
  return IsHump(factor.of) ? words + ", " + Within(factor) : words;
}

std::string WordOf(const TermFactor& factor) {
  std::string words = PlainWords(factor);
  if (factor.lag > 0.0) words += fmt::format(" {:g} s earlier", factor.lag);
  return factor.size ? "the size of " + words : words;
}

std::string UnitOfFactor(const TermFactor& factor) {
  if (factor.of == TermQuantity::kTime && factor.at[1] != 1.0) return "1";
  return InfoOfQuantity(factor.of).unit;
}

bool IsSquare(const std::vector<TermFactor>& factors) {
  return factors.size() == 2 && SymbolOf(factors[0]) == SymbolOf(factors[1]);
}

struct Entry {
  const char* where;
  TermOn on;
  int axis;
};
constexpr std::array<Entry, 19> kEntries = {{{"force_x", TermOn::kForce, 0},
                                             {"force_y", TermOn::kForce, 1},
                                             {"force_z", TermOn::kForce, 2},
                                             {"force_north", TermOn::kForce, 3},
                                             {"force_east", TermOn::kForce, 4},
                                             {"force_down", TermOn::kForce, 5},
                                             {"moment_x", TermOn::kTurn, 0},
                                             {"moment_y", TermOn::kTurn, 1},
                                             {"moment_z", TermOn::kTurn, 2},
                                             {"attitude_roll", TermOn::kAttitude, 0},
                                             {"attitude_pitch", TermOn::kAttitude, 1},
                                             {"attitude_yaw", TermOn::kAttitude, 5},
                                             {"fix_x", TermOn::kFix, 0},
                                             {"fix_y", TermOn::kFix, 1},
                                             {"fix_z", TermOn::kFix, 2},
                                             {"fix_north", TermOn::kFix, 3},
                                             {"fix_east", TermOn::kFix, 4},
                                             {"fix_down", TermOn::kFix, 5},
                                             {"fix_gate", TermOn::kFix, 6}}};
constexpr std::array<const char*, 7> kAxes = {
    "x_B", "y_B", "z_B", "north", "east", "down", "the line to the gate"};

// What is wrong, up to its size: "the logged pitch is wrong by".
std::string Subject(const TermForm& term) {
  constexpr std::array<const char*, 3> kAngles = {"roll", "pitch", "heading"};
  switch (term.on) {
    case TermOn::kForce:
      return fmt::format("a force along {} of", term.Along());
    case TermOn::kTurn:
      return fmt::format("an angular acceleration about {} of", term.Along());
    case TermOn::kAttitude:
      return fmt::format("the logged {} is wrong by", kAngles[term.axis % 3]);
    case TermOn::kFix:
      return fmt::format("the fixes are off along {} by", term.Along());
    case TermOn::kAccelerometer:
    case TermOn::kGyro:
      break;
  }
  return "";
}

[[noreturn]] void Unknown(const std::string& symbol) {
  std::vector<std::string> known;
  for (const QuantityInfo& info : Quantities()) known.emplace_back(info.symbol);
  throw TermError{"with",
                  fmt::format("'{}' is not known; a product of {}, such as q*v_x, sin(2*psi), "
                              "place(8,2;2.5), abs(v_x) or lag(q;0.3) is",
                              symbol, fmt::join(known, ", "))};
}

// Divides at any of `marks` outside of brackets.
std::vector<std::string> Split(const std::string& text, const std::string& marks) {
  std::vector<std::string> parts(1);
  int depth = 0;
  for (const char c : text) {
    depth += c == '(' ? 1 : c == ')' ? -1 : 0;
    if (depth == 0 && marks.find(c) != std::string::npos) {
      parts.emplace_back();
    } else if (c != ' ') {
      parts.back() += c;
    }
  }
  return parts;
}

double NumberOf(const std::string& text, const std::string& symbol) {
  double value = 0.0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) {
    Unknown(symbol);
  }
  return value;
}

// "name(inside)"; no brackets: an empty inside.
std::pair<std::string, std::string> NameAndInside(const std::string& symbol) {
  const std::size_t open = symbol.find('(');
  if (open == std::string::npos) return {symbol, ""};
  if (symbol.back() != ')') Unknown(symbol);
  return {symbol.substr(0, open), symbol.substr(open + 1, symbol.size() - open - 2)};
}

void CheckNumbers(const TermFactor& factor, const std::string& symbol) {
  const bool finite = std::all_of(factor.at.begin(), factor.at.end(),
                                  [](double value) { return std::isfinite(value); });
  const bool scale = factor.of == TermQuantity::kTime ? factor.at[1] > 0.0
                     : IsHump(factor.of)              ? factor.at[2] > 0.0
                                                      : true;
  if (!finite || !scale) Unknown(symbol);
}

TermFactor ParseFactor(const std::string& symbol) {
  if (std::ranges::count(symbol, '(') > 3) Unknown(symbol);  // abs(lag(T(9.81);1)) is the deepest
  const auto [name, inside] = NameAndInside(symbol);
  if (name == "abs") {
    TermFactor factor = ParseFactor(inside);
    factor.size = true;
    return factor;
  }
  if (name == "lag") {
    const std::vector<std::string> parts = Split(inside, ";");
    if (parts.size() != 2) Unknown(symbol);
    TermFactor factor = ParseFactor(parts[0]);
    factor.lag = NumberOf(parts[1], symbol);
    const bool lags = factor.of == TermQuantity::kRateX || factor.of == TermQuantity::kRateY ||
                      factor.of == TermQuantity::kRateZ || factor.of == TermQuantity::kThrust;
    if (!(factor.lag > 0.0) || !lags || factor.size) {
      throw TermError{"with",
                      fmt::format("'{}': only p, q, r and T may lag, by a time above 0 s", symbol)};
    }
    return factor;
  }
  const auto& all = Quantities();
  const auto info =
      std::find_if(all.begin(), all.end(), [&, &n = name](const auto& q) { return q.symbol == n; });
  if (info == all.end()) Unknown(symbol);
  TermFactor factor{info->of, info->at};
  if (IsWave(factor.of)) {
    if (inside != "psi" && inside != "2*psi") Unknown(symbol);
    factor.at[0] = inside == "psi" ? 1.0 : 2.0;
  } else if (!inside.empty()) {
    const std::vector<std::string> numbers = Split(inside, ",;");
    const bool edge = IsHump(factor.of) && numbers.size() == 4;
    if (numbers.size() != info->at.size() && !edge) Unknown(symbol);
    factor.at.clear();
    for (const std::string& number : numbers) factor.at.push_back(NumberOf(number, symbol));
  }
  CheckNumbers(factor, symbol);
  return factor;
}

}  // namespace

std::string SymbolsOf(const std::vector<TermFactor>& factors) {
  std::string symbols;
  for (const TermFactor& factor : factors) {
    symbols += (symbols.empty() ? "" : "*") + SymbolOf(factor);
  }
  return symbols;
}

std::string WordsOf(const std::vector<TermFactor>& factors) {
  if (IsSquare(factors)) return "the square of " + WordOf(factors[0]);
  std::string words;
  for (const TermFactor& factor : factors) {
    words += (words.empty() ? "" : " times ") + WordOf(factor);
  }
  return words;
}

std::string UnitOf(const std::vector<TermFactor>& factors) {
  if (IsSquare(factors)) {
    const std::string unit = UnitOfFactor(factors[0]);
    return unit == "1" ? unit : "(" + unit + ")^2";
  }
  std::string units;
  for (const TermFactor& factor : factors) {
    const std::string unit = UnitOfFactor(factor);
    if (unit != "1") units += (units.empty() ? "" : " ") + unit;
  }
  return units.empty() ? "1" : units;
}

int LengthOf(const std::vector<TermFactor>& factors) {
  int length = 0;
  for (const TermFactor& factor : factors) {
    length += InfoOfQuantity(factor.of).length + (factor.size ? 1 : 0) +
              (factor.lag > 0.0 ? 1 : 0) + (IsWave(factor.of) ? static_cast<int>(factor.at[0]) : 0);
  }
  return length;
}

bool IsLocal(const std::vector<TermFactor>& factors) {
  return std::any_of(factors.begin(), factors.end(),
                     [](const TermFactor& factor) { return IsHump(factor.of); });
}

std::string TermForm::Where() const {
  for (const Entry& entry : kEntries) {
    if (entry.on == on && entry.axis == axis) return entry.where;
  }
  return "";
}

std::string TermForm::Enters() const {
  constexpr const char* kNames[] = {"force", "moment", "attitude", "fix"};
  return kNames[static_cast<int>(on)];
}

std::string TermForm::Along() const { return kAxes[axis]; }

std::string TermForm::Name() const {
  return fmt::format("{} {} {} with {}", Enters(), on == TermOn::kAttitude ? "about" : "along",
                     Along(), WordsOf(with));
}

std::string TermForm::Unit() const {
  constexpr const char* kUnits[] = {"m/s^2", "rad/s^2", "rad", "m"};
  const std::string unit = kUnits[static_cast<int>(on)], of = UnitOf(with);
  return of == "1" ? unit : unit + " for each " + of;
}

std::string TermForm::Text(double size, double sigma) const {
  const std::string words = WordsOf(with);
  const bool place = with.size() == 1 && with[0].of == TermQuantity::kPlace && !with[0].size;
  return fmt::format(
      "{} {:.3g} +- {:.2g} {}{}", Subject(*this), size, sigma, Unit(),
      place ? " while" + words.substr(5) : (UnitOf(with) == "1" ? " times " : " of ") + words);
}

TermForm ParseTerm(const std::string& where, const std::string& with) {
  TermForm form;
  const auto entry = std::find_if(kEntries.begin(), kEntries.end(),
                                  [&](const Entry& e) { return e.where == where; });
  if (entry == kEntries.end()) {
    std::vector<std::string> known;
    known.reserve(kEntries.size());
    for (const Entry& e : kEntries) known.emplace_back(e.where);
    throw TermError{"where", fmt::format("must be one of {}", fmt::join(known, ", "))};
  }
  form.on = entry->on;
  form.axis = entry->axis;
  for (const std::string& symbol : Split(with, "*")) {
    form.with.push_back(ParseFactor(symbol));
    if (form.with.back().of == TermQuantity::kGateDistance && form.on != TermOn::kFix) {
      throw TermError{"with",
                      "'d' is the distance of a fix to its gate: only fix_x, ... go with it"};
    }
  }
  return form;
}

}  // namespace trueline
