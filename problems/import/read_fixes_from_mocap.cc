// The `fixes_from_mocap` section of a column map.
#include <numbers>

#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/common/yaml_archive.h"
#include "problems/import/import_map.h"
#include "problems/log/csv_text.h"

namespace trueline {
namespace {

StraightLimits ReadStraightLimits(const YamlMap& map) {
  StraightLimits limits;
  limits.min_speed = map.Get<double>("min_speed", limits.min_speed);
  limits.min_length = map.Get<double>("min_length", limits.min_length);
  limits.max_gap = map.Get<double>("max_gap", limits.max_gap);
  limits.gate_distance = map.Get<double>("gate_distance", limits.gate_distance);
  map.Finish();
  return limits;
}

StraightBox ReadBox(const YamlMap& map) {
  StraightBox box;
  const std::array<const char*, 3> axes = {"x", "y", "z"};
  for (Eigen::Index i = 0; i < 3; ++i) {
    const char* axis = axes[static_cast<std::size_t>(i)];
    const auto range = map.GetOptional<std::array<double, 2>>(axis);
    if (!range) continue;
    if (!((*range)[0] < (*range)[1])) map.Fail(axis, "needs [low, high]");
    box.low[i] = (*range)[0];
    box.high[i] = (*range)[1];
  }
  const auto heading = map.GetOptional<double>("heading_deg");
  if (heading) box.heading = *heading * std::numbers::pi / 180.0;
  map.Finish();
  return box;
}

CurvatureOptions ReadCurvature(const YamlMap& map) {
  CurvatureOptions options;
  options.max_curvature = map.Get<double>("max_curvature", options.max_curvature);
  options.flattest_share = map.Get<double>("flattest_share", options.flattest_share);
  options.chord = map.Get<double>("chord", options.chord);
  options.merge_gap = map.Get<double>("merge_gap", options.merge_gap);
  if (!(options.chord > 0.0)) map.Fail("chord", "must be positive (m)");
  if (options.flattest_share < 0.0 || options.flattest_share > 1.0) {
    map.Fail("flattest_share", "must be within 0 and 1");
  }
  map.Finish();
  return options;
}

StraightsMap ReadStraights(const std::string& pattern, const YamlMap& map) {
  StraightsMap straights;
  straights.pattern = pattern;
  for (const YamlMap& box : map.Children("boxes")) straights.boxes.push_back(ReadBox(box));
  if (map.Has("curvature") == !straights.boxes.empty()) {
    map.Fail("curvature", "give either 'boxes' or 'curvature'");
  }
  straights.curvature = ReadCurvature(map.ChildOrEmpty("curvature"));
  map.Finish();
  return straights;
}

void ReadSampler(const YamlMap& map, FixSamplerOptions* options) {
  YamlArchive archive(map);
  archive.Value("min_count", &options->min_count);
  archive.Value("max_count", &options->max_count);
  archive.Value("sigma_factor", &options->sigma_factor);
  archive.Value("sigma_floor", &options->sigma_floor);
  archive.Value("student_dof", &options->student_dof);
  archive.Value("outlier_share", &options->outlier_share);
  archive.Value("outlier_size", &options->outlier_size);
  archive.Value("max_gap", &options->max_gap);
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

FixSamplerOptions ReadFixSamplerOptions(const YamlMap& map) {
  FixSamplerOptions options;
  ReadSampler(map, &options);
  try {
    options.Check();
  } catch (const InputError& error) {
    throw ErrorAt(map.file(), map.LineOf(""), error.what());
  }
  return options;
}

FixesFromMocap ReadFixesFromMocap(const YamlMap& map) {
  FixesFromMocap fixes;
  fixes.sampler = ReadFixSamplerOptions(map);
  fixes.limits = ReadStraightLimits(map.ChildOrEmpty("limits"));
  const YamlMap straights = map.ChildOrEmpty("straights");
  for (const std::string& pattern : straights.Keys()) {
    fixes.straights.push_back(ReadStraights(pattern, straights.Child(pattern)));
  }
  map.Finish();
  return fixes;
}

StraightBox ParseBoxCondition(const std::string& condition, const std::string& where) {
  std::vector<std::string_view> parts;
  SplitFields(condition, '<', &parts);
  StraightBox box;
  double low = 0.0;
  double high = 0.0;
  const bool known = parts.size() == 3 && parts[1].size() == 1 && parts[1][0] >= 'x' &&
                     parts[1][0] <= 'z' && ParseNumber(parts[0], &low) &&
                     ParseNumber(parts[2], &high) && low < high;
  if (!known) {
    throw InputError(
        fmt::format("{}: '{}' is no condition; write, for example, -0.9<x<0.9 (m, in "
                    "the NED axes of mocap.csv)",
                    where, condition));
  }
  box.low[parts[1][0] - 'x'] = low;
  box.high[parts[1][0] - 'x'] = high;
  return box;
}

std::optional<FixesFromMocap> OverrideFixes(const ImportMap& map,
                                            const std::map<std::string, double>& numbers,
                                            const std::string& straights) {
  FixesFromMocap fixes = map.fixes_from_mocap.value_or(FixesFromMocap{});
  YAML::Node given(YAML::NodeType::Map);
  for (const auto& [key, number] : numbers) {
    if (number >= 0.0) given[key] = fmt::format("{}", number);
  }
  ReadSampler(YamlMap(given, "flags", ""), &fixes.sampler);
  if (!straights.empty()) fixes.straights = {ParseStraights(straights)};
  if (given.size() == 0 && straights.empty()) return map.fixes_from_mocap;
  fixes.sampler.Check();
  if (map.streams.contains("fixes")) {
    throw InputError(map.file + " reads real fixes; flags of sampled ones don't go with it");
  }
  if (!map.streams.contains("mocap")) {
    throw InputError(map.file + " reads no mocap to sample fixes from");
  }
  return fixes;
}

}  // namespace trueline
