// trueline-export: a vehicle for a simulator, a result or a log in the format of another program.
#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "apps/main/flags.h"
#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/result/render.h"
#include "problems/simulators/audit.h"
#include "problems/simulators/export_vehicle.h"

DEFINE_string(model, "", "model.yaml of a calibration or diagnosis with --drive=rotors");
DEFINE_string(result, "", "in place of --model: a result folder of calibrate or diagnose");
DEFINE_string(log, "", "with --result: the log that it was made from; alone: what is written");
DEFINE_string(to, "", "the simulator, or the format of a result or log; list names them");
DEFINE_string(out, "", "the file to write; further files of the simulator go beside it");
DEFINE_bool(quiet, false, "print nothing but errors");

namespace {

constexpr char kUsage[] =
    R"(Writes for other programs: a vehicle for a simulator, a path for a plot, a log as PX4's.

  trueline calibrate --drive=rotors --log=flight --out=result --config=config/calibrate/rotors.yaml
  trueline export --model=result/model.yaml --to=gz --out=vehicle.sdf
      an SDF model with the motor plugins of Gazebo; what Gazebo can't express is printed, and
      stands in vehicle.sdf.lost.yaml, with the position error that it costs after 0.5 s
  trueline export --model=result/model.yaml --to=pyflyt --out=vehicle.yaml
      also writes vehicle.urdf beside it
  trueline export --to=list
      the simulators
  trueline export --result=result --to=tum --out=path.tum
      the fitted trajectory as a TUM file: evo_traj tum path.tum --plot
  trueline export --result=result --to=mcap --out=result.mcap
      paths, ellipses, residuals and parameters over time: opens in Foxglove, PlotJuggler and Rerun
  trueline export --result=result --to=picture --out=result.svg
      a diagnosis before and after, or the arcs of a calibration, from above
  trueline export --log=flight --to=ulog --out=flight.ulg
      what PX4 would have logged of a (simulated) flight: a file to try converters with
  trueline audit --simulator=vehicle.sdf --log=flight2 --out=audit
      what another flight says of that file

Exit codes: 0 done, 2 bad input or usage, 1 a defect.)";

const std::vector<std::string> kOfResult = {"tum", "mcap", "picture"};
const std::vector<std::string> kOfLog = {"ulog",      "dataflash", "blackbox",
                                         "crazyflie", "tum",       "csv"};

// A result, or a log alone, by the scripts of the pages.
int ExportByScript() {
  const bool result = !FLAGS_result.empty();
  const std::vector<std::string>& known = result ? kOfResult : kOfLog;
  if (std::ranges::find(known, FLAGS_to) == known.end() || FLAGS_out.empty()) {
    throw trueline::InputError(fmt::format("with {} give --out, and --to as one of {}",
                                           result ? "--result" : "--log", fmt::join(known, ", ")));
  }
  std::vector<std::string> arguments = {"--result=" + (result ? FLAGS_result : FLAGS_log)};
  if (!result) arguments.push_back("--format=" + FLAGS_to);
  if (result && !FLAGS_log.empty()) arguments.push_back("--log=" + FLAGS_log);
  const std::string failure =
      trueline::RunReport(result ? FLAGS_to : "foreign_log", arguments, FLAGS_out);
  if (!failure.empty()) throw trueline::InputError(failure);
  if (!FLAGS_quiet) fmt::print("results: {}\n", FLAGS_out);
  return trueline::kExitDone;
}

int Run() {
  if (FLAGS_to == "list") {
    fmt::print("{}of a --result: {}\nof a --log: {}\n", trueline::TargetList(),
               fmt::join(kOfResult, ", "), fmt::join(kOfLog, ", "));
    return trueline::kExitDone;
  }
  if (!FLAGS_result.empty() || (FLAGS_model.empty() && !FLAGS_log.empty())) return ExportByScript();
  if (FLAGS_model.empty() || FLAGS_to.empty() || FLAGS_out.empty()) {
    throw trueline::InputError("--model, --to and --out are needed; see trueline export --help");
  }
  const trueline::Target& target = trueline::FindTarget(FLAGS_to);
  if (std::filesystem::is_directory(FLAGS_model)) {
    throw trueline::InputError("--model=" + FLAGS_model +
                               ": is a folder; give the model.yaml in it, or the folder by "
                               "--result for tum and mcap");
  }
  const trueline::NeutralVehicle model = trueline::VehicleFromModel(FLAGS_model);
  for (const auto& [name, text] : trueline::ImpossibleInertia(model)) {
    trueline::Warn(FLAGS_model + ": " + name + ": " + text, FLAGS_quiet);
  }
  const trueline::Export exported = trueline::ExportVehicle(model, target);
  trueline::WriteExport(exported, target, FLAGS_out);
  if (!FLAGS_quiet) {
    fmt::print(stderr, "{}", trueline::LossText(exported, target));
    fmt::print("results: {}\n", FLAGS_out);
  }
  return trueline::kExitDone;
}

}  // namespace

TRUELINE_VERB("export", kUsage, Run);
