#include "problems/import/fix_flags.h"

#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/import/read_fixes_from_mocap.h"

namespace trueline {
namespace {

template <class T>
bool Override(T flag, T* option) {
  if (flag < T{0}) return false;
  *option = flag;
  return true;
}

StraightsMap ParseStraights(const std::string& text) {
  StraightsMap straights;
  straights.pattern = "*";
  if (text == "auto") return straights;
  StraightBox box;
  for (const std::string& condition : SplitList(text, ';')) {
    const StraightBox one = ParseBoxCondition(condition, "--straights");
    box.low = box.low.cwiseMax(one.low);
    box.high = box.high.cwiseMin(one.high);
  }
  straights.boxes.push_back(box);
  return straights;
}

}  // namespace

std::optional<FixesFromMocap> OverrideFixes(const ImportMap& map, const FixFlags& flags) {
  FixesFromMocap fixes = map.fixes_from_mocap.value_or(FixesFromMocap{});
  FixSamplerOptions& sampler = fixes.sampler;
  bool asked = Override(flags.min_count, &sampler.min_count);
  asked |= Override(flags.max_count, &sampler.max_count);
  asked |= Override(flags.sigma_factor, &sampler.sigma_factor);
  asked |= Override(flags.sigma_floor, &sampler.sigma_floor);
  asked |= Override(flags.student_dof, &sampler.student_dof);
  asked |= Override(flags.outlier_share, &sampler.outlier_share);
  asked |= Override(flags.outlier_size, &sampler.outlier_size);
  if (!flags.straights.empty()) {
    fixes.straights = {ParseStraights(flags.straights)};
    asked = true;
  }
  if (!asked) return map.fixes_from_mocap;
  sampler.Check();
  if (map.streams.contains("fixes")) {
    throw InputError(map.file + " reads real fixes; flags of sampled ones don't go with it");
  }
  if (!map.streams.contains("mocap")) {
    throw InputError(map.file + " reads no mocap to sample fixes from");
  }
  return fixes;
}

}  // namespace trueline
