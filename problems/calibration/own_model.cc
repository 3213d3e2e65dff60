#include "problems/calibration/own_model.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "problems/common/strict_yaml.h"
#include "problems/effects/declaration.h"

namespace trueline {
namespace {

constexpr char kStream[] = "imu.csv";

// The digests of the recordings that were fitted; none if the model does not state them.
std::set<std::string> FittedDigests(const std::string& model_file) {
  const YamlMap model = YamlMap::FromFile(model_file);
  std::set<std::string> digests;
  const auto add = [&](const YamlMap& of) {
    digests.insert(of.ChildOrEmpty("sha256").Get<std::string>(kStream, ""));
  };
  if (!model.Has("provenance")) return digests;
  const YamlMap provenance = model.Child("provenance");
  add(provenance);
  for (const YamlMap& further : provenance.Children("further")) add(further);
  digests.erase("");
  return digests;
}

bool IsAmong(const std::set<std::string>& digests, const FlightLog& log) {
  const auto of_log = log.sha256.find(kStream);
  return of_log != log.sha256.end() && digests.contains(of_log->second);
}

std::string LeftOutWarning(const std::string& model_file, const std::vector<Effect>& effects,
                           const std::set<std::string>& changed) {
  std::vector<std::string> words;
  words.reserve(effects.size());
  for (const Effect& effect : effects) words.push_back(InWords(effect));
  const std::string constants =
      changed.empty()
          ? ""
          : fmt::format("; the model's {} held before that, so the configuration's priors stay",
                        fmt::join(changed, " and "));
  return fmt::format(
      "{} was fitted to another flight, and what belongs to that flight is left out: {}{}. If this "
      "flight has it too, trueline-diagnose without --model finds it",
      model_file, fmt::join(words, ", "), constants);
}

}  // namespace

bool IsFittedTo(const std::string& model_file, const FlightLog& log) {
  return IsAmong(FittedDigests(model_file), log);
}

std::string OwnModelWarning(const std::string& model_file) {
  return fmt::format(
      "{} was fitted to this very flight: its constants are not used as a prior, which would count "
      "the same data twice; its effects are. Give the model of another flight of the vehicle",
      model_file);
}

std::set<std::string> LeaveOutOtherFlights(const std::string& model_file,
                                           std::span<const FlightLog> logs,
                                           std::vector<Effect>* effects,
                                           std::vector<std::string>* warnings) {
  std::set<std::string> changed;
  const std::set<std::string> digests = FittedDigests(model_file);
  const auto own = [&](const FlightLog& log) { return IsAmong(digests, log); };
  if (digests.empty() || std::ranges::all_of(logs, own)) return changed;
  const auto others = std::stable_partition(effects->begin(), effects->end(),
                                            [](const Effect& e) { return !IsOfOneFlight(e); });
  const std::vector<Effect> left_out(others, effects->end());
  effects->erase(others, effects->end());
  if (left_out.empty()) return changed;
  for (const Effect& effect : left_out) {
    const std::vector<std::string>& names = InfoOf(effect).changes;
    changed.insert(names.begin(), names.end());
  }
  warnings->push_back(LeftOutWarning(model_file, left_out, changed));
  return changed;
}

}  // namespace trueline
