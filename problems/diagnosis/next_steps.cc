#include "problems/diagnosis/next_steps.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

namespace trueline {
namespace {

// Flights that tell a cause from those which fit alike.
void AddFlightsThatSeparate(const Diagnosis& diagnosis, std::vector<std::string>* steps) {
  for (const Cause& cause : diagnosis.causes) {
    if (cause.confused_with.empty()) continue;
    steps->push_back(fmt::format("to tell {} from {}: {}", cause.candidate.Label(),
                                 fmt::join(cause.confused_with, ", "),
                                 cause.candidate.info->separate_by));
  }
}

bool AsksForAnotherFlight(const Diagnosis& diagnosis) {
  const bool unconfirmed =
      std::ranges::any_of(diagnosis.causes, [](const Cause& c) { return c.repeats.empty(); });
  return unconfirmed || (diagnosis.causes.empty() && diagnosis.verdict == "unexplained");
}

}  // namespace

std::string VerdictMeaning(const Diagnosis& diagnosis) {
  if (diagnosis.verdict == "clean") {
    return "nothing of the catalogue shows in this flight; smaller effects may be there unseen";
  }
  if (diagnosis.verdict == "explained") return "the causes leave no significant misfit";
  if (diagnosis.verdict == "ambiguous") {
    return "the causes leave no significant misfit, and others would explain it as well";
  }
  return diagnosis.causes.empty() ? "a significant misfit remains, and no cause of it is proven"
                                  : "beside the causes a significant misfit remains";
}

std::vector<std::string> NextSteps(const Diagnosis& diagnosis) {
  std::vector<std::string> steps;
  if (!diagnosis.log_faults.empty()) {
    steps.emplace_back(
        "put the log right first: trueline inspect --log=LOG says how, and writes "
        "corrected_map.yaml where a map can do it");
  }
  if (!diagnosis.in_model.empty()) {
    steps.emplace_back(
        "use what was found: trueline calibrate --log=LOG --model=RESULT/model.yaml --out=OUT");
  }
  AddFlightsThatSeparate(diagnosis, &steps);
  if (AsksForAnotherFlight(diagnosis)) {
    steps.emplace_back("confirm it: add a further flight of this vehicle, --log=LOG,LOG2");
  }
  if (diagnosis.verdict == "unexplained") {
    steps.emplace_back("see what the misfit is correlated with: report.html, section Misfit");
  }
  if (diagnosis.verdict == "clean") {
    steps.emplace_back("see how large each effect must be to be found: --verbose");
  }
  return steps;
}

}  // namespace trueline
