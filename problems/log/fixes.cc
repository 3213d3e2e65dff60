#include "problems/log/fixes.h"

#include <algorithm>
#include <utility>

#include "problems/result/statistics.h"

namespace trueline {

double MedianSigma(const std::vector<Fix>& fixes) {
  std::vector<double> sigmas;
  for (const Fix& fix : fixes) sigmas.push_back(fix.sigma);
  return Quantile(std::move(sigmas), 0.5);
}

const Gate* GateOf(const FlightLog& log, int id) {
  const auto gate = std::ranges::find(log.gates, id, &Gate::id);
  return gate == log.gates.end() ? nullptr : &*gate;
}

}  // namespace trueline
