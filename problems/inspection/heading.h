// The heading of positions against that of attitude.csv, by the acceleration that both know.
#pragma once

#include <optional>
#include <string>

#include "problems/inspection/examination.h"

namespace trueline {

struct Heading {
  double angle;  // rad, about down: how far the positions' north is turned from the attitude's
  double sigma;  // rad, by the jackknife
};

// Of a stream of positions at a high rate (mocap, fixes): by second differences. None where the
// two are too unlike, or differ by more than a heading.
std::optional<Heading> HeadingByBends(const Examination& e, const std::string& stream);

// Of fixes that come in passes, by the change of speed from one pass to the next.
std::optional<Heading> HeadingByPasses(const Examination& e);

}  // namespace trueline
