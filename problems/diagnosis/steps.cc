#include "problems/diagnosis/steps.h"

#include <algorithm>
#include <map>

namespace trueline {
namespace {

// The same step effect at `count` times within +-`range` s of the candidate's.
std::vector<Candidate> StepsAround(const Candidate& candidate, double range, int count) {
  std::vector<Candidate> candidates(count, candidate);
  for (int k = 0; k < count; ++k) {
    candidates[k].fixed["t_step"] += range * (2.0 * k / (count - 1) - 1.0);
  }
  return candidates;
}

struct Estimated {
  Found found;
  double gain;
};

std::vector<Estimated> EstimateEach(const std::vector<Candidate>& candidates,
                                    const DiagnosedFlight& flight) {
  const auto fit = flight.Linearise(candidates, false);
  const std::vector<int> modelled = fit->Modelled();
  std::vector<Estimated> estimated;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    const Candidate& c = candidates[i];
    const LinearEstimate estimate = Estimate(*fit, modelled, fit->candidates[i].columns);
    const Eigen::VectorXd sizes = fit->candidates[i].Sizes(*c.info, estimate.value);
    estimated.push_back({{c, c.Neutral() + sizes}, estimate.gain});
  }
  return estimated;
}

// The best time within +-`range` s of the candidate's.
Found BestStep(const Candidate& candidate, double range, int count, const DiagnosedFlight& flight) {
  const auto estimated = EstimateEach(StepsAround(candidate, range, count), flight);
  return std::ranges::max_element(estimated, {}, &Estimated::gain)->found;
}

}  // namespace

std::vector<Candidate> WithRefinedSteps(std::vector<Candidate> candidates,
                                        const DiagnosedFlight& flight) {
  std::vector<Candidate> steps = candidates;
  std::erase_if(steps, [](const Candidate& c) { return !c.IsStep(); });
  if (steps.empty()) return candidates;
  std::map<std::string, Estimated> best;  // by id
  for (const Estimated& e : EstimateEach(steps, flight)) {
    const auto [at, added] = best.try_emplace(e.found.candidate.id(), e);
    if (!added && e.gain > at->second.gain) at->second = e;
  }
  const double range = flight.Scope().StepSpacing() * (kFinerSteps - 1) / kFinerSteps;
  for (const auto& [id, coarse] : best) {
    const Candidate& at = coarse.found.candidate;
    *std::ranges::find(candidates, at) = BestStep(at, range, 2 * kFinerSteps - 1, flight).candidate;
  }
  return candidates;
}

Found Refined(const Tested& effect, const DiagnosedFlight& flight) {
  Found refined{effect.candidate, effect.value};
  if (!effect.candidate.IsStep()) return refined;
  double range = flight.Scope().StepSpacing() / kFinerSteps;
  for (int round = 0; round < 2; ++round, range /= 2 * kFinerSteps) {
    const Found found = BestStep(refined.candidate, range, 4 * kFinerSteps + 1, flight);
    if (Plausible(found.candidate, found.value)) refined = found;
  }
  return refined;
}

}  // namespace trueline
