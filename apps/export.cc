// trueline-export: a calibrated vehicle as the parameter file of a simulator.
#include <fmt/format.h>

#include "apps/main/flags.h"
#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/simulators/write_export.h"

DEFINE_string(model, "", "model.yaml of a calibration or diagnosis with --drive=rotors");
DEFINE_string(to, "", "the simulator; list names them");
DEFINE_string(out, "", "the file to write; further files of the simulator go beside it");
DEFINE_bool(quiet, false, "print nothing but errors");

namespace {

constexpr char kUsage[] = R"(Writes a calibrated vehicle into the parameter file of a simulator.

  trueline-calibrate --drive=rotors --log=flight --out=result --config=config/calibrate/rotors.yaml
  trueline-export --model=result/model.yaml --to=gz --out=vehicle.sdf
      an SDF model with the motor plugins of Gazebo; what Gazebo can't express is printed, and
      stands in vehicle.sdf.lost.yaml, with the position error that it costs after 0.5 s
  trueline-export --model=result/model.yaml --to=pyflyt --out=vehicle.yaml
      also writes vehicle.urdf beside it
  trueline-export --to=list
      the simulators
  trueline-audit --simulator=vehicle.sdf --log=flight2 --out=audit
      what another flight says of that file

Exit codes: 0 done, 2 bad input or usage, 1 a defect.)";

int Run() {
  if (FLAGS_to == "list") {
    fmt::print("{}", trueline::TargetList());
    return trueline::kExitDone;
  }
  if (FLAGS_model.empty() || FLAGS_to.empty() || FLAGS_out.empty()) {
    throw trueline::InputError("--model, --to and --out are needed; see trueline-export --help");
  }
  const trueline::Target& target = trueline::FindTarget(FLAGS_to);
  const trueline::NeutralVehicle model = trueline::VehicleFromModel(FLAGS_model);
  const trueline::Export exported = trueline::ExportVehicle(model, target);
  trueline::WriteExport(exported, target, FLAGS_out);
  if (!FLAGS_quiet) fmt::print(stderr, "{}", trueline::LossText(exported, target));
  return trueline::kExitDone;
}

}  // namespace

TRUELINE_VERB("export", kUsage, Run);
