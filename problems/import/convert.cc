#include "problems/import/convert.h"

#include <fmt/ranges.h>

#include <filesystem>

#include "problems/common/error.h"
#include "problems/common/sha256.h"
#include "problems/import/cut.h"
#include "problems/import/stream_import.h"

namespace trueline {
namespace {

// Reads the rows of one file for the streams that come from it.
void ReadFile(const std::string& file, const CsvDialect& dialect,
              const std::vector<StreamImport*>& streams, std::vector<std::string>* warnings) {
  ForeignCsv csv(file, dialect, warnings);
  bool any = false;
  for (; csv.Next(); any = true) {
    for (StreamImport* stream : streams) stream->AddRow(csv);
  }
  if (!any) throw ErrorAt(file, 0, "has no rows; give the path of a recorded log");
  for (StreamImport* stream : streams) stream->Finish(warnings);
}

void RequireOneFileForEachInput(const ImportMap& map, const std::vector<std::string>& files) {
  if (files.size() == map.inputs.size()) return;
  std::vector<std::string> names;
  for (const InputMap& input : map.inputs) names.push_back(input.name);
  throw InputError(fmt::format("{} needs {} files, in this order: {}; found {}", map.file,
                               names.size(), fmt::join(names, ", "), files.size()));
}

std::string LogName(const ImportMap& map, const std::string& file) {
  std::string name = map.name;
  const std::string stem = std::filesystem::path(file).stem().string();
  const std::size_t place = name.find("{stem}");
  if (place != std::string::npos) name.replace(place, 6, stem);
  return name;
}

void Describe(const ImportMap& map, const std::vector<std::string>& files, FlightLog* log) {
  log->name = LogName(map, files.front());
  log->gravity = map.gravity;
  log->environment = map.environment;
  log->gates = map.gates;
  log->vehicle = map.vehicle;
  std::vector<std::string> names;
  std::vector<std::string> digests;
  for (const std::string& file : files) {
    names.push_back(std::filesystem::path(file).filename().string());
    digests.push_back(Sha256OfFile(file));
  }
  log->source = {{"file", fmt::format("{}", fmt::join(names, ", "))},
                 {"sha256", fmt::format("{}", fmt::join(digests, ", "))}};
  if (!map.dataset.empty()) log->source["dataset"] = map.dataset;
}

// The straights: given for the first pattern that matches the file's name, or found by curvature.
std::vector<Straight> StraightsOf(const FixesFromMocap& options, const std::string& file,
                                  const std::vector<PoseSample>& mocap) {
  for (const StraightsMap& straights : options.straights) {
    if (!Fits(straights.pattern, file)) continue;
    if (straights.boxes.empty()) return FindStraights(mocap, straights.curvature, options.limits);
    return StraightsInBoxes(mocap, straights.boxes, options.limits);
  }
  return FindStraights(mocap, {}, options.limits);
}

void AddSampledFixes(const FixesFromMocap& options, const std::string& file, std::uint64_t seed,
                     FlightLog* log) {
  const std::vector<Straight> straights = StraightsOf(options, file, log->mocap);
  if (straights.empty()) {
    throw ErrorAt(file, 0,
                  "mocap shows no straight to sample fixes on; state 'straights' in the "
                  "map, or raise 'max_curvature' or 'flattest_share'");
  }
  Random random(seed, "fixes");
  log->fixes = SampleFixes(log->mocap, straights, options.sampler, random);
  log->gates = GatesOf(straights);
}

}  // namespace

FlightLog ConvertLog(const ImportMap& map, const std::vector<std::string>& files,
                     const ConvertOptions& options) {
  RequireOneFileForEachInput(map, files);
  FlightLog log;
  Describe(map, files, &log);
  const auto imports = MakeImports(map, files, options.fix_sigma, &log);
  for (std::size_t i = 0; i < files.size(); ++i) {
    std::vector<StreamImport*> of_file;
    for (const auto& stream : imports) {
      if (stream->input() == i) of_file.push_back(stream.get());
    }
    ReadFile(files[i], map.inputs[i].dialect, of_file, &log.warnings);
  }
  if (log.imu.empty()) {
    throw ErrorAt(map.file, 0, "'streams.imu' keeps no row; check 'new_where' and 'accept'");
  }
  CutLog(map.cut, map.file, &log);
  const auto& sampled = options.fixes_from_mocap ? options.fixes_from_mocap : map.fixes_from_mocap;
  if (sampled) AddSampledFixes(*sampled, files.front(), options.seed, &log);
  return log;
}

}  // namespace trueline
