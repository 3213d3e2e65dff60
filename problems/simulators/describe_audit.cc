#include "problems/simulators/describe_audit.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "problems/simulators/judge_flights.h"

namespace trueline {
namespace {

// A ratio that a mistake of units makes.
struct UnitFactor {
  double factor;
  const char* text;
};
constexpr UnitFactor kUnitFactors[] = {
    {91.189, "rpm for rad/s, squared"},
    {9.5493, "rpm for rad/s"},
    {39.478, "revolutions for radians, squared"},
    {6.2832, "revolutions for radians"},
    {57.296, "degrees for radians"},
    {9.81, "kgf for N"},
    {10.0, "a power of ten"},
    {100.0, "a power of ten"},
    {1000.0, "a power of ten"},
    {2.0, "a factor of two"},
};
constexpr double kFactorSlack = 0.02;  // relative

}  // namespace

std::string UnitOf(const std::string& parameter) {
  if (parameter == "k_m/k_f" || parameter == "arm") return "m";
  const NeutralInfo* info = FindNeutral(parameter);
  return info != nullptr ? info->unit : "";
}

std::string RatioInWords(double file, double flight) {
  if (!(file != 0.0 && flight != 0.0)) return "";
  if (file / flight < 0.0) return "the sign is the other one";
  const double ratio = std::max(file / flight, flight / file);
  std::string text = fmt::format("{:.3g} times too {}", ratio,
                                 std::abs(file) > std::abs(flight) ? "large" : "small");
  const UnitFactor* nearest = std::ranges::min_element(
      kUnitFactors, {}, [&](const UnitFactor& f) { return std::abs(ratio / f.factor - 1.0); });
  const bool near = std::abs(ratio / nearest->factor - 1.0) < kFactorSlack;
  return near ? text + fmt::format(": {}?", nearest->text) : text;
}

NotJudged NotShown(const std::string& parameter, const FlightLog& log) {
  if (parameter == "k_m/k_f") {
    return {parameter, "yaw hard to both sides and stop, several times"};
  }
  const NeutralInfo* info = FindNeutral(parameter);
  if (info == nullptr || (*info->fly == '\0' && info->needs == 0)) {
    return {parameter, "fly each axis hard, and hover"};
  }
  std::string text = info->fly;
  const auto add = [&](unsigned need, bool has, const char* advice) {
    if ((info->needs & need) == 0 || has) return;
    text += (text.empty() ? "" : "; ") + std::string(advice);
  };
  add(kNeedsSpeeds, !log.rotors.empty(), "log measured rotor speeds");
  add(kNeedsCommands, !log.motors.empty(), "log motor commands");
  add(kNeedsMass, log.vehicle && log.vehicle->mass, "state the weighed mass in the log");
  return {parameter, text.empty() ? "the flight leaves it uncertain" : text};
}

std::string ErrorInWords(double error) {
  if (std::isnan(error)) return "no prediction";
  return std::isfinite(error) ? fmt::format("{:.3f} m", error) : "diverges";
}

void Place(const VehicleFile& file, const Reading* at, Contradicted* entry) {
  entry->file = file.files.front()->path().string();
  if (at == nullptr) return;
  entry->file = file.files[at->file]->path().string();
  entry->line = at->leaf != nullptr ? at->leaf->place.line : 0;
  entry->key = at->key;
}

void AddLacks(const std::map<std::string, FlightValue>& values, bool has_drag, bool has_lag,
              Audit* audit) {
  constexpr double kMentionedDrag = 0.1;  // 1/s
  constexpr double kMentionedTurn = 3.0;  // rad/m/s
  const auto clear = [&](const char* name, double least) {
    const auto found = values.find(name);
    return found != values.end() && found->second.shown && std::abs(found->second.value) > least &&
           std::abs(found->second.value) > kThreshold * found->second.sigma;
  };
  if (!has_drag && (clear("K_x", kMentionedDrag) || clear("K_y", kMentionedDrag))) {
    audit->lacks.push_back(
        {"linear_drag", fmt::format("the vehicle brakes with K_x {:.2f}, K_y {:.2f} 1/s",
                                    values.at("K_x").value, values.at("K_y").value)});
  }
  if (clear("L_v", kMentionedTurn) || clear("M_u", kMentionedTurn)) {
    audit->lacks.push_back(
        {"air_moment", fmt::format("air speed turns the vehicle: L_v {:.1f}, M_u {:.1f} rad/m/s",
                                   values.at("L_v").value, values.at("M_u").value)});
  }
  if (!has_lag && clear("tau", 0.01)) {
    audit->lacks.push_back(
        {"motor_lag",
         fmt::format("the rotors follow their commands with {:.3f} s", values.at("tau").value)});
  }
}

}  // namespace trueline
