#include <fmt/ostream.h>

#include <algorithm>

#include "problems/common/atomic_file.h"
#include "problems/common/parallel.h"
#include "problems/prediction/multi_step_experiment.h"
#include "problems/prediction/tube.h"

namespace trueline {
namespace {

constexpr char kHeader[] =
    "run,start row [1],step [1],px [m],py [m],pz [m],vx [m/s],vy [m/s],vz [m/s],"
    "qw [1],qx [1],qy [1],qz [1],wx [rad/s],wy [rad/s],wz [rad/s]";

// The tube's columns: "p 50 % [m]" and so on.
std::string Header() {
  std::string header = kHeader;
  for (const double chance : kTubeChances) {
    for (int a = 0; a < 4; ++a) {
      header +=
          fmt::format(",{} {:g} % [{}]", kScoredQuantities[a], 100.0 * chance, kScoredUnits[a]);
    }
  }
  return header;
}

void Print(const std::string& run, int row, const TubedStates& tubed, fmt::memory_buffer* out) {
  const auto text = fmt::appender(*out);
  for (int k = 0; k < PredictionWindow::kSteps; ++k) {
    fmt::format_to(text, "{},{},{}", run, row, k + 1);
    for (const double value : tubed.states.col(k)) fmt::format_to(text, ",{:.6g}", value);
    for (const QuantitySteps& radii : tubed.radii) {
      for (const auto& radius : radii) fmt::format_to(text, ",{:.4g}", radius[k]);
    }
    out->push_back('\n');
  }
}

// What the fit predicts from every `stride`-th row of a run. Windows are computed on all threads, a
// block at a time.
void PrintRun(const PredictionFit& fit, const PredictionSetup& setup, const PredictionRun& run,
              int stride, int threads, std::ostream& out) {
  constexpr int kPieces = 16, kPiece = 32;  // windows
  const PredictionModel model(setup.vehicle, fit.processes, fit.numbers);
  const std::string name = CsvField(run.name);
  const int windows = (run.num_windows() + stride - 1) / stride;
  for (int first = 0; first < windows; first += kPieces * kPiece) {
    std::array<fmt::memory_buffer, kPieces> texts;
    ParallelFor(kPieces, threads, [&](int i) {
      const int begin = first + i * kPiece, end = std::min(begin + kPiece, windows);
      for (int w = begin; w < end; ++w) {
        const int row = w * stride;
        Print(name, row, PredictTube(model, fit.numbers, fit.tube, run, row), &texts[i]);
      }
    });
    for (const fmt::memory_buffer& text : texts) {
      out.write(text.data(), static_cast<std::streamsize>(text.size()));
    }
  }
}

}  // namespace

void WritePredictions(const MultiStepExperiment& experiment, const MultiStepResult& result,
                      int threads, const std::filesystem::path& directory) {
  WriteCsv(directory / "predictions.csv", Header(), [&](std::ostream& out) {
    for (const PredictionRun& run : result.predicted) {
      PrintRun(result.FitFor(run.trajectory), experiment.setup, run, experiment.predictions_stride,
               threads, out);
    }
  });
}

}  // namespace trueline
