#include "problems/diagnosis/verdict.h"

#include <algorithm>

namespace trueline {

std::string VerdictOf(const std::vector<Cause>& causes, const std::vector<Cause>& set_aside,
                      const std::vector<std::string>& unexplained_by) {
  const auto claimed = [](const Cause& c) { return c.confirmed.value_or(true); };
  if (std::none_of(causes.begin(), causes.end(), claimed)) {
    const bool clean = causes.empty() && set_aside.empty() && unexplained_by.empty();
    return clean ? "clean" : "unexplained";
  }
  // A significant misfit remains, so the causes explain only a part of it.
  if (!unexplained_by.empty()) return "unexplained";
  const bool ambiguous = std::any_of(causes.begin(), causes.end(), [&](const Cause& c) {
    return claimed(c) && !c.confused_with.empty();
  });
  return ambiguous ? "ambiguous" : "explained";
}

}  // namespace trueline
