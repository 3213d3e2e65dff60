#include "problems/inspection/fix_pairs.h"

#include <algorithm>

#include "problems/inspection/motion.h"
#include "problems/trajectory/mocap_path.h"

namespace trueline {

PairsAt FixPairs(const FlightLog& log) {
  return [&log](double lag) {
    const LogClock clock(log);
    std::vector<VectorPair> pairs;
    const std::size_t every = std::max<std::size_t>(1, log.fixes.size() / 1500);
    for (std::size_t i = 0; i < log.fixes.size(); i += every) {
      const Fix& fix = log.fixes[i];
      if (const auto p = PositionAt(log.mocap, fix.t - FromSeconds(lag))) {
        pairs.push_back({clock(fix.t), fix.p_E, *p});
      }
    }
    return pairs;
  };
}

}  // namespace trueline
