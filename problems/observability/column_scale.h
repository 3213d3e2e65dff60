// Usual standard deviations of the error states, by which a Gramian's columns are scaled (Boehm et
// al. 2020, sec. II-C).
#pragma once

#include <cstdint>
#include <vector>

#include "problems/common/yaml_archive.h"
#include "problems/observability/rotor_driven_system.h"
#include "problems/trajectory/catalogue.h"
#include "problems/trajectory/limits.h"

namespace trueline {

// kBound: root mean square of the Cramer-Rao bounds over random flights. kDeviation: as published,
// the standard deviation of what the filter estimates at the end of random flights; a constant
// alone has one. kTypical: sizes that the model states; no flight is flown.
enum class ColumnScale { kBound, kDeviation, kTypical };

struct ColumnScaleOptions {
  ColumnScale kind = ColumnScale::kBound;
  int flights = 30;  // random ones
  SplineShape shape;
  FlightLimits limits;
  std::uint64_t seed = 0;
  int threads = 0;  // 0: all cores
};

// By error state. States that no flight shows, and those that have no deviation, keep their typical
// size. Independent of `threads`. Throws InputError if fewer than two of the flights can be flown
// (kDeviation).
std::vector<double> FindColumnScale(const RotorDrivenSystem& system, const RotorVehicle& vehicle,
                                    const std::vector<int>& asked,
                                    const ColumnScaleOptions& options);

// Keys `scale` and `scale_flights`.
void Serialize(YamlArchive* a, ColumnScaleOptions* o);

}  // namespace trueline
