#include "problems/rotor_diagnosis/rotor_confirm.h"

#include <algorithm>

#include "problems/diagnosis/confirm.h"

namespace trueline {
namespace {

bool Testable(const Candidate& candidate, const std::vector<Candidate>& there) {
  if (IsStep(candidate)) return false;
  return std::any_of(there.begin(), there.end(),
                     [&](const Candidate& c) { return c.info->id == candidate.info->id; });
}

}  // namespace

void AddRotorRepeats(const FlightLog& log, const RotorDiagnosisOptions& options,
                     std::vector<Cause>* causes) {
  if (causes->empty()) return;
  RotorSearch search(log, options.calibration);
  std::vector<RotorFound> found;
  search.Fit(&found);
  const RotorWorld& base = search.world();
  const std::vector<Candidate> listed =
      RotorCandidatesFor(base.data, base.model.num_rotors(), base.prior);
  std::vector<Cause*> tested;
  for (Cause& cause : *causes) {
    cause.repeats.push_back({log.directory, "can't be tested", {}, {}, 1.0});
    if (!Testable(cause.candidate, listed)) continue;
    found.push_back({cause.candidate, cause.value});
    tested.push_back(&cause);
  }
  if (found.empty()) return;
  search.Fit(&found);
  for (std::size_t k = 0; k < found.size(); ++k) {
    tested[k]->repeats.back() = RepeatOf(*tested[k], found[k].value, search.TestFound(found, k));
    tested[k]->repeats.back().log = log.directory;
  }
}

}  // namespace trueline
